// What a scene's look comes to for the shaders, in one buffer: this, and after it the light's samples, 2 floats each.
#ifndef TRIMRAY_LOOK_LAYOUT_H
#define TRIMRAY_LOOK_LAYOUT_H

#include "shaders/frame_layout.h"
#include "shaders/light_layout.h"
#include "shaders/section_layout.h"

#ifdef __cplusplus
namespace trimray {

struct LookFrame {
    PlaceView places;
    SectionView section;
    MapView map;
    LightView light;
    LightRecord lights[kMostLights];
};

} // namespace trimray
#endif

#endif
