#include "runtime/materials.h"

#include "runtime/pack_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <map>
#include <string>
#include <utility>

namespace trimray {
namespace {

constexpr uint kDefaultColor = 0xffb4b0acu; // as in shaders/shared/shading.h
constexpr float kDefaultSpecular = 0.12f;   // kSpecular there

/// 0xRRGGBB of a pack's colour, whose red is in the low byte.
uint32_t rgb_of(uint rgba)
{
    return (rgba & 0xffu) << 16 | (rgba & 0xff00u) | (rgba >> 16 & 0xffu);
}

// How a rule's conditions stand for a face: they fail, or they hold if its placement's own do
constexpr char kNever = 0, kAlways = 1, kNeedsName = 2, kNeedsColor = 4; // the needs are bits, over kAlways
// and for a placement: bits of what it has
constexpr char kHasName = 2, kHasColor = 4;

bool holds(char face, char instance)
{
    return face != kNever && ((face & (kNeedsName | kNeedsColor)) & ~instance) == 0;
}

/// Whether a rule names a part: by its name or by "#" and its number.
bool names_part(const PackImage& image, const MaterialRule& rule, uint32_t part)
{
    return *rule.part == string_at(image, image.parts[part].name) || *rule.part == fmt::format("#{}", part);
}

/// How a rule stands for each face. Shapes: one a face.
std::vector<char> face_states(const PackImage& image, const MaterialRule& rule)
{
    std::vector<char> named(image.parts.size(), !rule.part);
    for (uint32_t part = 0; rule.part && part < image.parts.size(); ++part)
        named[part] = names_part(image, rule, part);
    std::vector<char> states(image.faces.size(), rule.faces.empty() ? kAlways : kNever);
    for (const uint32_t face : rule.faces)
        if (face < states.size())
            states[face] = kAlways;
    for (size_t f = 0; f < states.size(); ++f) {
        const FaceRecord& face = image.faces[f];
        if (states[f] == kNever)
            continue;
        if (!named[face.part])
            states[f] |= kNeedsName;
        if (!rule.pack_color)
            continue;
        if ((face.flags & kFaceHasColor) == 0)
            states[f] |= kNeedsColor;
        else if (rgb_of(face.color_rgba) != *rule.pack_color)
            states[f] = kNever;
    }
    return states;
}

/// How a rule stands for each placement. Shapes: one a placement.
std::vector<char> instance_states(const PackImage& image, const MaterialRule& rule)
{
    std::vector<char> states;
    for (const InstanceRecord& instance : image.instances) {
        char state = 0;
        if (rule.part && *rule.part == string_at(image, instance.name))
            state |= kHasName;
        if (rule.pack_color &&
            rgb_of(instance.color_rgba >> 24 != 0 ? instance.color_rgba : kDefaultColor) == *rule.pack_color)
            state |= kHasColor;
        states.push_back(state);
    }
    return states;
}

/// Splits classes by a further rule's states; numbers follow the first of each.
void split(const std::vector<char>& states, std::vector<uint32_t>& classes, std::vector<std::string>& signatures)
{
    std::map<std::pair<uint32_t, char>, uint32_t> numbers;
    std::vector<std::string> split_signatures;
    for (size_t i = 0; i < states.size(); ++i) {
        const auto [number, is_new] =
            numbers.try_emplace({classes[i], states[i]}, static_cast<uint32_t>(split_signatures.size()));
        if (is_new)
            split_signatures.push_back(signatures[classes[i]] + states[i]);
        classes[i] = number->second;
    }
    if (!states.empty())
        signatures = std::move(split_signatures);
    else
        signatures[0] += char{0};
}

MaterialRecord material_of(const SceneLook& look, const std::string& face, const std::string& instance)
{
    MaterialRecord record{{0, 0, 0}, 0, look.xray.value_or(1), 0, kDefaultSpecular, 0};
    for (size_t r = 0; r < look.materials.size(); ++r) {
        if (!holds(face[r], instance[r]))
            continue;
        const Material& gives = look.materials[r].material;
        if (gives.color) {
            std::copy(gives.color->begin(), gives.color->end(), record.color);
            record.has_color = 1;
        }
        record.opacity = gives.opacity.value_or(record.opacity);
        record.mirror = gives.mirror.value_or(record.mirror);
        record.specular = gives.specular.value_or(record.specular);
    }
    return record;
}

/// Pairs of classes that some face of some placement has: instance class * face_classes + face class.
std::vector<uint8_t> pairs_there(const PackImage& image, const MaterialTable& table, size_t pairs)
{
    std::vector<std::vector<uint32_t>> of_part(image.parts.size()); // face classes
    for (size_t f = 0; f < image.faces.size(); ++f)
        of_part[image.faces[f].part].push_back(table.face_class[f]);
    for (std::vector<uint32_t>& classes : of_part) {
        std::sort(classes.begin(), classes.end());
        classes.erase(std::unique(classes.begin(), classes.end()), classes.end());
    }
    std::vector<uint8_t> there(pairs);
    for (size_t i = 0; i < image.instances.size(); ++i)
        for (const uint32_t face_class : of_part[image.instances[i].part])
            there[size_t{table.instance_class[i]} * table.face_classes + face_class] = 1;
    return there;
}

} // namespace

bool has_transparency(const SceneLook& look)
{
    return look.xray.value_or(1) < 1 ||
           std::any_of(look.materials.begin(), look.materials.end(),
                       [](const MaterialRule& rule) { return rule.material.opacity.value_or(1) < 1; });
}

Result<MaterialTable> resolve_materials(const PackImage& image, const SceneLook& look)
{
    MaterialTable table;
    table.face_class.assign(image.faces.size(), 0);
    table.instance_class.assign(image.instances.size(), 0);
    std::vector<std::string> faces{""}, instances{""}; // by class: how each rule stands
    for (const MaterialRule& rule : look.materials) {
        split(face_states(image, rule), table.face_class, faces);
        split(instance_states(image, rule), table.instance_class, instances);
    }
    table.face_classes = static_cast<uint32_t>(faces.size());
    if (faces.size() * instances.size() > kMostMaterialClasses)
        return Error{ErrorCode::InvalidScene, "materials",
                     fmt::format("the rules tell {} kinds of faces and {} kinds of placements apart; pairs of them may "
                                 "be at most {}",
                                 faces.size(), instances.size(), kMostMaterialClasses)};
    const size_t pairs = faces.size() * instances.size();
    const std::vector<uint8_t> there = pairs_there(image, table, pairs);
    table.of_classes.assign(pairs, 0);
    std::vector<uint8_t> matched(look.materials.size());
    std::map<std::array<float, 8>, uint32_t> numbers; // of distinct materials
    for (size_t pair = 0; pair < pairs; ++pair) {
        if (!there[pair])
            continue;
        const std::string& face = faces[pair % faces.size()];
        const std::string& instance = instances[pair / faces.size()];
        for (size_t r = 0; r < matched.size(); ++r)
            matched[r] |= uint8_t{holds(face[r], instance[r])};
        const MaterialRecord record = material_of(look, face, instance);
        const auto [number, is_new] = numbers.try_emplace(std::bit_cast<std::array<float, 8>>(record),
                                                          static_cast<uint32_t>(table.materials.size()));
        table.of_classes[pair] = number->second;
        if (is_new)
            table.materials.push_back(record);
        table.transparent = table.transparent || record.opacity < 1;
        table.mirrors = table.mirrors || record.mirror > 0;
    }
    if (table.materials.empty()) // nothing is placed
        table.materials.push_back({{0, 0, 0}, 0, 1, 0, kDefaultSpecular, 0});
    for (size_t r = 0; r < matched.size(); ++r)
        if (!matched[r])
            table.unmatched.push_back(r);
    return table;
}

} // namespace trimray
