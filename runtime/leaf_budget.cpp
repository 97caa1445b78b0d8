#include "runtime/leaf_budget.h"

#include "format/derive.h"
#include "runtime/cpu_view.h"

namespace trimray {

std::shared_ptr<const Scene> with_leaf_budget(const Scene& scene, uint32_t most_leaves)
{
    auto copy = std::make_shared<Scene>();
    PackImage& image = copy->pack.image;
    image = scene.pack.image;
    image.leaf_options.max_leaves_per_patch = most_leaves;
    derive_leaves(image, LeafOptions(image.leaf_options));
    derive_trees(image);
    copy->prepared = std::make_shared<CpuScene>(image);
    return copy;
}

} // namespace trimray
