// The views that measurements are taken from.
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

} // namespace trimray
