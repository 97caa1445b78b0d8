// What a first picture is drawn from while the model itself is still being read, or its tracer is not ready: the pack's
// proxy, and where its parts are placed.
#pragma once

#include "format/load_watch.h"
#include "format/proxy.h"

#include <string>

namespace trimray {

struct EarlyModel {
    std::string file;
    PackImage outline; // as LoadWatch tells it, without the proxy's bytes
    ProxyMesh mesh;    // of the outline's faces
};

} // namespace trimray
