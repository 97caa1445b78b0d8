// What a pack and a request call for, and why: the tracers are specialised to this plan, and what is not in it costs
// nothing. A pure function of its arguments; `trimray info` and `render --explain` print it.
#pragma once

#include "format/pack_image.h"
#include "runtime/pack_facts.h"
#include "runtime/tracer.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace trimray {

/// One thing the tracer must be able to do for this scene.
struct EffectItem {
    std::string name; // stable, lower case with hyphens: scripts compare it
    std::string why;  // with the counts it follows from
};

/// What the scene asks for beyond the pack (SceneLook), a bit each.
enum LookBit : uint32_t {
    kLookLights = 1u << 0,      // others than the one at the eye, or the sky's strength
    kLookShadows = 1u << 1,     // a light throws shadows
    kLookSoftShadows = 1u << 2, // ... and has a size
    kLookOcclusion = 1u << 3,
    kLookMirrors = 1u << 4,      // a rule makes a mirror
    kLookTransparency = 1u << 5, // a rule, or x-ray, lets light through
    kLookMaterials = 1u << 6,    // rules change colours or highlights
    kLookMap = 1u << 7,
    kLookSection = 1u << 8,
    kLookCaps = 1u << 9,
    kLookEnvironment = 1u << 10,
    kLookOrthographic = 1u << 11,
    kLookArrangement = 1u << 12, // placements are hidden or moved
};
constexpr uint32_t kLookBits = 13;

/// Bits of what `options` asks for. Without shading only arrangements, sections, the camera and
/// maps that measure count: all else changes colours alone.
uint32_t look_bits(const RenderOptions& options);

/// Whether a tracer does all that `options` asks for. `done`: LookBit of what it does. Fails: UnsupportedFormat, at the
/// option.
Status check_look(const RenderOptions& options, uint32_t done, const std::string& tracer);

struct EffectPlan {
    std::vector<EffectItem>
        items; // in a fixed order: kinds of patches, trims, placements, colours, search, arrangement,
               // camera, sections, maps, shading, what is drawn over it, lights, materials, device
    // What the tracers specialise themselves from
    uint32_t kinds = 0; // bit kKind...: such patches are met
    bool rational = false, trims = false, rims = false;
    TrimMode trim = TrimMode::Exact; // not auto
    bool shade = false;
    bool edges = false;    // borders are measured beside hits
    bool parallel = false; // rays do not meet at an eye
    bool lit = false;      // lights and the sky are gathered for each pixel (runtime/light_view.h)
    bool cut = false;      // rays begin and end at section planes
    bool materials = false, layers = false, mirrors = false, environment = false;
    bool stochastic = false, keeps_hits = false, reuses_hits = false;
    SurfaceMap map = SurfaceMap::None; // none also where it would not be seen
    uint32_t look = 0;                 // LookBit
    bool specialised = true;           // RenderOptions::specialise; else the sizes below are every scene's
    uint32_t degree_u = 0,
             degree_v = 0; // of all Bezier patches; 0: they differ, or the tracer is not specialised to it
    uint32_t largest_degree = kMaxDegree; // ... in either direction
    uint32_t stack_size = 0;
    uint32_t local_floats = 0;    // control points are copied into an array of so many floats; 0: they are not
    uint32_t iteration_limit = 0; // loop iterations a subgroup may run; 0: no limit
};

EffectPlan effect_plan(const PackFacts& facts, const RenderOptions& options, DeviceKind device);

/// Faces by the kind of their surface in the file, indexed by kKind….
std::array<uint32_t, kSurfaceKindCount> faces_by_kind(const PackImage& image);

/// The name of a surface kind: plane, cylinder, cone, sphere, torus, bezier.
const char* surface_kind_name(uint kind);

} // namespace trimray
