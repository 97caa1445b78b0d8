// What a scene asks for beside its pack: lights, materials, effects, maps drawn on surfaces, sections. Lengths are mm
// in the world, angles degrees, colours linear light. All defaults ask for nothing: the picture is the pack's own
// colours under one light at the eye (shaders/shared/shading.h).
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace trimray {

enum class LightKind {
    Eye,         // at the eye: it moves with the camera and throws no shadow that is seen
    Directional, // from infinitely far, along `direction`
    Point,       // from `position_mm`, equally strong at every distance: what is lit does not depend on the unit
};
struct Light {
    LightKind kind = LightKind::Directional;
    std::array<double, 3> direction{0, 0, -1}; // the way light goes; any length but 0
    std::array<double, 3> position_mm{};
    std::array<float, 3> color{1, 1, 1}; // linear, times the light's strength
    // Half the angle that the light is seen under (Directional), or its radius (Point): 0 has sharp shadows
    double half_angle_deg = 0, radius_mm = 0;
    bool shadows = false;
};

/// What a face is made of. Fields that are not set leave what a rule before, or the pack, says.
struct Material {
    std::optional<std::array<float, 3>> color;
    std::optional<float> opacity;  // [0, 1]
    std::optional<float> mirror;   // share of light that is reflected as by a mirror, [0, 1]
    std::optional<float> specular; // strength of highlights, [0, 1]; kSpecular where nothing says
};

/// Gives `material` to all faces that meet every condition that is set; later rules win, field by field.
struct MaterialRule {
    std::optional<std::string> part;    // a part's or a placement's name, or "#N", the part's number in the pack
    std::vector<uint32_t> faces;        // numbers as `info` and the EXR's `face` have them; empty: all
    std::optional<uint32_t> pack_color; // 0xRRGGBB, sRGB: what the pack paints them with
    Material material;
};

/// What is drawn on surfaces in place of their colours, from exact derivatives.
enum class SurfaceMap {
    None,
    Zebra,     // stripes of a striped tube of light seen in the surface as in a mirror: breaks show G1, kinks G2
    Isophotes, // bands of equal angle to a direction
    CurvatureGaussian, // k1 k2, 1/mm^2
    CurvatureMean,     // (k1 + k2) / 2, 1/mm, positive where the surface is convex seen from outside
    CurvatureMax,      // the larger of k1 and k2, 1/mm
    CurvatureMin,      // the smaller
    Draft,             // angle between the surface and the pull direction, 90 deg - angle(normal, pull)
};
struct SurfaceMapLook {
    SurfaceMap map = SurfaceMap::None;
    uint32_t stripes = 16;                    // zebra and isophotes: pairs of bands over half a turn
    std::array<double, 3> direction{0, 0, 1}; // zebra: the stripes' axis; isophotes: the light; draft: the pull
    std::optional<std::array<double, 2>>
        range;            // curvatures: the values of the scale's ends; none: from the pack's size
    double draft_deg = 3; // draft: faces steeper than this are in order
};

enum class CapStyle { None, Filled, Hatched };
/// What lies on the side that `normal` points to is cut away. With several planes (6 at most) only what none cuts away
/// stays.
struct SectionPlane {
    std::array<double, 3> point_mm{};
    std::array<double, 3> normal{0, 0, 1}; // any length but 0
};
struct SectionLook {
    std::vector<SectionPlane> planes;
    CapStyle caps = CapStyle::Filled;
    std::optional<std::array<float, 3>> cap_color; // none: that of the face behind
};

/// Light from all around and above, hidden by what is near.
struct Occlusion {
    uint32_t samples = 0;                                      // rays a pixel; 0: none
    double reach_mm = std::numeric_limits<double>::infinity(); // what is farther hides nothing
};

/// A picture all around, equirectangular: the row's middle looks along +x, its right half turns to -y, the top row is
/// +z.
struct Environment {
    uint32_t width = 0, height = 0;
    std::vector<float> rgb; // 3 a pixel, linear light, row 0 at the top
    std::string name;       // of the file, for messages
};

/// Which placements are there, and where. A name is a part's or a placement's; "#N" is the part of that number in the
/// pack, "@N" the placement of that number.
struct Arrangement {
    std::vector<std::string> only; // empty: all
    std::vector<std::string> hide; // of those
    double explode = 0; // each moves away from the model's middle by so many times its own distance from there, >= 0
    bool any() const { return !only.empty() || !hide.empty() || explode != 0; }
};

struct SceneLook {
    // What rays that meet nothing see: an environment, else a colour, else nothing (alpha 0; black in mirrors)
    std::optional<std::array<float, 3>> background;
    std::shared_ptr<const Environment> environment;
    std::vector<Light> lights;   // none: the light at the eye
    uint32_t light_samples = 16; // rays a pixel to each light that is not a point or a direction alone
    Occlusion occlusion;
    // Strength of the light from all around; none: 1, but where there is occlusion and no lights are named 3, and the
    // light at the eye has 0.4 instead of 1, so that what is hidden is seen to be
    std::optional<float> sky;
    uint32_t mirror_depth = 1; // reflections of reflections that are followed
    std::vector<MaterialRule> materials;
    std::optional<float> xray; // opacity of every surface that no rule gives one: all of them show through
    SurfaceMapLook map;
    SectionLook section;
    Arrangement arrangement;
};

} // namespace trimray
