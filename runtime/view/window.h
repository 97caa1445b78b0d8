// The window, its OpenGL context and the interface's library, from start to end. OpenGL only shows what has been
// traced: every display has it, with a driver of its own or Mesa's, also where there is no Vulkan.
#pragma once

#include "format/result.h"
#include "runtime/view/input.h"

#include <memory>
#include <string>
#include <vector>

struct GLFWwindow;

namespace trimray {

class Window {
public:
    /// Fails: NoDevice (no display, or no OpenGL 3.2), which names `trimray render`.
    static Result<std::unique_ptr<Window>> open(const std::string& title, int width, int height);
    ~Window();
    Window(const Window&) = delete;
    Window& operator=(const Window&) = delete;

    /// Waits for events, at most `seconds`; 0: takes those that are there; negative: as long as it takes.
    void wait(double seconds);
    /// Ends a wait. From any thread, while the window lives.
    static void wake();
    /// What happened since the last call. Nothing at all while the input is locked (a recording is played), but for
    /// Resize and Close.
    std::vector<InputEvent> take_events();

    /// Framebuffer pixels.
    int width() const { return width_; }
    int height() const { return height_; }
    /// Of text and controls: 1 on a display of about 96 dots an inch.
    float scale() const { return scale_; }
    bool minimised() const;
    void resize(int width, int height);
    void set_title(const std::string& title);

    /// A frame of the interface: what happens between is drawn, and then shown. `seconds`: since the last.
    void begin_frame(const std::vector<InputEvent>& events, double seconds);
    /// `pixels`: filled with what is shown, 4 bytes a pixel, row 0 at the top.
    void end_frame(std::vector<unsigned char>* pixels = nullptr);
    const std::string& driver() const { return driver_; }

private:
    Window() = default;
    void listen();
    void push(InputEvent event);
    void load_font();
    std::vector<unsigned char> read_pixels() const;

    GLFWwindow* window_ = nullptr;
    int width_ = 0, height_ = 0;
    double pixels_a_unit_ = 1; // framebuffer pixels a unit of the window's own coordinates
    float scale_ = 1;
    std::string driver_;
    std::vector<InputEvent> events_;
    bool has_context_ = false, has_renderer_ = false;
};

} // namespace trimray
