// Reading a pack while somebody waits for it: the reading can be given up, and tells of the pack's outline, from which
// a first picture can be drawn, before the rest is decoded.
#pragma once

#include "format/pack_reader.h"

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace trimray {

struct LoadWatch {
    // Asked by any thread, every few milliseconds of work; once it says true it goes on saying so, and reading fails:
    // Interrupted
    std::function<bool()> cancelled;
    // Told once, by the reading thread, of a pack that has a proxy and stores its trees: all but control points, trims,
    // cells, textures and previews, checked as a whole pack is, so that what lies where can be asked of it. proxy_draco
    // are the bytes as they are, for decode_proxy to judge. What comes after may still be found invalid
    std::function<void(PackImage outline)> on_outline;

    bool is_cancelled() const { return cancelled && cancelled(); }
};

/// As read_pack and decode_pack, in another order of sections: where several are at fault, another may be named.
/// Fails: as they do; Interrupted.
Result<LoadedPack> read_pack(const std::string& path, const ReadOptions& options, const LoadWatch& watch);
Result<LoadedPack> decode_pack(std::span<const std::byte> bytes, const ReadOptions& options, const LoadWatch& watch);

/// As validate_image of an image that was given up in between: what was found until then.
std::vector<Finding> validate_image(const PackImage& image, const std::function<bool()>& cancelled);

/// Whether what LoadWatch::on_outline is told of passes the checks of a whole pack.
bool is_valid_outline(const PackImage& image, const std::function<bool()>& cancelled);

} // namespace trimray
