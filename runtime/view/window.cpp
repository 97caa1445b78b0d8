#include "runtime/view/window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_opengl3.h>
#include <epoxy/gl.h>
#include <fmt/format.h>
#include <fontconfig/fontconfig.h>
#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace trimray {
namespace {

std::string last_glfw_error()
{
    const char* text = nullptr;
    return glfwGetError(&text) == GLFW_NO_ERROR || !text ? "no reason given" : text;
}

Error no_window(const std::string& why)
{
    return {ErrorCode::NoDevice, "view",
            fmt::format("no window: {}; 'trimray render MODEL.tray -o picture.png' makes pictures without one", why)};
}

/// The file of the system's font for interfaces; empty: there is none.
std::string font_file()
{
    std::string file;
    FcPattern* pattern = FcNameParse(reinterpret_cast<const FcChar8*>("sans-serif:scalable=true"));
    FcConfigSubstitute(nullptr, pattern, FcMatchPattern);
    FcDefaultSubstitute(pattern);
    FcResult result = FcResultNoMatch;
    FcPattern* match = FcFontMatch(nullptr, pattern, &result);
    FcChar8* name = nullptr;
    if (match && FcPatternGetString(match, FC_FILE, 0, &name) == FcResultMatch)
        file = reinterpret_cast<const char*>(name);
    if (match)
        FcPatternDestroy(match);
    FcPatternDestroy(pattern);
    FcFini();
    return file;
}

/// The interface's own look: dark and quiet, so that the picture speaks.
void set_style(float scale)
{
    ImGui::StyleColorsDark();
    ImGuiStyle& style = ImGui::GetStyle();
    style.WindowRounding = 0;
    style.FrameRounding = 3;
    style.GrabRounding = 3;
    style.WindowBorderSize = 0;
    style.FramePadding = {7, 4};
    style.ItemSpacing = {8, 5};
    ImVec4* colors = style.Colors;
    colors[ImGuiCol_WindowBg] = {0.13f, 0.14f, 0.16f, 1};
    colors[ImGuiCol_PopupBg] = {0.10f, 0.11f, 0.13f, 0.97f};
    colors[ImGuiCol_Border] = {0.30f, 0.32f, 0.36f, 0.5f};
    colors[ImGuiCol_FrameBg] = {0.20f, 0.22f, 0.25f, 1};
    colors[ImGuiCol_FrameBgHovered] = {0.26f, 0.29f, 0.33f, 1};
    colors[ImGuiCol_FrameBgActive] = {0.30f, 0.34f, 0.39f, 1};
    colors[ImGuiCol_Header] = {0.20f, 0.38f, 0.58f, 0.75f};
    colors[ImGuiCol_HeaderHovered] = {0.24f, 0.45f, 0.68f, 0.8f};
    colors[ImGuiCol_HeaderActive] = {0.24f, 0.45f, 0.68f, 1};
    colors[ImGuiCol_Button] = {0.22f, 0.25f, 0.29f, 1};
    colors[ImGuiCol_ButtonHovered] = {0.27f, 0.42f, 0.60f, 1};
    colors[ImGuiCol_ButtonActive] = {0.22f, 0.48f, 0.75f, 1};
    colors[ImGuiCol_CheckMark] = colors[ImGuiCol_SliderGrab] = {0.40f, 0.68f, 0.98f, 1};
    style.ScaleAllSizes(scale);
}

void set_keys(ImGuiIO& io)
{
    constexpr std::pair<ImGuiKey_, int> kKeys[] = {
        {ImGuiKey_Tab, GLFW_KEY_TAB},
        {ImGuiKey_LeftArrow, GLFW_KEY_LEFT},
        {ImGuiKey_RightArrow, GLFW_KEY_RIGHT},
        {ImGuiKey_UpArrow, GLFW_KEY_UP},
        {ImGuiKey_DownArrow, GLFW_KEY_DOWN},
        {ImGuiKey_PageUp, GLFW_KEY_PAGE_UP},
        {ImGuiKey_PageDown, GLFW_KEY_PAGE_DOWN},
        {ImGuiKey_Home, GLFW_KEY_HOME},
        {ImGuiKey_End, GLFW_KEY_END},
        {ImGuiKey_Insert, GLFW_KEY_INSERT},
        {ImGuiKey_Delete, GLFW_KEY_DELETE},
        {ImGuiKey_Backspace, GLFW_KEY_BACKSPACE},
        {ImGuiKey_Space, GLFW_KEY_SPACE},
        {ImGuiKey_Enter, GLFW_KEY_ENTER},
        {ImGuiKey_Escape, GLFW_KEY_ESCAPE},
        {ImGuiKey_KeyPadEnter, GLFW_KEY_KP_ENTER},
        {ImGuiKey_A, GLFW_KEY_A},
        {ImGuiKey_C, GLFW_KEY_C},
        {ImGuiKey_V, GLFW_KEY_V},
        {ImGuiKey_X, GLFW_KEY_X},
        {ImGuiKey_Y, GLFW_KEY_Y},
        {ImGuiKey_Z, GLFW_KEY_Z},
    };
    for (const auto& [key, number] : kKeys)
        io.KeyMap[key] = number;
}

} // namespace

