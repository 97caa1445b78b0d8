// Placements that a scene hides, shows alone or moves apart (SceneLook::arrangement): made anew with a tree of their
// own before a picture is traced, so that tracing knows nothing of it and what is hidden costs nothing.
#pragma once

#include "format/derive.h"
#include "format/result.h"
#include "runtime/placement_view.h"
#include "runtime/scene_look.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace trimray {

struct ArrangedPlacements {
    std::span<const PartRecord> parts;     // the pack's
    std::vector<InstanceRecord> instances; // all of the pack's; those that are visible where they are moved to
    std::vector<uint8_t> visible;          // by instance
    TopTree tree;
    std::vector<std::string> unmatched; // names that are nothing's, as the scene has them

    PlacementView view() const;
    size_t size_bytes() const;
};

/// The pack's placements as `wanted` says; the pack must outlive them. A name means every placement that has it or
/// whose part has it; "#N" those of part N, "@N" placement N. With `explode` the middle m of each placement (that of
/// its part's box along the part's axes) goes to c + (1 + explode) (m - c), c the middle of the pack's bounds. Fails:
/// InvalidScene ("#..." or "@..." that is no number of the pack's and no name), Usage (explode is negative or not
/// finite).
Result<ArrangedPlacements> arrange(const PackImage& image, const Arrangement& wanted);

/// What is placed in one picture after another, arranged anew only where the wish has changed.
class KeptArrangement {
public:
    /// Returns whether it differs from that of the call before; before the first it is the pack's own. Fails: as
    /// arrange, and then stays as it was.
    Result<bool> change_to(const PackImage& image, const Arrangement& wanted);

    PlacementView view(const PackImage& image) const { return arranged_ ? arranged_->view() : PlacementView(image); }
    /// Null: the pack's own.
    const ArrangedPlacements* arranged() const { return arranged_ ? &*arranged_ : nullptr; }
    /// Beside the pack's own.
    size_t size_bytes() const { return arranged_ ? arranged_->size_bytes() : 0; }

private:
    Arrangement wanted_;
    std::optional<ArrangedPlacements> arranged_; // none: the pack's own
};

} // namespace trimray
