// Models that real files rarely bring in a small and free one: made with the CAD kernel when a test runs, written as
// BREP, which keeps left-handed axis systems and mirrored placements that STEP cannot hold.
#pragma once

#include <string>

namespace trimray::oracle {

/// Extrusion of a spline, revolution of a spline, offset of a spline surface, each trimmed by a hole. False: not
/// written.
bool write_swept_model(const std::string& path);

/// The faces of a file, copied as their mirror image in the plane x = 0: quadrics get left-handed axis systems.
bool write_left_handed_copy(const std::string& from, const std::string& path);

/// One shape of a file, placed three times: as it is, turned and moved, and mirrored.
bool write_placed_copies(const std::string& from, const std::string& path);

} // namespace trimray::oracle
