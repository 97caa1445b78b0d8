// Packs of random surfaces without trims, for tests of leaves and trees.
#pragma once

#include "format/pack_image.h"
#include "preprocess/bezier_patch.h"
#include "tests/random_surfaces.h"

#include <gtest/gtest.h>

namespace trimray::test {

/// A leaf's rectangle: uv_patch, or uv_face of a native surface.
struct UvRect {
    double lo[2], hi[2];
};
inline UvRect uv_of(const LeafRecord& leaf)
{
    return {{(leaf.uv_lo & 0xffffu) / 32768.0, (leaf.uv_lo >> 16) / 32768.0},
            {(leaf.uv_hi & 0xffffu) / 32768.0, (leaf.uv_hi >> 16) / 32768.0}};
}

/// A pack of `parts` parts with `faces` faces each, native and spline in turn, and each part placed twice.
/// Part `empty_part` has none.
inline PackImage random_pack(uint32_t seed, uint parts, uint faces, uint empty_part = ~0u)
{
    RandomSurfaces random(seed);
    PackImage image;
    for (uint p = 0; p < parts; ++p) {
        PartRecord part{};
        part.origin_mm[0] = random.uniform(-5, 5);
        part.scale_mm = 40;
        part.first_face = uint(image.faces.size());
        part.face_count = p == empty_part ? 0 : faces;
        part.first_patch = uint(image.patches.size());
        const PartFrame frame{{part.origin_mm[0], 0, 0}, part.scale_mm};
        for (uint f = 0; f < part.face_count; ++f) {
            const uint kind = (p + f) % kSurfaceKindCount;
            FaceRecord face{};
            face.part = p;
            face.first_patch = uint(image.patches.size());
            CadSurface surface;
            Rect2d domain;
            if (kind == kKindBezier) {
                surface = random.spline(random.integer(1, 5), random.integer(1, 5), random.integer(0, 1) == 1,
                                        random.integer(1, 3), random.integer(1, 3));
                domain = surface.natural_bounds;
            } else {
                surface = random.native(kind);
                domain = random.native_domain(kind);
            }
            const auto appended =
                append_patches(surface, domain, frame, part.first_face + f, image.patches, image.control_points);
            EXPECT_TRUE(appended.ok()) << (appended.ok() ? "" : appended.error().detail);
            face.patch_count = uint(image.patches.size()) - face.first_patch;
            image.faces.push_back(face);
        }
        part.patch_count = uint(image.patches.size()) - part.first_patch;
        image.parts.push_back(part);
    }
    for (uint i = 0; i < 2 * parts; ++i) {
        InstanceRecord instance{};
        const CadFrame f = random.frame(100);
        const Vec3d axes[3] = {f.x, f.y, f.z};
        for (int c = 0; c < 3; ++c) {
            instance.transform[c] = axes[c].x;
            instance.transform[4 + c] = axes[c].y;
            instance.transform[8 + c] = axes[c].z;
        }
        instance.transform[3] = f.origin.x;
        instance.transform[7] = f.origin.y;
        instance.transform[11] = f.origin.z;
        instance.part = i % parts;
        image.instances.push_back(instance);
    }
    image.tree.push_back({});
    return image;
}

} // namespace trimray::test