Result<std::unique_ptr<Window>> Window::open(const std::string& title, int width, int height)
{
    std::unique_ptr<Window> made(new Window);
    if (!glfwInit())
        return no_window(last_glfw_error());
    made->has_context_ = true;
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 2);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
    glfwWindowHintString(GLFW_X11_CLASS_NAME, "trimray");
    glfwWindowHintString(GLFW_X11_INSTANCE_NAME, "trimray");
    made->window_ = glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
    if (!made->window_)
        return no_window(last_glfw_error());
    glfwMakeContextCurrent(made->window_);
    glfwSwapInterval(1);
    made->driver_ = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    float scale_x = 1, scale_y = 1;
    glfwGetWindowContentScale(made->window_, &scale_x, &scale_y);
    made->scale_ = std::clamp(scale_y, 0.5f, 8.0f);
    made->listen();

    ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.BackendPlatformName = "trimray";
    io.ConfigInputTextCursorBlink = false; // an idle window draws nothing
    io.SetClipboardTextFn = [](void* window, const char* text) {
        glfwSetClipboardString(static_cast<GLFWwindow*>(window), text);
    };
    io.GetClipboardTextFn = [](void* window) { return glfwGetClipboardString(static_cast<GLFWwindow*>(window)); };
    io.ClipboardUserData = made->window_;
    set_keys(io);
    set_style(made->scale_);
    made->load_font();
    if (!ImGui_ImplOpenGL3_Init("#version 150"))
        return no_window("OpenGL 3.2 does not start");
    made->has_renderer_ = true;
    return made;
}

Window::~Window()
{
    if (has_renderer_)
        ImGui_ImplOpenGL3_Shutdown();
    if (ImGui::GetCurrentContext())
        ImGui::DestroyContext();
    if (window_)
        glfwDestroyWindow(window_);
    if (has_context_)
        glfwTerminate();
}

void Window::load_font()
{
    ImGuiIO& io = ImGui::GetIO();
    const float size = std::round(15 * scale_);
    static const ImWchar kRanges[] = {0x20,   0x24f,  0x370,  0x3ff,  0x400,  0x4ff,  0x2010, 0x205e,
                                      0x2070, 0x209f, 0x2190, 0x21ff, 0x2200, 0x22ff, 0};
    const std::string file = font_file();
    if (!file.empty() && (file.ends_with(".ttf") || file.ends_with(".otf")) &&
        io.Fonts->AddFontFromFileTTF(file.c_str(), size, nullptr, kRanges))
        return;
    ImFontConfig config;
    config.SizePixels = std::round(13 * scale_);
    io.Fonts->AddFontDefault(&config);
}

void Window::listen()
{
    glfwSetWindowUserPointer(window_, this);
    int units = 0;
    glfwGetWindowSize(window_, &units, nullptr);
    glfwGetFramebufferSize(window_, &width_, &height_);
    pixels_a_unit_ = units > 0 ? double(width_) / units : 1;
    const auto self = [](GLFWwindow* window) -> Window& {
        return *static_cast<Window*>(glfwGetWindowUserPointer(window));
    };
    static const auto of = self;
    glfwSetCursorPosCallback(window_, [](GLFWwindow* window, double x, double y) {
        Window& w = of(window);
        w.push({.kind = InputEvent::Kind::Move, .x = x * w.pixels_a_unit_, .y = y * w.pixels_a_unit_});
    });
    glfwSetCursorEnterCallback(window_, [](GLFWwindow* window, int entered) {
        if (!entered)
            of(window).push({.kind = InputEvent::Kind::Leave});
    });
    glfwSetMouseButtonCallback(window_, [](GLFWwindow* window, int button, int action, int mods) {
        if (button <= kMiddleButton)
            of(window).push({.kind = InputEvent::Kind::Button,
                             .code = button,
                             .down = action == GLFW_PRESS,
                             .mods = mods & kModMask});
    });
    glfwSetScrollCallback(window_, [](GLFWwindow* window, double x, double y) {
        of(window).push({.kind = InputEvent::Kind::Scroll, .x = x, .y = y});
    });
    glfwSetKeyCallback(window_, [](GLFWwindow* window, int key, int, int action, int mods) {
        if (!key_name(key).empty())
            of(window).push(
                {.kind = InputEvent::Kind::Key, .code = key, .down = action != GLFW_RELEASE, .mods = mods & kModMask});
    });
    glfwSetCharCallback(window_, [](GLFWwindow* window, unsigned character) {
        InputEvent typed{.kind = InputEvent::Kind::Text};
        char bytes[5] = {};
        ImTextCharToUtf8(bytes, character);
        typed.text = bytes;
        of(window).push(std::move(typed));
    });
    glfwSetDropCallback(window_, [](GLFWwindow* window, int count, const char** paths) {
        InputEvent dropped{.kind = InputEvent::Kind::Drop};
        dropped.paths.assign(paths, paths + count);
        of(window).push(std::move(dropped));
    });
    glfwSetFramebufferSizeCallback(window_, [](GLFWwindow* window, int width, int height) {
        Window& w = of(window);
        if (width <= 0 || height <= 0)
            return; // minimised
        w.width_ = width;
        w.height_ = height;
        w.push({.kind = InputEvent::Kind::Resize, .x = double(width), .y = double(height)});
    });
    glfwSetWindowRefreshCallback(window_, [](GLFWwindow* window) {
        Window& w = of(window); // uncovered: what is there is drawn again
        w.push({.kind = InputEvent::Kind::Resize, .x = double(w.width_), .y = double(w.height_)});
    });
    glfwSetWindowCloseCallback(window_, [](GLFWwindow* window) { of(window).push({.kind = InputEvent::Kind::Close}); });
}

