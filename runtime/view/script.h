// Recordings of input, as text: what a person did, or what a test is to do. `--record` writes one, `--play` plays one.
// A line is an event (input.h) or one of
//   wait             until the picture is complete and nothing is being loaded
//   wait SECONDS
//   wait proxy       until the first picture, drawn from the pack's proxy, is on the screen, or a traced one
//   click X Y        press and release the left button there; `click right X Y` another
//   drag BUTTON X0 Y0 X1 Y1 [STEPS]     with modifiers: drag Shift+left ...
//   key CHORD        down and up
//   picture FILE [transparent]          as a screenshot, with its scene file beside it
//   window FILE      what is on the screen, panels and all
//   report FILE      what the viewer shows, as JSON
//   # a comment
// Coordinates are framebuffer pixels from the window's upper left corner.
#pragma once

#include "format/result.h"
#include "runtime/view/input.h"

#include <chrono>
#include <deque>
#include <string>
#include <variant>
#include <vector>

namespace trimray {

struct WaitForRest {};
struct WaitForProxy {};
struct WaitSeconds {
    double seconds = 0;
};
struct SaveFile {
    enum class What { Picture, TransparentPicture, Window, Report } what = What::Picture;
    std::string file;
};
using ScriptStep = std::variant<InputEvent, WaitForRest, WaitForProxy, WaitSeconds, SaveFile>;

/// The steps of a recording. Fails: FileNotFound, FileNotReadable; Usage at "file:line".
Result<std::deque<ScriptStep>> read_script(const std::string& file);

/// Writes events as they come, with the pauses between them.
class Recorder {
public:
    /// Fails: FileNotWritable.
    static Result<Recorder> open(const std::string& file);
    Recorder(Recorder&& other) noexcept;
    Recorder& operator=(Recorder&&) = delete;
    ~Recorder();
    void add(const InputEvent& event);

private:
    explicit Recorder(std::FILE* file) : file_(file), last_(std::chrono::steady_clock::now()) {}
    std::FILE* file_;
    std::chrono::steady_clock::time_point last_;
};

} // namespace trimray
