// Where points of the pixels' rays are in the top tree's units.

vec3 place_along(vec2 pixel)
{
    return vector(places.along) + pixel.x * vector(places.along_x) + pixel.y * vector(places.along_y);
}
vec3 place_at(vec2 pixel, float past)
{
    return vector(places.place) + pixel.x * vector(places.place_x) + pixel.y * vector(places.place_y) +
           past * place_along(pixel);
}
// A pixel's width there
float place_width(float past)
{
    return abs(past + places.tau_ref) * places.pixel;
}
