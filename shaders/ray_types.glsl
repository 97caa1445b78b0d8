// What a ray is to trees, patches and leaves, and what it has met.

// A ray for one tree: the point at tau = anchor, and the direction
struct TreeRay {
    vec3 origin;
    vec3 inverse;
    float anchor;
};

// A point at t is origin + t * direction in patch space; t counts tau: mm, or lengths of a free ray.
struct PatchRay {
    vec3 origin;
    vec3 direction;
    float anchor; // tau at t = 0
    float past;   // anchor - view.tau_ref; free rays: anchor
    float slack;  // rounding of a hit's `past`
    float pixel;  // width of a pixel at tau = 1, patch units
    float width;  // ... where the patch is
};

// The nearest hit so far. `past` is tau - view.tau_ref, so that what is far from the eye keeps its digits.
struct Hit {
    float past; // kHuge: none yet
    float t;    // along the patch's ray
    vec2 uv_face;
    vec2 uv_patch;
    uint leaf;
    uint instance;
    float doubt; // from where on a leaf may hold hits that were not found, as `past`; kHuge: there is none
    bool back;   // it may be a rim's
    bool own;    // it lies in its leaf, not beside it
    float slack; // rounding of `past`
};
