#include "runtime/command_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>

namespace trimray {
namespace {

/// Optimal string alignment distance: like Levenshtein's, and a swap of neighbours counts one.
size_t edit_distance(std::string_view a, std::string_view b)
{
    std::vector<std::vector<size_t>> d(a.size() + 1, std::vector<size_t>(b.size() + 1));
    for (size_t i = 0; i <= a.size(); ++i)
        for (size_t j = 0; j <= b.size(); ++j) {
            if (i == 0 || j == 0) {
                d[i][j] = i + j;
                continue;
            }
            d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
        }
    return d[a.size()][b.size()];
}

} // namespace

std::string printable(std::string_view text)
{
    std::string line(text);
    for (char& c : line)
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
            c = ' ';
    // U+0080..U+009F are control characters too: C2 80..C2 9F in UTF-8
    for (size_t i = 0; i + 1 < line.size(); ++i)
        if (line[i] == '\xc2' && static_cast<unsigned char>(line[i + 1]) < 0xa0)
            line.replace(i, 2, "  ");
    return line;
}

int report_error(const Error& error)
{
    const std::string where = error.where.empty() ? "" : printable(error.where) + ": ";
    fmt::print(stderr, "trimray: {}{} [E{}]\n", where, printable(error.detail), static_cast<int>(error.code));
    return exit_code(error);
}

void report_note(std::string_view text)
{
    fmt::print(stderr, "trimray: {}\n", printable(text));
}

std::string nearest_word(std::string_view word, const std::vector<std::string>& candidates)
{
    std::string best;
    size_t best_distance = std::max<size_t>(1, word.size() / 3) + 1;
    for (const std::string& candidate : candidates) {
        const bool completes = word.size() >= 2 && candidate.starts_with(word); // "val" for "validate"
        const size_t distance = completes ? 0 : edit_distance(word, candidate);
        if (distance < best_distance) {
            best_distance = distance;
            best = candidate;
        }
    }
    return best;
}

Result<std::vector<double>> parse_numbers(const std::string& option, const std::string& text, size_t count)
{
    std::vector<double> numbers;
    const char* at = text.data();
    const char* const end = at + text.size();
    while (true) {
        double number = 0;
        const auto [next, status] = std::from_chars(at, end, number);
        if (status != std::errc() || !std::isfinite(number))
            break;
        numbers.push_back(number);
        at = next;
        if (at == end || *at != ',')
            break;
        ++at;
    }
    if (at != end || numbers.size() != count)
        return Error{ErrorCode::Usage, option,
                     fmt::format("expected {} finite number{} separated by commas, found '{}'", count,
                                 count == 1 ? "" : "s", text)};
    return numbers;
}

} // namespace trimray
