#include "runtime/bench_view.h"

#include "runtime/close_up.h"
#include "runtime/command_trace.h"

namespace trimray {

Result<Camera> bench_view(const std::string& name, const std::shared_ptr<const Scene>& scene, uint32_t width,
                          uint32_t height, double magnification)
{
    const PackImage& image = scene->pack.image;
    const bool close = name == "close-up";
    SceneCamera asked;
    asked.view = close ? "iso" : name;
    const Result<Camera> whole = camera_of(asked, image, width, height);
    if (!whole.ok())
        return Error{ErrorCode::Usage, "--views", whole.error().detail + "; or close-up"};
    if (!close)
        return whole;
    const Result<std::unique_ptr<Tracer>> tracer = make_cpu_tracer(scene);
    if (!tracer.ok())
        return tracer.error();
    RenderOptions render;
    render.width = width;
    render.height = height;
    render.camera = *whole;
    render.shade = false;
    return close_up(**tracer, image, render, magnification);
}

} // namespace trimray
