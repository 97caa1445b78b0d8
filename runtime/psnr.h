// How alike two pictures are as they go to a screen.
#pragma once

#include "runtime/image_io.h"
#include "runtime/tracer.h"

namespace trimray {

/// A frame as a screen shows it on a white page.
Picture over_white(const Frame& frame);

/// 10 log10(255^2 / MSE) in dB, the mean over all pixels and the channels R, G and B of the pictures as they go to a
/// screen; infinity for equal ones. Alpha is not compared: put the frames over a background first.
/// Domain: equal sizes, at least one pixel.
double psnr_db(const Picture& a, const Picture& b);

} // namespace trimray
