// A close look at trim borders, chosen by a rule instead of by hand, so that a measurement can be repeated.
#pragma once

#include "format/result.h"
#include "runtime/tracer.h"

namespace trimray {

/// Moves the camera `whole.camera` towards the place where its picture has most trim borders. The picture is traced at
/// `whole`'s size; a pixel is a border where a trimmed face (no natural border) has beside it, left, right, above or
/// below, another face, placement or nothing that is not in front of it. Of all windows of 1 / magnification of the
/// picture's sides the one with most border pixels is taken (of equal ones the first, row by row); of its border pixels
/// the nearest to its middle; the eye goes along that pixel's ray until the hit is `magnification` times nearer, and
/// looks at it. Where no border is seen the camera goes to the picture's middle in the same way, where a hit is there.
/// Fails: as Tracer::render. Domain: magnification > 1.
Result<Camera> close_up(Tracer& tracer, const PackImage& image, const RenderOptions& whole, double magnification);

} // namespace trimray
