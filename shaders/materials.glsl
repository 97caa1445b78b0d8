// What faces are made of.

const uint kMaterialHeadWords = 4u;
const uint kMaterialWords = 8u;

float material_float(uint word)
{
    return uintBitsToFloat(material_words[word]);
}

MaterialRecord material_of(uint face, uint instance)
{
    uint pair = material_words[material_words[2] + instance] * material_words[0] + material_words[material_words[3] + face];
    uint at = kMaterialHeadWords + kMaterialWords * material_words[material_words[1] + pair];
    return MaterialRecord(float[3](material_float(at), material_float(at + 1u), material_float(at + 2u)),
                          material_float(at + 3u), material_float(at + 4u), material_float(at + 5u),
                          material_float(at + 6u), 0.0f);
}

vec3 linear_color(uint rgba)
{
    return vec3(linear_of_srgb(float(rgba & 0xffu) / 255.0f), linear_of_srgb(float((rgba >> 8) & 0xffu) / 255.0f),
                linear_of_srgb(float((rgba >> 16) & 0xffu) / 255.0f));
}

// What a face of an instance is made of, with the pack's colour where nothing else says
MaterialRecord face_material(uint face_index, FaceRecord face, uint instance_index, FrameInstance instance)
{
    MaterialRecord material = MaterialRecord(float[3](0.0f, 0.0f, 0.0f), 0.0f, 1.0f, 0.0f, kSpecular, 0.0f);
    if (has_feature(kFeatureMaterials))
        material = material_of(face_index, instance_index);
    if (material.has_color > 0.0f)
        return material;
    uint rgba = instance.color_rgba >> 24 != 0u ? instance.color_rgba : kDefaultColor;
    if ((face.flags & kFaceHasColor) != 0u)
        rgba = face.color_rgba;
    vec3 color = linear_color(rgba);
    material.color = float[3](color.x, color.y, color.z);
    return material;
}
