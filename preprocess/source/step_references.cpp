#include "preprocess/source/step_references.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <iterator>
#include <utility>

namespace trimray {
namespace {

constexpr std::string_view kKeywords[] = {"DOCUMENT", "EXTERNAL_"};
constexpr size_t kLongestKeyword = 9;
constexpr size_t kMaxName = 4096;         // PATH_MAX: a longer string names no file
constexpr size_t kMaxStatement = 1 << 16; // far above what these statements have

/// False if no keyword is in `text`: none is without the two letters of its own that are looked for here. Few other
/// words of STEP files have them, and compilers make vector code of this loop: a third of the time that memmem takes
/// for both.
bool may_hold_keyword(std::string_view text)
{
    unsigned char found = 0;
    for (size_t i = 0; i + 1 < text.size(); ++i)
        found |= ((text[i] == 'U') & (text[i + 1] == 'M')) | ((text[i] == 'R') & (text[i + 1] == 'N'));
    return found != 0;
}

/// Where the first keyword that begins at `at` or later ends; npos if there is none.
size_t end_of_keyword(std::string_view text, size_t at)
{
    constexpr size_t kBlock = 1024;
    for (; at < text.size(); at += kBlock) {
        const std::string_view block = text.substr(at, kBlock + kLongestKeyword - 1);
        if (may_hold_keyword(block))
            for (size_t i = 0; i < std::min(kBlock, block.size()); ++i)
                for (const std::string_view keyword : kKeywords)
                    if (block.substr(i).starts_with(keyword))
                        return at + i + keyword.size();
    }
    return std::string_view::npos;
}

void append_utf8(std::string& out, uint32_t code)
{
    const auto more = [&](int shift) { out += static_cast<char>(0x80 | (code >> shift & 0x3f)); };
    if (code < 0x80) {
        out += static_cast<char>(code);
    } else if (code < 0x800) {
        out += static_cast<char>(0xc0 | code >> 6);
        more(0);
    } else if (code < 0x10000) {
        out += static_cast<char>(0xe0 | code >> 12);
        more(6);
        more(0);
    } else {
        out += static_cast<char>(0xf0 | (code >> 18 & 0x07));
        more(12);
        more(6);
        more(0);
    }
}

/// Appends the letters that `digits` hexadecimal digits each stand for, up to the first thing that is none; returns how
/// much of `text` that was. Two halves of UTF-16 become one letter.
size_t append_hex_letters(std::string& out, std::string_view text, size_t digits, size_t most)
{
    size_t at = 0;
    uint32_t high = 0;
    for (size_t i = 0; i < most && at + digits <= text.size(); ++i, at += digits) {
        uint32_t code = 0;
        const auto [end, error] = std::from_chars(&text[at], &text[at] + digits, code, 16);
        if (error != std::errc() || end != &text[at] + digits)
            break;
        if (code >= 0xd800 && code < 0xdc00) {
            high = code;
            continue;
        }
        if (high != 0 && code >= 0xdc00 && code < 0xe000)
            code = 0x10000 + ((high - 0xd800) << 10) + (code - 0xdc00);
        high = 0;
        append_utf8(out, code);
    }
    return at;
}

} // namespace

std::string decode_step_string(std::string_view text)
{
    std::string out;
    for (size_t at = 0; at < text.size();) {
        const std::string_view rest = text.substr(at);
        if (rest.starts_with("\\X\\"))
            at += 3 + append_hex_letters(out, rest.substr(3), 2, 1);
        else if (rest.starts_with("\\X2\\"))
            at += 4 + append_hex_letters(out, rest.substr(4), 4, rest.size());
        else if (rest.starts_with("\\X4\\"))
            at += 4 + append_hex_letters(out, rest.substr(4), 8, rest.size());
        else if (rest.starts_with("\\X0\\"))
            at += 4;
        else
            out += text[at++];
    }
    return out;
}

void StepReferences::add(std::string_view chunk)
{
    size_t at = in_statement_ ? 0 : begin_after_seam(chunk);
    while (at < chunk.size()) {
        if (in_statement_) {
            at = read_statement(chunk, at);
            continue;
        }
        const size_t end = end_of_keyword(chunk, at);
        if (end == std::string_view::npos)
            break;
        in_statement_ = true;
        at = end;
    }
    if (in_statement_ || at > 0)
        tail_.clear();
    if (!in_statement_) {
        tail_ += chunk.substr(std::max(at, chunk.size() - std::min(chunk.size(), kLongestKeyword - 1)));
        tail_.erase(0, tail_.size() - std::min(tail_.size(), kLongestKeyword - 1));
    }
}

/// Looks for a keyword that began in the chunks before: where it ends in `chunk`, 0 if there is none.
size_t StepReferences::begin_after_seam(std::string_view chunk)
{
    const std::string seam = tail_ + std::string(chunk.substr(0, kLongestKeyword - 1));
    const size_t end = end_of_keyword(seam, 0);
    if (end == std::string_view::npos)
        return 0;
    in_statement_ = end > tail_.size();
    return in_statement_ ? end - tail_.size() : 0;
}

/// Reads strings up to the statement's end; returns where it went on to.
size_t StepReferences::read_statement(std::string_view chunk, size_t at)
{
    for (; at < chunk.size(); ++at) {
        const char c = chunk[at], before = std::exchange(before_, c);
        // Where the keyword stood in a string, as a product's name may have it, strings and the rest change places. A
        // semicolon before a line's end or the next statement's number ends the statement all the same, or its length.
        const bool lost = before == ';' && (c == '\n' || c == '\r' || c == '#');
        if (lost || ++statement_bytes_ > kMaxStatement) {
            text_.clear();
            in_string_ = after_string_ = false;
            return end_statement(at);
        }
        if (after_string_ && c != '\'')
            end_string();
        if (in_string_ && c != '\'') {
            if (c != '\n' && c != '\r' && text_.size() <= kMaxName)
                text_ += c;
        } else if (c == '\'') {
            if (after_string_) // two of them: one, in the string
                text_ += c;
            after_string_ = in_string_;
            in_string_ = !in_string_;
        } else if (c == ';') {
            return end_statement(at + 1);
        }
    }
    return at;
}

size_t StepReferences::end_statement(size_t at)
{
    in_statement_ = false;
    before_ = 0;
    statement_bytes_ = 0;
    return at;
}

void StepReferences::end_string()
{
    if (!text_.empty() && text_.size() <= kMaxName && !overflown()) {
        names_.insert(text_);
        if (text_.find('\\') != std::string::npos)
            names_.insert(decode_step_string(text_));
    }
    text_.clear();
    after_string_ = false;
}

} // namespace trimray
