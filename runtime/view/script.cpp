#include "runtime/view/script.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <sstream>
#include <utility>

namespace trimray {
namespace {

using Steps = std::deque<ScriptStep>;

InputEvent move_to(double x, double y)
{
    return {.kind = InputEvent::Kind::Move, .x = x, .y = y};
}

/// The event of "press left" and the like, whose words are known to be right.
Result<InputEvent> press(const std::string& button, bool down)
{
    return event_of((down ? "press " : "release ") + button);
}

Error expected(const std::string& what)
{
    return {ErrorCode::Usage, "", "expected " + what};
}

Status add_click(std::istringstream& words, Steps& steps)
{
    std::string button = "left";
    double x, y;
    words >> std::ws;
    if (std::isalpha(words.peek()))
        words >> button;
    if (!(words >> x >> y))
        return expected("click [BUTTON] X Y");
    const Result<InputEvent> down = press(button, true), up = press(button, false);
    if (!down.ok())
        return down.error();
    steps.push_back(move_to(x, y));
    steps.push_back(*down);
    steps.push_back(*up);
    return Done{};
}

Status add_drag(std::istringstream& words, Steps& steps)
{
    std::string button;
    double x0, y0, x1, y1;
    if (!(words >> button >> x0 >> y0 >> x1 >> y1))
        return expected("drag BUTTON X0 Y0 X1 Y1 [STEPS]");
    int count = 8;
    words >> count;
    const Result<InputEvent> down = press(button, true), up = press(button, false);
    if (!down.ok())
        return down.error();
    if (count < 1)
        return expected("at least one step");
    steps.push_back(move_to(x0, y0));
    steps.push_back(*down);
    for (int i = 1; i <= count; ++i)
        steps.push_back(move_to(x0 + (x1 - x0) * i / count, y0 + (y1 - y0) * i / count));
    steps.push_back(*up);
    return Done{};
}

Status add_key(const std::string& chord, Steps& steps)
{
    for (const char* way : {"down ", "up "}) {
        const Result<InputEvent> event = event_of(way + chord);
        if (!event.ok())
            return event.error();
        steps.push_back(*event);
    }
    return Done{};
}

Status add_line(const std::string& line, Steps& steps)
{
    std::istringstream words(line);
    words.imbue(std::locale::classic());
    std::string name;
    words >> name;
    if (name.empty() || name.starts_with("#"))
        return Done{};
    if (name == "click")
        return add_click(words, steps);
    if (name == "drag")
        return add_drag(words, steps);
    if (name == "wait") {
        std::string what;
        if (!(words >> what)) {
            steps.push_back(WaitForRest{});
            return Done{};
        }
        if (what == "proxy") {
            steps.push_back(WaitForProxy{});
            return Done{};
        }
        std::istringstream number(what);
        number.imbue(std::locale::classic());
        double seconds;
        if (!(number >> seconds) || !number.eof())
            return expected("wait, wait SECONDS or wait proxy");
        steps.push_back(WaitSeconds{seconds});
        return Done{};
    }
    std::string rest;
    std::getline(words >> std::ws, rest);
    if (name == "key")
        return add_key(rest, steps);
    if (name == "picture" || name == "window" || name == "report") {
        using What = SaveFile::What;
        constexpr std::string_view kTransparent = " transparent";
        What what = name == "window" ? What::Window : name == "report" ? What::Report : What::Picture;
        if (what == What::Picture && rest.ends_with(kTransparent)) {
            rest.erase(rest.size() - kTransparent.size());
            what = What::TransparentPicture;
        }
        if (rest.empty())
            return expected(name + " FILE");
        steps.push_back(SaveFile{what, rest});
        return Done{};
    }
    const Result<InputEvent> event = event_of(line);
    if (!event.ok())
        return event.error();
    steps.push_back(*event);
    return Done{};
}

} // namespace

Result<std::deque<ScriptStep>> read_script(const std::string& file)
{
    std::ifstream stream(file);
    if (!stream)
        return Error{errno == ENOENT ? ErrorCode::FileNotFound : ErrorCode::FileNotReadable, file,
                     std::strerror(errno)};
    Steps steps;
    std::string line;
    for (size_t number = 1; std::getline(stream, line); ++number)
        if (const Status added = add_line(line, steps); !added.ok())
            return Error{ErrorCode::Usage, fmt::format("{}:{}", file, number), added.error().detail};
    return steps;
}

Result<Recorder> Recorder::open(const std::string& file)
{
    std::FILE* stream = std::fopen(file.c_str(), "we");
    if (!stream)
        return Error{ErrorCode::FileNotWritable, file, std::strerror(errno)};
    return Recorder(stream);
}

Recorder::Recorder(Recorder&& other) noexcept : file_(std::exchange(other.file_, nullptr)), last_(other.last_) {}

Recorder::~Recorder()
{
    if (file_)
        std::fclose(file_);
}

void Recorder::add(const InputEvent& event)
{
    const auto now = std::chrono::steady_clock::now();
    const double pause = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    if (pause >= 0.005)
        fmt::print(file_, "wait {:.3f}\n", pause);
    fmt::print(file_, "{}\n", to_line(event));
    std::fflush(file_); // what was done before a crash is what is wanted most
}

} // namespace trimray
