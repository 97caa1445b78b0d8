#include "preprocess/build_pack.h"

#include "format/derive_kd.h"
#include "preprocess/bezier_patch.h"
#include "preprocess/closed_shell.h"
#include "preprocess/proxy_mesh.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <fmt/format.h>
#include <iterator>
#include <limits>
#include <span>

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace trimray {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start)
{
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// What one face becomes, before it has its place in the pack's arrays.
struct ConvertedFace {
    const CadFace* cad = nullptr;
    uint32_t part = 0;
    std::string dropped_reason; // empty: converted
    TrimLoops trims;
    uint32_t rims = 0; // rim_flags
    SurfaceExtent extent;
    double inside_fraction = 1;
    std::vector<PatchRecord> patches; // first_control_point relative to control_points
    std::vector<float> control_points;
    AppendedPatches appended;
};

/// Share of the uv square inside the loops (even-odd), by 32 scan lines over the pieces. For the estimate A_k of paper
/// eq. 4.
double estimate_inside_fraction(const TrimLoops& trims)
{
    if (trims.natural_border)
        return 1;
    constexpr int kRows = 32;
    std::array<std::vector<float>, kRows> crossings;
    const auto add_segment = [&](float u0, float v0, float u1, float v1) {
        const auto [lo, hi] = std::minmax(v0, v1);
        const int first = std::clamp(static_cast<int>(std::ceil(lo * kRows - 0.5f)), 0, kRows);
        for (int row = first; row < kRows && (row + 0.5f) / kRows < hi; ++row) {
            const float v = (row + 0.5f) / kRows;
            crossings[row].push_back(u0 + (u1 - u0) * (v - v0) / (v1 - v0));
        }
    };
    for (const uint32_t word : trims.pieces) {
        const float* p = &trims.points[2 * (word >> kPiecePointShift)];
        if ((word & kPieceCubic) == 0) {
            add_segment(p[0], p[1], p[2], p[3]);
            continue;
        }
        constexpr int kChords = 8; // an estimate: the chords' area differs from the cubic's by under a percent
        float u0 = p[0], v0 = p[1];
        for (int i = 1; i <= kChords; ++i) {
            const float t = static_cast<float>(i) / kChords, s = 1 - t;
            const float b[4] = {s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
            const float u1 = b[0] * p[0] + b[1] * p[2] + b[2] * p[4] + b[3] * p[6];
            const float v1 = b[0] * p[1] + b[1] * p[3] + b[2] * p[5] + b[3] * p[7];
            add_segment(u0, v0, u1, v1);
            u0 = u1, v0 = v1;
        }
    }
    double inside = 0;
    for (std::vector<float>& row : crossings) {
        std::sort(row.begin(), row.end());
        for (size_t i = 0; i + 1 < row.size(); i += 2)
            inside += row[i + 1] - row[i];
    }
    return std::clamp(inside / kRows, 0.0, 1.0);
}

/// A box around the part: every face sampled 9 x 9 over its domain, grown by what lies between the samples (an arc of
/// 45 degrees rises 8 % of its radius above its ends). The tracers need numbers of about 1, not a tight box.
PartFrame part_frame(const std::vector<ConvertedFace>& faces, size_t first, size_t last)
{
    constexpr int kSamples = 9;
    constexpr double kMargin = 1.1;
    constexpr double kInf = std::numeric_limits<double>::infinity();
    Vec3d lo{kInf, kInf, kInf}, hi{-kInf, -kInf, -kInf};
    for (size_t f = first; f < last; ++f) {
        if (!faces[f].dropped_reason.empty())
            continue;
        const Rect2d& domain = faces[f].trims.domain;
        for (int i = 0; i < kSamples; ++i) {
            for (int j = 0; j < kSamples; ++j) {
                const double u = std::lerp(domain.lo.x, domain.hi.x, i / double(kSamples - 1));
                const double v = std::lerp(domain.lo.y, domain.hi.y, j / double(kSamples - 1));
                const Vec3d p = evaluate(faces[f].cad->surface, u, v).p;
                lo = {std::min(lo.x, p.x), std::min(lo.y, p.y), std::min(lo.z, p.z)};
                hi = {std::max(hi.x, p.x), std::max(hi.y, p.y), std::max(hi.z, p.z)};
            }
        }
    }
    PartFrame frame;
    if (!(lo.x <= hi.x))
        return frame; // no face was converted
    frame.origin_mm = {(lo.x + hi.x) / 2, (lo.y + hi.y) / 2, (lo.z + hi.z) / 2};
    const double half = std::max({hi.x - lo.x, hi.y - lo.y, hi.z - lo.z}) / 2;
    frame.scale_mm = half > 0 ? half * kMargin : 1;
    return frame;
}

std::string first_bad_number(const ConvertedFace& face)
{
    const auto bad = [](double x) { return !std::isfinite(x); };
    const Rect2d& d = face.trims.domain;
    if (bad(d.lo.x) || bad(d.lo.y) || bad(d.hi.x) || bad(d.hi.y))
        return "its domain is not finite";
    if (!(d.hi.x > d.lo.x) || !(d.hi.y > d.lo.y))
        return "its domain has no area";
    if (bad(face.extent.area_mm2) || bad(face.extent.length_u_mm) || bad(face.extent.length_v_mm))
        return "its surface is not finite over its domain";
    return {};
}

void convert_trims(ConvertedFace& face, const TrimOptions& options)
{
    Result<TrimLoops> loops = build_trim_loops(*face.cad, options);
    if (!loops.ok()) {
        face.dropped_reason = loops.error().detail;
        return;
    }
    face.trims = std::move(loops).value();
    face.extent = surface_extent(face.cad->surface, face.trims.domain);
    face.inside_fraction = estimate_inside_fraction(face.trims);
    face.dropped_reason = first_bad_number(face);
}

void convert_surface(ConvertedFace& face, const PartFrame& frame, TrimOptions options)
{
    const auto append = [&] {
        return append_patches(face.cad->surface, face.trims.domain, frame, 0, face.patches, face.control_points);
    };
    Result<AppendedPatches> appended = append();
    if (!appended.ok() && options.grow) {
        // beyond its knots a rational spline may have weights that are not positive: then its border stays
        const Vec2d corner = face.trims.domain.lo;
        options.grow = false;
        convert_trims(face, options);
        face.trims.findings.push_back({TrimFindingKind::NotGrown, corner, 0, -1, -1, NotGrownReason::Surface});
        if (face.dropped_reason.empty())
            appended = append();
    }
    if (!appended.ok())
        face.dropped_reason = appended.error().detail;
    else if (face.patches.empty())
        face.dropped_reason = "its surface gave no patch over its domain";
    else
        face.appended = *appended;
}

/// A measure that sizes things, to 12 bits (1e-4 of itself): no decision needs more, and noise does not compress.
float rough(double x)
{
    int exponent = 0;
    const double mantissa = std::frexp(x, &exponent);
    return static_cast<float>(std::ldexp(std::nearbyint(std::ldexp(mantissa, 12)), exponent - 12));
}

FaceRecord face_record(const ConvertedFace& face, StringTable& strings)
{
    const CadFace& cad = *face.cad;
    FaceRecord r{};
    r.part = face.part;
    r.name = strings.add(cad.name);
    r.color_rgba = cad.color_rgba.value_or(0);
    r.flags = (cad.reversed ? kFaceReversed : 0) | (face.trims.natural_border ? kFaceNaturalBorder : 0) |
              (cad.color_rgba ? kFaceHasColor : 0) | (cad.surface.deviation_mm > 0 ? kFaceApproximated : 0) |
              (face.trims.had_open_loop ? kFaceOpenLoop : 0) | face.rims;
    r.area_mm2 = rough(face.extent.area_mm2 * face.inside_fraction);
    r.tolerance_mm = static_cast<float>(cad.tolerance_mm);
    r.deviation_mm = static_cast<float>(cad.surface.deviation_mm);
    r.extent_mm[0] = rough(face.extent.length_u_mm);
    r.extent_mm[1] = rough(face.extent.length_v_mm);
    r.surface_kind = cad.surface.kind;
    r.loop_count = face.trims.loop_count;
    r.border_classes = face.trims.border_classes;
    r.domain_lo[0] = face.trims.domain.lo.x;
    r.domain_lo[1] = face.trims.domain.lo.y;
    r.domain_hi[0] = face.trims.domain.hi.x;
    r.domain_hi[1] = face.trims.domain.hi.y;
    return r;
}

/// Where weights lie so far apart that single precision does not keep what it keeps elsewhere.
void warn_of_weights(const ConvertedFace& face, double trim_tolerance, std::vector<std::string>& warnings)
{
    const AppendedPatches& a = face.appended;
    if (a.too_fast > 0)
        warnings.push_back(fmt::format("part {}, face {}: weights so far apart that {} of its patches would have to be "
                                       "cut finer than they are: rays may pass through it",
                                       face.part, face.cad->face_in_part, a.too_fast));
    const double longer_mm = std::max(face.extent.length_u_mm, face.extent.length_v_mm);
    if (a.cut > 0 && !face.trims.natural_border && a.uv_face_mm > trim_tolerance * longer_mm)
        warnings.push_back(fmt::format("part {}, face {}: weights so far apart that single-precision parameters round "
                                       "the points of its trims by up to {:.2g} mm",
                                       face.part, face.cad->face_in_part, a.uv_face_mm));
}

/// Gives the faces of a part's closed shells their rims. Domain: converted faces. Returns what is wrong with the part's
/// orientation, in words; empty: nothing.
std::string find_rims(const CadPart& part, std::span<ConvertedFace> faces)
{
    std::vector<ShellFace> shell;
    for (const ConvertedFace& face : faces)
        shell.push_back({face.cad, face.dropped_reason.empty() ? &face.trims : nullptr});
    const ClosedShells closed = find_closed_shells(shell, part.edges.size());
    for (size_t f = 0; f < faces.size(); ++f)
        if (closed.in_one[f])
            faces[f].rims = rim_flags(faces[f].cad->surface, faces[f].trims);
    if (closed.inside_out)
        return fmt::format("part \"{}\" is inside out: its faces point inwards", part.name);
    if (closed.disputed_edges > 0)
        return fmt::format("part \"{}\": at {} edges one face points inwards and its neighbour outwards", part.name,
                           closed.disputed_edges);
    return {};
}

void append_face(const ConvertedFace& face, PackImage& image)
{
    FaceRecord r = face_record(face, image.strings);
    const uint id = static_cast<uint>(image.faces.size());
    r.first_patch = static_cast<uint>(image.patches.size());
    r.patch_count = static_cast<uint>(face.patches.size());
    const uint first_float = static_cast<uint>(image.control_points.size());
    for (PatchRecord patch : face.patches) {
        patch.face = id;
        if ((patch.shape & 0xffu) == kKindBezier)
            patch.first_control_point += first_float;
        image.patches.push_back(patch);
    }
    image.control_points.insert(image.control_points.end(), face.control_points.begin(), face.control_points.end());
    r.first_point = static_cast<uint>(image.trim_points.size() / 2);
    r.point_count = static_cast<uint>(face.trims.points.size() / 2);
    r.first_piece = static_cast<uint>(image.trim_pieces.size());
    r.piece_count = static_cast<uint>(face.trims.pieces.size());
    image.trim_points.insert(image.trim_points.end(), face.trims.points.begin(), face.trims.points.end());
    image.trim_pieces.insert(image.trim_pieces.end(), face.trims.pieces.begin(), face.trims.pieces.end());
    image.faces.push_back(r);
}

void append_dropped(const CadModel& model, const std::vector<ConvertedFace>& faces, PackImage& image)
{
    for (const CadDroppedFace& d : model.dropped)
        image.dropped.push_back({d.part, d.face_in_part, image.strings.add(d.reason), image.strings.add(d.name)});
    for (const ConvertedFace& f : faces)
        if (!f.dropped_reason.empty())
            image.dropped.push_back(
                {f.part, f.cad->face_in_part, image.strings.add(f.dropped_reason), image.strings.add(f.cad->name)});
    std::stable_sort(image.dropped.begin(), image.dropped.end(), [](const DroppedFace& a, const DroppedFace& b) {
        return a.part != b.part ? a.part < b.part : a.face_in_part < b.face_in_part;
    });
}

void append_assembly(const CadModel& model, PackImage& image)
{
    for (const CadTreeNode& node : model.tree)
        image.tree.push_back({node.parent, image.strings.add(node.name), node.color_rgba.value_or(0), 0});
    if (image.tree.empty())
        image.tree.push_back({0, 0, 0, 0});
    for (const CadInstance& cad : model.instances) {
        InstanceRecord instance{};
        std::copy(cad.transform.begin(), cad.transform.end(), instance.transform);
        instance.part = cad.part;
        instance.name = image.strings.add(cad.name);
        instance.color_rgba = cad.color_rgba.value_or(0);
        instance.tree_node = cad.tree_node;
        image.instances.push_back(instance);
    }
}

void add_proxy(const CadModel& model, const FaceIds& face_ids, PackImage& image, BuildReport& report)
{
    Result<std::vector<std::byte>> encoded = encode_proxy(collect_proxy(model, image, face_ids));
    if (encoded.ok())
        image.proxy_draco = std::move(encoded).value();
    else
        report.warnings.push_back("no proxy mesh: " + encoded.error().detail);
}

void convert(const CadModel& model, const BuildOptions& options, PackImage& image, FaceIds& face_ids,
             BuildReport& report)
{
    std::vector<ConvertedFace> faces;
    std::vector<size_t> first_of_part;
    for (size_t part = 0; part < model.parts.size(); ++part) {
        first_of_part.push_back(faces.size());
        for (const CadFace& face : model.parts[part].faces) {
            ConvertedFace converted;
            converted.cad = &face;
            converted.part = static_cast<uint32_t>(part);
            faces.push_back(std::move(converted));
        }
    }
    first_of_part.push_back(faces.size());
    const auto for_each_face = [&](auto&& step) {
        tbb::parallel_for(size_t{0}, faces.size(), [&](size_t f) { step(faces[f]); });
    };

    auto start = Clock::now();
    for_each_face([&](ConvertedFace& face) { convert_trims(face, options.trims); });
    report.trims_seconds = seconds_since(start);

    start = Clock::now();
    std::vector<PartFrame> frames;
    for (size_t part = 0; part < model.parts.size(); ++part)
        frames.push_back(part_frame(faces, first_of_part[part], first_of_part[part + 1]));
    for_each_face([&](ConvertedFace& face) {
        if (face.dropped_reason.empty())
            convert_surface(face, frames[face.part], options.trims);
    });
    std::vector<std::string> orientation_warnings(model.parts.size());
    tbb::parallel_for(size_t{0}, model.parts.size(), [&](size_t part) {
        const size_t first = first_of_part[part];
        orientation_warnings[part] =
            find_rims(model.parts[part], std::span(faces).subspan(first, first_of_part[part + 1] - first));
    });
    face_ids.resize(model.parts.size());
    for (size_t part = 0; part < model.parts.size(); ++part) {
        PartRecord record{};
        record.origin_mm[0] = frames[part].origin_mm.x;
        record.origin_mm[1] = frames[part].origin_mm.y;
        record.origin_mm[2] = frames[part].origin_mm.z;
        record.scale_mm = frames[part].scale_mm;
        record.name = image.strings.add(model.parts[part].name);
        record.first_face = static_cast<uint>(image.faces.size());
        record.first_patch = static_cast<uint>(image.patches.size());
        for (size_t f = first_of_part[part]; f < first_of_part[part + 1]; ++f) {
            const bool converted = faces[f].dropped_reason.empty();
            face_ids[part].push_back(converted ? static_cast<uint>(image.faces.size()) : kNotConverted);
            if (!converted)
                continue;
            append_face(faces[f], image);
            for (const TrimFinding& finding : faces[f].trims.findings)
                report.trim_findings.push_back({faces[f].part, faces[f].cad->face_in_part, finding});
        }
        record.face_count = static_cast<uint>(image.faces.size()) - record.first_face;
        record.patch_count = static_cast<uint>(image.patches.size()) - record.first_patch;
        image.parts.push_back(record);
    }
    append_assembly(model, image);
    append_dropped(model, faces, image);
    report.convert_seconds = seconds_since(start);

    report.converted = static_cast<uint32_t>(image.faces.size());
    report.faces = report.converted + static_cast<uint32_t>(image.dropped.size());
    report.warnings = model.warnings;
    std::copy_if(orientation_warnings.begin(), orientation_warnings.end(), std::back_inserter(report.warnings),
                 [](const std::string& warning) { return !warning.empty(); });
    for (const ConvertedFace& face : faces)
        if (face.dropped_reason.empty())
            warn_of_weights(face, options.trims.tolerance, report.warnings);
}

void derive(const CadModel& model, const BuildOptions& options, const FaceIds& face_ids, PackImage& image,
            BuildReport& report)
{
    auto start = Clock::now();
    derive_leaves(image, options.leaves);
    report.convert_seconds += seconds_since(start);

    start = Clock::now();
    derive_trees(image);
    report.bvh_seconds = seconds_since(start);

    start = Clock::now();
    derive_cells(image);
    const double sdf_bytes = options.trim_memory_bytes >= 0 ? options.trim_memory_bytes
                                                            : options.trim_memory_fraction * kd_trim_bytes(image);
    allocate_trim_memory(image, sdf_bytes, options.trim_textures);
    derive_sdf(image);
    report.trims_seconds += seconds_since(start);

    start = Clock::now();
    if (!options.compact) // coarse triangles follow from the rest, and no thumbnail needs them
        add_proxy(model, face_ids, image, report);
    report.proxy_seconds = seconds_since(start);
}

} // namespace

ConvertedFaces convert_faces(const CadModel& model, const BuildOptions& options, BuildReport& report)
{
    ConvertedFaces out;
    PackImage& image = out.image;
    image.compact = options.compact;
    image.leaf_options = options.leaves;
    image.provenance.source_format = model.source_format;
    image.provenance.source_unit = model.source_unit;
    tbb::task_arena arena(options.threads > 0 ? options.threads : tbb::task_arena::automatic);
    arena.execute([&] { convert(model, options, image, out.face_ids, report); });
    return out;
}

PackImage build_pack(const CadModel& model, const BuildOptions& options, BuildReport& report)
{
    ConvertedFaces converted = convert_faces(model, options, report);
    tbb::task_arena arena(options.threads > 0 ? options.threads : tbb::task_arena::automatic);
    arena.execute([&] { derive(model, options, converted.face_ids, converted.image, report); });
    return std::move(converted.image);
}

} // namespace trimray
