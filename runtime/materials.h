// What the faces of a scene are made of: a scene's rules (MaterialRule) resolved for a pack. A rule may name something
// of a face (its part, its number, its own colour), something of a placement (its name, its colour), or both; so faces
// and placements are sorted into classes that no rule tells apart, and the material of a face of a placement is found
// in a table of the two. Without rules and x-ray there is one class of each and one plain material.
#pragma once

#include "format/pack_image.h"
#include "format/result.h"
#include "runtime/scene_look.h"
#include "shaders/material_layout.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace trimray {

struct MaterialTable {
    std::vector<MaterialRecord> materials; // distinct, those that some face of some placement has; in order of classes
    std::vector<uint32_t> face_class;      // by face
    std::vector<uint32_t> instance_class;  // by placement
    uint32_t face_classes = 1;             // how many there are
    std::vector<uint32_t> of_classes;      // in `materials`, by instance class * face_classes + face class
    bool transparent = false;              // a material's opacity is below 1
    bool mirrors = false;                  // a material's mirror is above 0
    std::vector<size_t> unmatched;         // rules that match no face of any placement

    uint32_t index(uint32_t face, uint32_t instance) const
    {
        return of_classes[size_t{instance_class[instance]} * face_classes + face_class[face]];
    }
    size_t size_bytes() const
    {
        return materials.size() * sizeof(MaterialRecord) +
               (face_class.size() + instance_class.size() + of_classes.size()) * sizeof(uint32_t);
    }
    const MaterialRecord& of(uint32_t face, uint32_t instance) const { return materials[index(face, instance)]; }
};

// Of a table: beyond it, rules tell more faces and placements apart than is sensible
constexpr size_t kMostMaterialClasses = size_t{1} << 18;

/// Whether a scene says anything of materials; otherwise its table says nothing that the pack does not.
inline bool has_materials(const SceneLook& look)
{
    return !look.materials.empty() || look.xray;
}

/// Whether it says that light comes through something.
bool has_transparency(const SceneLook& look);

/// Source: docs of MaterialRule: a rule holds where all its conditions do; later rules win, field by field; x-ray is
/// the opacity where no rule gives one. A pack colour is a face's own, else its placement's, else the default grey.
/// Fails: InvalidScene (more than kMostMaterialClasses pairs of classes).
Result<MaterialTable> resolve_materials(const PackImage& image, const SceneLook& look);

} // namespace trimray
