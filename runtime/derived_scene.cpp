#include "runtime/derived_scene.h"

#include "format/derive.h"
#include "runtime/cpu_view.h"

#include <functional>

namespace trimray {
namespace {

std::shared_ptr<const Scene> changed(const Scene& scene, const std::function<void(PackImage&)>& change)
{
    auto copy = std::make_shared<Scene>();
    PackImage& image = copy->pack.image;
    image = scene.pack.image;
    change(image);
    copy->prepared = std::make_shared<CpuScene>(image);
    return copy;
}

} // namespace

std::shared_ptr<const Scene> with_leaves(const Scene& scene, const LeafOptions& options)
{
    return changed(scene, [&](PackImage& image) {
        image.leaf_options = options;
        derive_leaves(image, options);
        derive_trees(image);
    });
}

std::shared_ptr<const Scene> with_leaf_budget(const Scene& scene, uint32_t most_leaves)
{
    LeafOptions options = scene.pack.image.leaf_options;
    options.max_leaves_per_patch = most_leaves;
    return with_leaves(scene, options);
}

std::shared_ptr<const Scene> with_textures(const Scene& scene, const TrimTextureOptions& textures, double bytes)
{
    return changed(scene, [&](PackImage& image) {
        allocate_trim_memory(image, bytes, textures);
        derive_sdf(image);
    });
}

} // namespace trimray
