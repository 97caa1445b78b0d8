// What faces are painted with, linear light.

vec3 linear_color(uint rgba)
{
    return vec3(linear_of_srgb(float(rgba & 0xffu) / 255.0f), linear_of_srgb(float((rgba >> 8) & 0xffu) / 255.0f),
                linear_of_srgb(float((rgba >> 16) & 0xffu) / 255.0f));
}

vec3 face_color(FaceRecord face, FrameInstance instance)
{
    uint rgba = instance.color_rgba >> 24 != 0u ? instance.color_rgba : kDefaultColor;
    if ((face.flags & kFaceHasColor) != 0u)
        rgba = face.color_rgba;
    return linear_color(rgba);
}
