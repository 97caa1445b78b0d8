// What the leak checker must know of Vulkan. Include it once in a test program.
#pragma once

#include <dlfcn.h>

#ifdef __SANITIZE_ADDRESS__
/// The validation layer keeps its own records of devices that are gone.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions()
{
    return "leak:libVkLayer_khronos_validation.so\n";
}
#endif

namespace trimray {

/// Keeps the driver and the layer in memory: the checker cannot name what an unloaded library has left behind.
inline void keep_vulkan_loaded()
{
    dlopen("libvulkan_lvp.so", RTLD_NOW | RTLD_NODELETE);
    dlopen("libVkLayer_khronos_validation.so", RTLD_NOW | RTLD_NODELETE);
}

} // namespace trimray
