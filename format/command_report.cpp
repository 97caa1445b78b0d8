#include "format/command_report.h"

#include <fmt/format.h>

#include <cstdio>
#include <unistd.h>

namespace trimray {

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

int report_error(const Error& error, std::string_view program)
{
    const std::string where = error.where.empty() ? "" : printable(error.where) + ": ";
    fmt::print(stderr, "{}: {}{} [E{}]\n", program, where, printable(error.detail), static_cast<int>(error.code));
    return exit_code(error);
}

void report_note(std::string_view text, std::string_view program)
{
    fmt::print(stderr, "{}: {}\n", program, printable(text));
}

void report_progress(std::string_view text)
{
    if (isatty(STDERR_FILENO) != 0)
        fmt::print(stderr, "\r\033[K{}", printable(text));
}

} // namespace trimray
