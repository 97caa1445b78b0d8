// Loads a pack and traces one ray through the middle of the model, from above: what it hits, where, and how the surface
// lies there. usage: trace_one_ray MODEL.tray
#include "runtime/tracer.h"

#include <cstdio>

int main(int argc, char** argv)
{
    if (argc != 2) {
        std::fprintf(stderr, "usage: trace_one_ray MODEL.tray\n");
        return trimray::kExitUsage;
    }
    const auto scene = trimray::load_scene(argv[1]);
    if (!scene.ok()) {
        std::fprintf(stderr, "trace_one_ray: %s: %s\n", scene.error().where.c_str(), scene.error().detail.c_str());
        return trimray::exit_code(scene.error());
    }
    const trimray::PackImage& image = (*scene)->pack.image;
    const double* lo = image.bounds_lo_mm;
    const double* hi = image.bounds_hi_mm;
    const double above_mm = 0.5 * (hi[2] - lo[2]);
    const trimray::RayHit hit =
        trimray::trace_ray(**scene, {0.5 * (lo[0] + hi[0]), 0.5 * (lo[1] + hi[1]), hi[2] + above_mm}, {0, 0, -1});
    if (!hit.hit) {
        std::printf("miss\n");
        return trimray::kExitOk;
    }
    std::printf("face %d of instance %d at z = %.6f mm, uv (%.6f, %.6f), normal (%.4f, %.4f, %.4f)\n", hit.face,
                hit.instance, hi[2] + above_mm - hit.distance_mm, hit.uv[0], hit.uv[1], hit.normal[0], hit.normal[1],
                hit.normal[2]);
    return trimray::kExitOk;
}
