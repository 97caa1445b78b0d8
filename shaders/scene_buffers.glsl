// The pack's arrays as the shader sees them, and the fetch_* functions through which shaders/shared reads them.
layout(scalar, set = 0, binding = kBindInstances) readonly buffer Instances { FrameInstance instances[]; };
layout(scalar, set = 0, binding = kBindTopNodes) readonly buffer TopNodes { BvhNode top_nodes[]; };
layout(scalar, set = 0, binding = kBindPartNodes) readonly buffer PartNodes { BvhNode part_nodes[]; };
layout(scalar, set = 0, binding = kBindLeaves) readonly buffer Leaves { LeafRecord leaves[]; };
layout(scalar, set = 0, binding = kBindPatches) readonly buffer Patches { PatchRecord patches[]; };
layout(scalar, set = 0, binding = kBindControlPoints) readonly buffer ControlPoints { float control_points[]; };
layout(scalar, set = 0, binding = kBindFaces) readonly buffer Faces { FaceRecord faces[]; };
layout(scalar, set = 0, binding = kBindCells) readonly buffer Cells { uint cells[]; };
layout(scalar, set = 0, binding = kBindCellEntries) readonly buffer CellEntries { CellEntry cell_entries[]; };
layout(scalar, set = 0, binding = kBindTrimPoints) readonly buffer TrimPoints { vec2 trim_points[]; };
layout(scalar, set = 0, binding = kBindSdfWords) readonly buffer SdfWords { uint sdf_words[]; };
layout(scalar, set = 0, binding = kBindPixels) buffer Pixels { FramePixel pixels[]; };
layout(scalar, set = 0, binding = kBindCounts) buffer Counts { uint counts[]; };
layout(scalar, set = 0, binding = kBindRetries) readonly buffer Retries { uint retries[]; };
layout(scalar, set = 0, binding = kBindBorders) readonly buffer Borders { uint border_words[]; };
layout(scalar, set = 0, binding = kBindEdges) writeonly buffer Edges { uvec2 edges[]; };
layout(scalar, set = 0, binding = kBindKdNodes) readonly buffer KdNodes { KdNode kd_nodes[]; };
layout(scalar, set = 0, binding = kBindKdRuns) readonly buffer KdRuns { KdRun kd_runs[]; };
layout(scalar, set = 0, binding = kBindKdPoints) readonly buffer KdPoints { vec2 kd_points[]; };
layout(scalar, set = 0, binding = kBindKdFaces) readonly buffer KdFaces { KdFace kd_faces[]; };
layout(scalar, set = 0, binding = kBindKept) buffer KeptHits { KeptHit kept_hits[]; };
layout(scalar, set = 0, binding = kBindLastHits) readonly buffer LastHits { LastHit last_hits[]; };
layout(scalar, set = 0, binding = kBindNextHits) writeonly buffer NextHits { LastHit next_hits[]; };
layout(scalar, set = 0, binding = kBindLook) readonly buffer Look
{
    PlaceView places;
    SectionView section;
    MapView map_view;
    LightView light_view;
    LightRecord light_records[kMostLights];
    vec2 light_samples[];
};
layout(scalar, set = 0, binding = kBindToPart) readonly buffer ToPart { WorldToPart to_part[]; };
layout(scalar, set = 0, binding = kBindLitPixels) buffer LitPixels { LitPixel lit_pixels[]; };
layout(scalar, set = 0, binding = kBindStopped) buffer Stopped
{
    uint stopped_count;
    uint stopped[];
};
layout(scalar, set = 0, binding = kBindCaps) buffer Caps { CapState caps[]; };
layout(scalar, set = 0, binding = kBindMapValues) writeonly buffer MapValues { float map_values[]; };
layout(scalar, set = 0, binding = kBindMaterials) readonly buffer Materials { uint material_words[]; };
layout(scalar, set = 0, binding = kBindEnvironment) readonly buffer EnvironmentMap
{
    uint environment_width;
    uint environment_height;
    float environment_rgb[];
};
layout(scalar, set = 0, binding = kBindPaths) buffer Paths { PathState paths[]; };
layout(scalar, push_constant) uniform View { FrameView view; };

// Specialised to what the pack holds and the frame asks for: what is false here costs no instruction.
layout(constant_id = kSpecTrimMode) const uint trim_mode = 0u;
layout(constant_id = kSpecKinds) const uint kinds = 0x3fu;
layout(constant_id = kSpecFeatures) const uint features = 0x1ffu;
layout(constant_id = kSpecStackSize) const uint stack_size = 290u; // 2 trees of kMaxBvhDepth, 3 waiting children a node
layout(constant_id = kSpecLocalFloats) const uint local_floats = 1u;
layout(constant_id = kSpecIterationLimit) const uint iteration_limit = 0u;
layout(constant_id = kSpecMap) const uint surface_map = kMapNone;
layout(constant_id = kSpecDegreeU) const uint common_degree_u = 0u;
layout(constant_id = kSpecDegreeV) const uint common_degree_v = 0u;
layout(constant_id = kSpecLargestDegree) const uint largest_degree = kMaxDegree;

// A patch's control points copied beside the invocation, where the driver reads buffers slowly
const uint local_size = local_floats > 0u ? local_floats : 1u;
float local_points[local_size];
uint local_first = 0u;

float fetch_control(uint at)
{
    if (local_floats > 0u)
        return local_points[at - local_first];
    return control_points[at];
}
uint fetch_cell(uint at) { return cells[at]; }
uint fetch_entry_word(uint at) { return cell_entries[at].word; }
float fetch_entry_eta(uint at) { return cell_entries[at].eta; }
vec2 fetch_trim_point(uint at) { return trim_points[at]; }
vec2 fetch_kd_point(uint at) { return kd_points[at]; }
// Word `index` of the texture that begins at first_word
uint fetch_sdf_word(uint first_word, uint index) { return sdf_words[first_word + index]; }
// Byte `at` of the texture that begins at first_word, and in the next 8 bits the byte after it
uint fetch_sdf_pair(uint first_word, uint at)
{
    uint next = at + 1u;
    uint low = sdf_words[first_word + (at >> 2)] >> ((at & 3u) << 3) & 0xffu;
    return low | (sdf_words[first_word + (next >> 2)] >> ((next & 3u) << 3) & 0xffu) << 8;
}

vec3 vector(float v[3]) { return vec3(v[0], v[1], v[2]); }
bool has_kind(uint kind) { return (kinds & (1u << kind)) != 0u; }
// A program for every scene reads from the view what others are specialised to (RenderOptions::specialise).
bool decides_late() { return (features & kFeatureLate) != 0u; }
bool has_feature(uint feature) { return ((decides_late() ? features | view.first_sample : features) & feature) != 0u; }
uint drawn_map() { return decides_late() ? view.end_sample & 0xffu : surface_map; }
uint trims_by() { return decides_late() ? view.end_sample >> 8 : trim_mode; }

// Work of this invocation. `iterations` bounds the loop iterations of the leaf at hand from above.
uint node_visits = 0u;
uint leaf_visits = 0u;
uint newton_steps = 0u;
uint curve_tests = 0u;
uint edge_tests = 0u;
uint iterations = 0u;
