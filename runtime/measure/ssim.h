// How alike two pictures look, by their structure.
#pragma once

#include "runtime/image_io.h"

namespace trimray {

/// The mean structural similarity of the pictures' luma (Rec. 709 weights of the sRGB bytes), at most 1, for equal
/// ones. Windows are Gaussians of 1.5 pixels cut at 11 x 11, at every pixel; outside of the picture its border goes on.
/// Source: Wang, Bovik, Sheikh, Simoncelli 2004, eq. 13, with K1 = 0.01, K2 = 0.03. Domain: equal sizes, at least one
/// pixel. Alpha is not compared.
double ssim(const Picture& a, const Picture& b);

} // namespace trimray
