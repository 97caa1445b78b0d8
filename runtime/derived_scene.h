// A pack's scene with sections made anew by other options, as a pack of those options would have them: for measuring
// what the options are worth. The converter's own code makes them (format/derive.h).
#pragma once

#include "format/pack_image.h"
#include "runtime/tracer.h"

#include <cstdint>
#include <memory>

namespace trimray {

/// Leaves and trees made anew.
std::shared_ptr<const Scene> with_leaves(const Scene& scene, const LeafOptions& options);

/// With leaves cut by the pack's own options, but at most so many a patch: 1 is the paper's.
std::shared_ptr<const Scene> with_leaf_budget(const Scene& scene, uint32_t most_leaves);

/// With distance textures of about so many bytes in all.
std::shared_ptr<const Scene> with_textures(const Scene& scene, const TrimTextureOptions& textures, double bytes);

} // namespace trimray
