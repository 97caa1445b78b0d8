#include "format/trim_query.h"

#include <algorithm>
#include <cmath>

namespace trimray {
namespace {

float bezier3(float a, float b, float c, float d, float t)
{
    const float ab = a + t * (b - a), bc = b + t * (c - b), cd = c + t * (d - c);
    const float abc = ab + t * (bc - ab), bcd = bc + t * (cd - bc);
    return abc + t * (bcd - abc);
}

/// u of a monotone cubic at v, both in uv_face. p: 4 points from the end with the lower v, `step` floats apart.
/// Newton's steps stay in the bracket that every evaluation shortens; a step that leaves it becomes a bisection.
float cubic_u_at_v(const float* p, int step, float v)
{
    const float v0 = p[1], v1 = p[step + 1], v2 = p[2 * step + 1], v3 = p[3 * step + 1];
    float lo = 0, hi = 1;
    float t = (v - v0) / (v3 - v0);
    for (int i = 0; i < 40; ++i) {
        const float error = bezier3(v0, v1, v2, v3, t) - v;
        if (error < 0)
            lo = t;
        else
            hi = t;
        const float s = 1 - t;
        const float slope = 3 * (s * s * (v1 - v0) + 2 * s * t * (v2 - v1) + t * t * (v3 - v2));
        const float newton = t - error / slope; // an infinity or NaN fails the bracket's test
        const float next = newton > lo && newton < hi ? newton : 0.5f * (lo + hi);
        // steps below an ulp of t near 1 no longer change u
        if (std::abs(next - t) <= 6e-8f)
            break;
        t = next;
    }
    return bezier3(p[0], p[step], p[2 * step], p[3 * step], t);
}

} // namespace

bool trim_inside(const PackImage& image, uint face_id, float u, float v)
{
    const FaceRecord& face = image.faces[face_id];
    const uint columns = face.grid & 0xffffu, rows = face.grid >> 16;
    if (face.grid == 0)
        return true;
    u = std::clamp(u, 0.0f, kUvBelowOne);
    v = std::clamp(v, 0.0f, kUvBelowOne);
    const uint column = std::min(static_cast<uint>(u * static_cast<float>(columns)), columns - 1);
    const uint row = std::min(static_cast<uint>(v * static_cast<float>(rows)), rows - 1);
    const uint cell = image.cells[face.first_cell + row * columns + column];
    const uint cell_class = cell & 3u;
    if (cell_class == kCellOut || cell_class == kCellIn)
        return cell_class == kCellIn;

    bool inside = cell_class == kCellMixedCornerIn;
    for (const CellEntry* entry = image.cell_entries.data() + face.first_entry + (cell >> 2);; ++entry) {
        const float* p =
            image.trim_points.data() + 2 * (static_cast<size_t>(face.first_point) + (entry->word >> kPiecePointShift));
        const int last = (entry->word & kPieceCubic) != 0 ? 3 : 1;
        // from the lower end a to the upper end b
        const bool flipped = p[1] > p[2 * last + 1];
        const float* a = flipped ? p + 2 * last : p;
        const float* b = flipped ? p : p + 2 * last;
        const bool below_eta = v < entry->eta;
        const bool no_eta = entry->eta == kNoEta;
        const bool vertical = !no_eta && below_eta;
        bool horizontal = a[1] <= v && v < b[1] && (no_eta || (b[0] > a[0] ? below_eta : !below_eta));
        if (horizontal) {
            const float step_t = (v - a[1]) / (b[1] - a[1]);
            horizontal = u < std::min(a[0], b[0])    ? true
                         : u >= std::max(a[0], b[0]) ? false
                         : last == 3                 ? u < cubic_u_at_v(a, flipped ? -2 : 2, v)
                                                     : u < a[0] + step_t * (b[0] - a[0]);
        }
        inside ^= horizontal != vertical;
        if ((entry->word & kEntryLast) != 0)
            return inside;
    }
}

} // namespace trimray
