// Loading a scene while somebody waits for it (format/load_watch.h).
#pragma once

#include "format/load_watch.h"
#include "runtime/tracer.h"

#include <memory>
#include <string>

namespace trimray {

/// As load_scene without previews and proxy. Fails: as it does; Interrupted.
Result<std::shared_ptr<const Scene>> load_scene(const std::string& path, const LoadWatch& watch);

} // namespace trimray
