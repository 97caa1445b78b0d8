// The names of other files that a STEP file refers to: an assembly whose parts are files of their own.
#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <string_view>

namespace trimray {

/// Finds them while the bytes go by. The CAD kernel takes a part's file name from a DOCUMENT_FILE, from the
/// APPLIED_EXTERNAL_IDENTIFICATION_ASSIGNMENT or EXTERNAL_SOURCE that goes with it, or from a DOCUMENT (AP203), and
/// which of their strings it is depends on the writer (STEPConstruct_ExternRefs::FileName). So every string of a
/// statement that has DOCUMENT or EXTERNAL_ in it counts as a name; those that name no file do no harm.
class StepReferences {
public:
    void add(std::string_view chunk);
    /// As the file has them and, where they hold other letters (\X2\00E4\X0\), also in UTF-8.
    const std::set<std::string>& names() const { return names_; }
    /// There are more names than are kept.
    bool overflown() const { return names_.size() > kMaxNames; }

private:
    static constexpr size_t kMaxNames = 1'000'000;

    size_t begin_after_seam(std::string_view chunk);
    size_t read_statement(std::string_view chunk, size_t at);
    size_t end_statement(size_t at);
    void end_string();

    std::string tail_; // of the chunks before, too short to hold a keyword
    std::string text_; // of the string being read
    bool in_statement_ = false, in_string_ = false;
    bool after_string_ = false; // a quote was the last character: the string's end, or the first of two
    char before_ = 0;           // the last character of the statement
    size_t statement_bytes_ = 0;
    std::set<std::string> names_;
};

/// A string of a STEP file with its escapes \X\hh, \X2\hhhh...\X0\ and \X4\hhhhhhhh...\X0\ (ISO 10303-21, 6.4.3) as
/// UTF-8.
std::string decode_step_string(std::string_view text);

} // namespace trimray
