// Stands in for the Vulkan tracer in a build with TRIMRAY_VULKAN off.
#include "runtime/tracer.h"

namespace trimray {

Result<std::unique_ptr<Tracer>> make_vulkan_tracer(std::shared_ptr<const Scene>, bool, bool)
{
    return Error{ErrorCode::NoDevice, "Vulkan",
                 "this build has no Vulkan tracer (TRIMRAY_VULKAN=OFF); use --device cpu"};
}

} // namespace trimray
