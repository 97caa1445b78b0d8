// The body of volk, compiled once: it finds libvulkan at run time, so nothing links it and a machine without it still
// starts.
#include <volk.c>
