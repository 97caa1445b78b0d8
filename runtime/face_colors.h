// The colour of a face as a scene shows it.
#pragma once

#include "runtime/cpu_view.h"
#include "runtime/materials.h"

namespace trimray {

struct FaceColors {
    const CpuScene& scene;
    const MaterialTable* materials = nullptr; // null: what the pack says

    /// Linear light, three numbers: its material's where that has one, else its own, else its placement's.
    const float* of(uint32_t face, uint32_t instance) const
    {
        if (materials)
            if (const MaterialRecord& material = materials->of(face, instance); material.has_color > 0)
                return material.color;
        const bool own = (scene.image.faces[face].flags & kFaceHasColor) != 0;
        return own ? scene.face_color[face].data() : scene.instance_color[instance].data();
    }
};

} // namespace trimray
