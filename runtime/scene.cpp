#include "runtime/cpu_view.h"
#include "runtime/tracer.h"

#include <utility>

namespace trimray {

Result<std::shared_ptr<const Scene>> load_scene(const std::string& path, bool previews_and_proxy)
{
    ReadOptions options;
    options.previews_and_proxy = previews_and_proxy;
    Result<LoadedPack> pack = read_pack(path, options);
    if (!pack.ok())
        return pack.error();
    auto scene = std::make_shared<Scene>();
    scene->pack = std::move(*pack);
    scene->prepared = std::make_shared<CpuScene>(scene->pack.image);
    return std::shared_ptr<const Scene>(std::move(scene));
}

} // namespace trimray
