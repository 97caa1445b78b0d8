// Tables as CSV (RFC 4180), as far as the benches write and read them again.
#pragma once

#include "format/result.h"

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace trimray {

/// A field in quotes, whatever is in it.
std::string csv_quoted(const std::string& field);

struct CsvLine {
    size_t number = 0; // in the file, from 1
    std::vector<std::string> fields;
};

/// The lines of a table; empty ones are left out. A quoted field stays on its line. Fails: InvalidBaseline, at
/// "line N" (a quote that is not closed, or closed within the field).
Result<std::vector<CsvLine>> parse_csv(std::string_view text);

} // namespace trimray
