// What the colours of a map drawn on surfaces stand for: a scale to be shown beside the picture. The colours are made
// by the very formulas that draw the map (shaders/shared/surface_map.h), so that the two cannot part.
#pragma once

#include "format/pack_image.h"
#include "runtime/scene_look.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace trimray {

/// A place of the scale. Colours between two neighbours go over into each other; where the map's colour jumps, two lie
/// at one place.
struct LegendStop {
    double position = 0;           // from the scale's lower end, 0, to its upper one, 1
    double value = 0;              // in MapLegend::unit
    std::array<uint8_t, 4> srgb{}; // straight alpha, always opaque
};

struct LegendLabel {
    double position = 0;
    std::string text;
};

struct MapLegend {
    std::string title;              // "mean curvature"
    std::string unit;               // "1/mm", "1/mm²" or "°"
    std::string note;               // what else is to be known, a sentence; or empty
    std::vector<LegendStop> stops;  // positions ascend from 0 to 1
    std::vector<LegendLabel> ticks; // values, at stops
    std::vector<LegendLabel> names; // of stretches of the scale, at their middles; or none
    // The colours are the surfaces', and lights shade them; else what is seen straight on has the legend's colours
    bool lit = false;
};

/// Of curvatures the scale runs from end to end of their range, evenly, and values beyond an end have its colour. Of
/// draft it has three stretches of equal length, whatever the angles: undercut, too little, enough;
/// without a draft asked for two. Of bands it is one period, from the middle of a light band to the next one's.
/// Domain: check_map allows it, and the map is not none.
MapLegend map_legend(const PackImage& image, const SurfaceMapLook& look);

/// The colour of a surface whose map has this value (Frame::map_value; of zebra the angle between mirrored ray and
/// axis, of isophotes that between normal and direction, degrees), before lights shade it, or where bands are seen
/// straight on. Domain: as map_legend.
std::array<uint8_t, 4> map_color_srgb(const PackImage& image, const SurfaceMapLook& look, double value);

} // namespace trimray
