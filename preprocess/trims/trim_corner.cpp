#include "preprocess/trims/trim_corner.h"

#include "preprocess/vec2d.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace trimray {
namespace {

// The corner lies no farther from either end than this many gaps, and a piece keeps this share of its chord.
constexpr double kReach = 4;
constexpr double kKeptShare = 0.5;

/// How far the corner lies beyond the end of one piece and before the start of the next, in mm along their tangents.
struct Corner {
    Vec2d at; // mm
    double beyond_end, before_start;
    double aside = 0; // mm off either tangent
};

/// `end` and `start` in mm, the directions of unit length.
std::optional<Corner> corner_of(Vec2d end, Vec2d along_end, Vec2d start, Vec2d along_start)
{
    const Vec2d gap = start - end;
    const double turn = cross(along_end, along_start);
    if (std::abs(turn) < kSameDirection) {
        const double overlap = -dot(gap, along_end);
        if (!(overlap > 0 && dot(along_end, along_start) > 0))
            return std::nullopt;
        return Corner{0.5 * (end + start), -0.5 * overlap, -0.5 * overlap, 0.5 * std::abs(cross(gap, along_end))};
    }
    // end + s along_end = start + t along_start
    const double s = cross(gap, along_start) / turn, t = cross(gap, along_end) / turn;
    return Corner{end + s * along_end, s, -t, 0};
}

/// The piece cut where its tangent's corner is, measured along the axis that it runs along most there: both parts.
std::pair<CurvePiece, CurvePiece> cut(const CurvePiece& piece, Vec2d corner, Vec2d direction)
{
    const bool along_v = std::abs(direction.y) > std::abs(direction.x);
    std::pair<CurvePiece, CurvePiece> parts;
    split_piece(piece, parameter_at(piece, along_v, along_v ? corner.y : corner.x), parts.first, parts.second);
    return parts;
}

} // namespace

bool meet_at_corner(CurvePiece& before, CurvePiece& after, Vec2d offset, Vec2d mm_per_uv,
                    std::vector<CurvePiece>& between)
{
    const auto in_mm = [&](Vec2d p) { return Vec2d{p.x * mm_per_uv.x, p.y * mm_per_uv.y}; };
    const Vec2d end = in_mm(before.p[3]), start = in_mm(after.p[0] + offset);
    const Vec2d leaving = in_mm(end_direction(before)), entering = in_mm(start_direction(after));
    if (!(length(leaving) > 0 && length(entering) > 0))
        return false;
    const auto corner = corner_of(end, (1 / length(leaving)) * leaving, start, (1 / length(entering)) * entering);
    const double reach = kReach * length(start - end);
    const bool held = before.grow_mm == kHeld || after.grow_mm == kHeld;
    if (!corner || (held && corner->aside > 0) || std::abs(corner->beyond_end) > reach ||
        std::abs(corner->before_start) > reach ||
        -corner->beyond_end > (1 - kKeptShare) * length(in_mm(before.p[3] - before.p[0])) ||
        -corner->before_start > (1 - kKeptShare) * length(in_mm(after.p[3] - after.p[0])))
        return false;

    Vec2d at{corner->at.x / mm_per_uv.x, corner->at.y / mm_per_uv.y};
    // what runs along an axis stays on its line, bit for bit: the borders of a domain are recognised by that
    for (const auto& [piece, shift] : {std::pair(&before, Vec2d{}), std::pair(&after, offset)}) {
        if (piece->p[0].x == piece->p[3].x)
            at.x = piece->p[0].x + shift.x;
        if (piece->p[0].y == piece->p[3].y)
            at.y = piece->p[0].y + shift.y;
    }
    const auto with_ends = [&](const CurvePiece& piece, Vec2d from, Vec2d to) {
        CurvePiece line = line_piece(from, to);
        line.use = piece.use;
        line.grow_mm = piece.grow_mm == kHeld ? kHeld : piece.grow_mm + corner->aside;
        return line;
    };
    if (!before.cubic) {
        before = with_ends(before, before.p[0], at);
    } else if (corner->beyond_end > 0) {
        between.push_back(with_ends(before, before.p[3], at));
    } else {
        before = cut(before, at, end_direction(before)).first;
        move_end(before, at, mm_per_uv);
    }
    const Vec2d at_after = at - offset;
    if (!after.cubic) {
        after = with_ends(after, at_after, after.p[3]);
    } else if (corner->before_start > 0) {
        between.push_back(with_ends(after, at, after.p[0] + offset));
    } else {
        after = cut(after, at_after, start_direction(after)).second;
        move_start(after, at_after, mm_per_uv);
    }
    return true;
}

} // namespace trimray
