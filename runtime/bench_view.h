// The views that measurements are taken from, and what all of them ask of a tracer.
#pragma once

#include "format/result.h"
#include "runtime/tracer.h"

#include <cstdint>
#include <memory>
#include <string>

namespace trimray {

/// The model framed whole from a standard view, or "close-up": from iso, `magnification` times nearer to where most
/// borders are (close_up.h). Fails: Usage, at --views (no such view); as Tracer::render.
Result<Camera> bench_view(const std::string& name, const std::shared_ptr<const Scene>& scene, uint32_t width,
                          uint32_t height, double magnification);

/// A picture from `camera` of the size and on the threads that any bench's options hold; all else is the default.
template <class BenchOptions>
RenderOptions picture_options(const BenchOptions& options, const Camera& camera)
{
    RenderOptions render;
    render.width = options.width;
    render.height = options.height;
    render.threads = options.threads;
    render.camera = camera;
    return render;
}

} // namespace trimray
