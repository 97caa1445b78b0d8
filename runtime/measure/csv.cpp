#include "runtime/measure/csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace trimray {
namespace {

Error bad_quote(size_t number)
{
    return {ErrorCode::InvalidBaseline, fmt::format("line {}", number),
            "a quoted field must end with a quote, before a comma or the line's end"};
}

Result<std::vector<std::string>> parse_line(std::string_view line, size_t number)
{
    std::vector<std::string> fields(1);
    bool quoted = false;
    for (size_t i = 0; i < line.size(); ++i) {
        const char c = line[i];
        const bool ends_field = i + 1 == line.size() || line[i + 1] == ',';
        if (quoted && c == '"' && !ends_field && line[i + 1] == '"')
            fields.back() += line[i++];
        else if (quoted && c == '"' && !ends_field)
            return bad_quote(number);
        else if (c == '"' && (quoted || i == 0 || line[i - 1] == ','))
            quoted = !quoted;
        else if (c == ',' && !quoted)
            fields.emplace_back();
        else
            fields.back() += c;
    }
    if (quoted)
        return bad_quote(number);
    return fields;
}

} // namespace

std::string csv_quoted(const std::string& field)
{
    std::string out = "\"";
    for (const char c : field)
        out += c == '"' ? std::string("\"\"") : std::string(1, c);
    return out + '"';
}

Result<std::vector<CsvLine>> parse_csv(std::string_view text)
{
    std::vector<CsvLine> lines;
    for (size_t number = 1; !text.empty(); ++number) {
        const size_t end = std::min(text.find('\n'), text.size());
        std::string_view line = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        if (line.ends_with('\r'))
            line.remove_suffix(1);
        if (line.empty())
            continue;
        Result<std::vector<std::string>> fields = parse_line(line, number);
        if (!fields.ok())
            return fields.error();
        lines.push_back({number, std::move(*fields)});
    }
    return lines;
}

} // namespace trimray
