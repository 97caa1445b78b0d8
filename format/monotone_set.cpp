#include "format/monotone_set.h"

#include <cstring>
#include <span>

namespace trimray {
namespace {

/// A piece's first point, how many steps it takes, and where it goes: -1, 0 or 1 in u and in v.
struct DirectedPiece {
    const float* first;
    uint steps;
    int toward_u, toward_v;

    const float* last() const { return first + 2 * steps; }
};

int sign_of(float x)
{
    return (x > 0) - (x < 0);
}

std::vector<DirectedPiece> directed_pieces(const PackImage& image, const FaceRecord& face)
{
    std::vector<DirectedPiece> pieces;
    pieces.reserve(face.piece_count);
    for (uint i = 0; i < face.piece_count; ++i) {
        const uint word = image.trim_pieces[face.first_piece + i];
        const float* first =
            image.trim_points.data() + 2 * (static_cast<size_t>(face.first_point) + (word >> kPiecePointShift));
        const uint steps = (word & kPieceCubic) != 0 ? 3 : 1;
        const float* last = first + 2 * steps;
        const DirectedPiece piece{first, steps, sign_of(last[0] - first[0]), sign_of(last[1] - first[1])};
        if (piece.toward_u != 0 || piece.toward_v != 0)
            pieces.push_back(piece);
    }
    return pieces;
}

bool meet(const DirectedPiece& a, const DirectedPiece& b)
{
    return std::memcmp(a.last(), b.first, 2 * sizeof(float)) == 0;
}

/// The directions that a chain has so far; 0: neither.
struct Course {
    uint steps = 0;
    int toward_u = 0, toward_v = 0;

    explicit Course(const DirectedPiece& piece) : steps(piece.steps), toward_u(piece.toward_u), toward_v(piece.toward_v)
    {
    }
    /// Whether the piece keeps the course; if so, its directions are the chain's too.
    bool takes(const DirectedPiece& piece)
    {
        if (piece.steps != steps || piece.toward_u * toward_u < 0 || piece.toward_v * toward_v < 0)
            return false;
        toward_u = toward_u != 0 ? toward_u : piece.toward_u;
        toward_v = toward_v != 0 ? toward_v : piece.toward_v;
        return true;
    }
};

void append_set(std::span<const DirectedPiece> pieces, int toward_v, MonotoneSets& out)
{
    out.sets.push_back(
        {static_cast<uint>(out.points.size() / 2), static_cast<uint>(pieces.size()), pieces.front().steps == 3});
    std::vector<float>& points = out.points;
    const size_t begin = points.size();
    points.insert(points.end(), pieces.front().first, pieces.front().first + 2);
    for (const DirectedPiece& piece : pieces)
        points.insert(points.end(), piece.first + 2, piece.last() + 2);
    if (toward_v >= 0)
        return;
    for (size_t i = begin, j = points.size() - 2; i < j; i += 2, j -= 2) {
        std::swap(points[i], points[j]);
        std::swap(points[i + 1], points[j + 1]);
    }
}

/// Cuts a chain of pieces, each of which begins where the one before ends, where it turns in u or in v.
void append_sets(std::span<const DirectedPiece> chain, MonotoneSets& out)
{
    for (size_t first = 0; first < chain.size();) {
        Course course(chain[first]);
        size_t end = first + 1;
        while (end < chain.size() && course.takes(chain[end]))
            ++end;
        append_set(chain.subspan(first, end - first), course.toward_v, out);
        first = end;
    }
}

/// The chain turned to begin at the first place where it must be cut, so that its own start cuts no set.
void rotate_to_a_turn(std::span<DirectedPiece> chain)
{
    if (!meet(chain.back(), chain.front()))
        return;
    Course course(chain.front());
    size_t turn = 1;
    while (turn < chain.size() && course.takes(chain[turn]))
        ++turn;
    std::rotate(chain.begin(), chain.begin() + static_cast<std::ptrdiff_t>(turn), chain.end());
}

} // namespace

MonotoneSets monotone_sets(const PackImage& image, const FaceRecord& face)
{
    std::vector<DirectedPiece> pieces = directed_pieces(image, face);
    MonotoneSets out;
    for (size_t first = 0; first < pieces.size();) {
        size_t end = first + 1;
        while (end < pieces.size() && meet(pieces[end - 1], pieces[end]))
            ++end;
        const std::span<DirectedPiece> chain = std::span(pieces).subspan(first, end - first);
        rotate_to_a_turn(chain);
        append_sets(chain, out);
        first = end;
    }
    return out;
}

} // namespace trimray
