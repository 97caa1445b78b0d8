// trim_areas FILE...: every face's area from its trims beside the CAD kernel's own (BRepGProp), and what the trims
// take. A tool for corpora; the kernel's areas share no code with ours.
#include "format/derive.h"
#include "format/derive_kd.h"
#include "format/trim_query.h"
#include "preprocess/bezier_patch.h"
#include "preprocess/build_pack.h"
#include "preprocess/import/cad_import_kernel.h"
#include "tests/trim_areas.h"
#include "tests/trim_shapes.h"

#include <BRepGProp.hxx>
#include <GProp_GProps.hxx>
#include <TopExp.hxx>
#include <TopoDS.hxx>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fmt/format.h>
#include <random>

namespace {

using namespace trimray;

struct Row {
    double ours = 0, theirs = 0;
    std::string what;
};

int check(const std::string& path, double worst_allowed)
{
    const Result<kernel::CadFormat> format = kernel::detect_format(path, "");
    if (!format.ok()) {
        fmt::print("{}: {}\n", path, format.error().detail);
        return 1;
    }
    const ImportOptions import;
    const auto quiet = [](const char*, double) {};
    Result<kernel::LoadedFile> file = kernel::load_file(path, *format, import, quiet);
    if (!file.ok()) {
        fmt::print("{}: {}\n", path, file.error().detail);
        return 1;
    }
    std::vector<Row> rows;
    std::vector<CadDroppedFace> dropped;
    PackImage image;
    size_t faces = 0, natural = 0, failed = 0, open = 0;
    double seconds = 0, slowest = 0, deviation = 0, gap = 0;
    for (uint32_t p = 0; p < file->parts.size(); ++p) {
        const CadPart part = kernel::convert_part(file->parts[p], p, import, dropped, quiet);
        TopTools_IndexedMapOfShape shapes;
        TopExp::MapShapes(file->parts[p].shape, TopAbs_FACE, shapes);
        for (const CadFace& face : part.faces) {
            ++faces;
            const auto start = std::chrono::steady_clock::now();
            const Result<TrimLoops> loops = build_trim_loops(face, {});
            const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
            seconds += took;
            slowest = std::max(slowest, took);
            size_t uses = 0, spans = 0;
            for (const CadLoop& loop : face.loops)
                for (const CadEdgeUse& use : loop) {
                    ++uses;
                    spans += use.pcurve.control_points.size() - use.pcurve.degree;
                }
            std::string what = fmt::format("part {} face {} {} loops {} uses {} spans {}", p, face.face_in_part,
                                           face.surface.source_kind, face.loops.size(), uses, spans);
            if (!loops.ok()) {
                ++failed;
                GProp_GProps g;
                BRepGProp::SurfaceProperties(shapes(static_cast<int>(face.face_in_part) + 1), g);
                fmt::print("  FAILED {}: {} (kernel's area {})\n", what, loops.error().detail, g.Mass());
                continue;
            }
            natural += loops->natural_border;
            open += loops->had_open_loop;
            deviation = std::max(deviation, loops->largest_deviation);
            gap = std::max(gap, loops->largest_gap);
            GProp_GProps properties;
            BRepGProp::SurfaceProperties(shapes(static_cast<int>(face.face_in_part) + 1), properties);
            if (loops->largest_deviation > 1e-5)
                fmt::print("  deviation {:.1e}: {}\n", loops->largest_deviation, what);
            what += fmt::format(" pieces {} gap {:.1e} tol {:.1e} took {:.1f} ms{}", loops->pieces.size(),
                                loops->largest_gap, face.tolerance_mm, 1e3 * took, loops->had_open_loop ? " OPEN" : "");
            const double ours = trimmed_area(face.surface, *loops);
            double theirs = std::abs(properties.Mass());
            if (std::abs(ours - theirs) > 1e-5 * ours) { // each of its two quadratures fails on some faces
                BRepGProp::SurfaceProperties(shapes(static_cast<int>(face.face_in_part) + 1), properties, 1e-7);
                if (std::abs(ours - properties.Mass()) < std::abs(ours - theirs))
                    theirs = std::abs(properties.Mass());
            }
            rows.push_back({ours, theirs, what});

            FaceRecord record{};
            record.first_point = static_cast<uint>(image.trim_points.size() / 2);
            record.point_count = static_cast<uint>(loops->points.size() / 2);
            record.first_piece = static_cast<uint>(image.trim_pieces.size());
            record.piece_count = static_cast<uint>(loops->pieces.size());
            const SurfaceExtent extent = surface_extent(face.surface, loops->domain);
            record.extent_mm[0] = static_cast<float>(extent.length_u_mm);
            record.extent_mm[1] = static_cast<float>(extent.length_v_mm);
            record.area_mm2 = static_cast<float>(rows.back().ours);
            image.trim_points.insert(image.trim_points.end(), loops->points.begin(), loops->points.end());
            image.trim_pieces.insert(image.trim_pieces.end(), loops->pieces.begin(), loops->pieces.end());
            image.faces.push_back(record);
        }
    }
    auto start = std::chrono::steady_clock::now();
    derive_cells(image);
    const double cells_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    // the cells' answers at random points beside an exact count of crossings
    size_t asked = 0, wrong = 0;
    std::mt19937 rng(1);
    std::uniform_real_distribution<float> uniform(0, 1);
    for (uint f = 0; f < image.faces.size(); ++f) {
        if (image.faces[f].piece_count == 0)
            continue;
        const std::vector<MonotonePiece> pieces = shapes::pieces_of(image, f);
        for (int i = 0; i < 300; ++i, ++asked) {
            const float u = uniform(rng), v = uniform(rng);
            wrong += trim_inside(image, f, u, v) != shapes::exact_inside(pieces, u, v) &&
                     shapes::exact_distance(pieces, u, v) > 1e-6;
        }
    }
    start = std::chrono::steady_clock::now();
    allocate_trim_memory(image, kd_trim_bytes(image), {});
    derive_sdf(image);
    const double sdf_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

    const auto error = [](const Row& r) { return std::abs(r.ours - r.theirs) / std::max(r.theirs, 1e-9); };
    std::sort(rows.begin(), rows.end(), [&](const Row& a, const Row& b) { return error(a) > error(b); });
    size_t off3 = 0, off5 = 0;
    double ours = 0, theirs = 0;
    for (const Row& r : rows) {
        off3 += error(r) > 1e-3;
        off5 += error(r) > 1e-5;
        ours += r.ours;
        theirs += r.theirs;
    }
    size_t mixed = 0, cubics = 0, undecided = 0;
    for (const uint cell : image.cells)
        mixed += (cell & 3u) >= kCellMixedCornerOut;
    for (const uint word : image.trim_pieces)
        cubics += word & kPieceCubic;
    double band = 0;
    size_t textured = 0;
    for (const FaceRecord& face : image.faces)
        if (face.sdf_size != 0) {
            ++textured;
            undecided += face.sdf_band_texels > 4;
            band += std::min(face.sdf_band_texels, 4.0f);
        }
    fmt::print("{}: faces {} natural {} failed {} open {} pieces {} ({} cubic) deviation {:.1e} gap {:.1e}\n", path,
               faces, natural, failed, open, image.trim_pieces.size(), cubics, deviation, gap);
    fmt::print("  area off by > 1e-3: {}, > 1e-5: {}; total {:.6g} against {:.6g}; cells wrong at {} of {} points\n",
               off3, off5, ours, theirs, wrong, asked);
    fmt::print("  loops {:.3f} s (slowest face {:.3f}), cells {:.3f} s, textures {:.3f} s\n", seconds, slowest,
               cells_seconds, sdf_seconds);
    fmt::print("  bytes: points and pieces {}, cells {}, entries {}, textures {}, kd {}; entries a mixed cell {:.2f}, "
               "mixed {:.0f} %; texture undecided on {} of {} faces, band {:.2f}\n",
               4 * (image.trim_points.size() + image.trim_pieces.size()), 4 * image.cells.size(),
               8 * image.cell_entries.size(), 4 * image.sdf_words.size(), kd_trim_bytes(image),
               static_cast<double>(image.cell_entries.size()) / static_cast<double>(std::max<size_t>(1, mixed)),
               100.0 * static_cast<double>(mixed) / static_cast<double>(std::max<size_t>(1, image.cells.size())),
               undecided, textured, band / static_cast<double>(std::max<size_t>(1, textured)));
    for (size_t i = 0; i < std::min<size_t>(rows.size(), 12) && error(rows[i]) > worst_allowed; ++i)
        fmt::print("  {:.2e}: ours {:.8g} kernel {:.8g} {}\n", error(rows[i]), rows[i].ours, rows[i].theirs,
                   rows[i].what);
    return 0;
}

} // namespace

int main(int argc, char** argv)
{
    int status = argc > 1 ? 0 : 1;
    for (int i = 1; i < argc; ++i)
        status |= check(argv[i], 1e-4);
    return status;
}
