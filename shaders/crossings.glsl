// All surfaces that a free ray crosses: leaf_hit.glsl hands them over where TRIMRAY_COLLECTS is defined.

float crossing_at[kMostCrossings];
uint crossing_what[kMostCrossings]; // instance << 1 | kCrossingLeaves
uint crossing_leaf[kMostCrossings];
uint crossing_count = 0u;
bool crossings_lost = false; // there were more than are kept

// Two hits of one instance that both enter or both leave within the face's tolerance are one: faces overlap there.
void collect_crossing(float at, float slack, bool leaves_it, float tolerance_mm, uint leaf, uint instance)
{
    uint what = instance << 1 | (leaves_it ? kCrossingLeaves : 0u);
    float apart = 4.0f * slack + tolerance_mm * places.per_mm;
    for (uint i = 0u; i < crossing_count; ++i)
        if (crossing_what[i] == what && abs(crossing_at[i] - at) <= apart)
            return;
    iterations += crossing_count;
    if (crossing_count == kMostCrossings) {
        crossings_lost = true;
        return;
    }
    crossing_at[crossing_count] = at;
    crossing_what[crossing_count] = what;
    crossing_leaf[crossing_count] = leaf;
    ++crossing_count;
}

// How many more surfaces are left than entered; of one instance, or of all
int crossings_out(bool of_all, uint instance)
{
    int depth = 0;
    for (uint i = 0u; i < crossing_count; ++i)
        if (of_all || crossing_what[i] >> 1 == instance)
            depth += (crossing_what[i] & kCrossingLeaves) != 0u ? 1 : -1;
    return depth;
}