void Window::push(InputEvent event)
{
    events_.push_back(std::move(event));
}

void Window::wait(double seconds)
{
    if (seconds < 0)
        glfwWaitEvents();
    else if (seconds > 0)
        glfwWaitEventsTimeout(seconds);
    else
        glfwPollEvents();
}

void Window::wake()
{
    glfwPostEmptyEvent();
}

std::vector<InputEvent> Window::take_events()
{
    return std::exchange(events_, {});
}

bool Window::minimised() const
{
    return glfwGetWindowAttrib(window_, GLFW_ICONIFIED) != 0;
}

void Window::resize(int width, int height)
{
    glfwSetWindowSize(window_, static_cast<int>(std::lround(width / pixels_a_unit_)),
                      static_cast<int>(std::lround(height / pixels_a_unit_)));
}

void Window::set_title(const std::string& title)
{
    glfwSetWindowTitle(window_, title.c_str());
}

void Window::begin_frame(const std::vector<InputEvent>& events, double seconds)
{
    using Kind = InputEvent::Kind;
    ImGuiIO& io = ImGui::GetIO();
    io.DisplaySize = {float(width_), float(height_)};
    io.DeltaTime = static_cast<float>(std::clamp(seconds, 1e-4, 1.0));
    for (const InputEvent& event : events) {
        if (event.kind == Kind::Move)
            io.MousePos = {float(event.x), float(event.y)};
        else if (event.kind == Kind::Leave)
            io.MousePos = {-1e9f, -1e9f};
        else if (event.kind == Kind::Button)
            io.MouseDown[event.code] = event.down;
        else if (event.kind == Kind::Scroll) {
            io.MouseWheelH += static_cast<float>(event.x);
            io.MouseWheel += static_cast<float>(event.y);
        } else if (event.kind == Kind::Key) {
            io.KeysDown[event.code] = event.down;
        } else if (event.kind == Kind::Text) {
            io.AddInputCharactersUTF8(event.text.c_str());
            io.KeyCtrl = io.KeyAlt = false; // what is typed with them is no text
        }
        if (event.kind == Kind::Key || event.kind == Kind::Button) {
            io.KeyCtrl = (event.mods & kModControl) != 0;
            io.KeyShift = (event.mods & kModShift) != 0;
            io.KeyAlt = (event.mods & kModAlt) != 0;
        }
    }
    ImGui_ImplOpenGL3_NewFrame();
    ImGui::NewFrame();
}

void Window::end_frame(std::vector<unsigned char>* pixels)
{
    ImGui::Render();
    glViewport(0, 0, width_, height_);
    glClearColor(0.13f, 0.14f, 0.16f, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
    if (pixels)
        *pixels = read_pixels();
    glfwSwapBuffers(window_);
}

std::vector<unsigned char> Window::read_pixels() const
{
    std::vector<unsigned char> bottom_up(size_t(width_) * size_t(height_) * 4), pixels(bottom_up.size());
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, width_, height_, GL_RGBA, GL_UNSIGNED_BYTE, bottom_up.data());
    const size_t row = size_t(width_) * 4;
    for (int y = 0; y < height_; ++y)
        std::copy_n(bottom_up.begin() + static_cast<ptrdiff_t>(row * size_t(height_ - 1 - y)), row,
                    pixels.begin() + static_cast<ptrdiff_t>(row * size_t(y)));
    return pixels;
}

} // namespace trimray
