// Assemblies made by hand: parts without geometry, nodes and placements.
#pragma once

#include "format/pack_image.h"

#include <string>

namespace trimray {

inline uint add_part(PackImage& image, const std::string& name, uint faces)
{
    PartRecord part{};
    part.name = image.strings.add(name);
    part.first_face = uint(image.faces.size());
    part.face_count = faces;
    for (uint i = 0; i < faces; ++i) {
        FaceRecord face{};
        face.part = uint(image.parts.size());
        image.faces.push_back(face);
    }
    image.parts.push_back(part);
    return uint(image.parts.size() - 1);
}

inline uint add_node(PackImage& image, uint parent, const std::string& name, uint rgba = 0)
{
    image.tree.push_back({parent, image.strings.add(name), rgba, 0});
    return uint(image.tree.size() - 1);
}

inline uint place(PackImage& image, uint part, uint node, const std::string& name = "")
{
    InstanceRecord instance{};
    instance.part = part;
    instance.tree_node = node;
    instance.name = image.strings.add(name);
    image.instances.push_back(instance);
    return uint(image.instances.size() - 1);
}

/// car -> (wheels -> (wheel, unnamed), unnamed with two placements, body)
struct Car {
    PackImage image;
    Car()
    {
        const uint rim = add_part(image, "Rim", 3), hidden = add_part(image, "", 5), bolt = add_part(image, "BÖLT", 1);
        add_node(image, 0, "car");
        const uint wheels = add_node(image, 0, "Wheels", 0xff0000ffu);
        const uint pair = add_node(image, 0, "");
        const uint body = add_node(image, 0, "Кузов", 0x0000ff00u); // alpha 0: no colour
        const uint wheel = add_node(image, wheels, "wheel 1");
        const uint unnamed = add_node(image, wheels, "");
        place(image, rim, wheel, "left");
        place(image, hidden, pair);
        place(image, bolt, pair, "screw");
        place(image, hidden, unnamed);
        place(image, rim, body);
        place(image, rim, wheel);
    }
};

} // namespace trimray
