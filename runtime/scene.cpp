#include "runtime/cpu_view.h"
#include "runtime/tracer.h"
#include "runtime/watched_load.h"

#include <utility>

namespace trimray {
namespace {

Result<std::shared_ptr<const Scene>> load(const std::string& path, bool previews_and_proxy, const LoadWatch& watch)
{
    ReadOptions options;
    options.previews_and_proxy = previews_and_proxy;
    Result<LoadedPack> pack = read_pack(path, options, watch);
    if (!pack.ok())
        return pack.error();
    auto scene = std::make_shared<Scene>();
    scene->pack = std::move(*pack);
    scene->prepared = std::make_shared<CpuScene>(scene->pack.image);
    return std::shared_ptr<const Scene>(std::move(scene));
}

} // namespace

Result<std::shared_ptr<const Scene>> load_scene(const std::string& path, bool previews_and_proxy)
{
    return load(path, previews_and_proxy, LoadWatch{});
}

Result<std::shared_ptr<const Scene>> load_scene(const std::string& path, const LoadWatch& watch)
{
    return load(path, false, watch);
}

} // namespace trimray
