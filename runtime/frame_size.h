// How large a picture may be, and the memory of one.
#pragma once

#include "format/result.h"
#include "runtime/tracer.h"

namespace trimray {

/// Fails: Usage, for pictures without pixels and for those too large.
Status check_size(const RenderOptions& options);

/// Gives every array of the frame its length; what they hold is not set.
void resize(Frame& frame, uint32_t width, uint32_t height);

} // namespace trimray
