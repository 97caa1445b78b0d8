// The points of an accuracy report: the values of each dial, alone and together.
#pragma once

#include "format/pack_image.h"
#include "runtime/bench_trims.h"
#include "runtime/tracer.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace trimray {

/// One way to make the picture: what it changes of the defaults.
struct AccuracySetting {
    std::string dial;                                       // "default", "error-px", "leaves", "closest", "trims",
                                                            // "precision", "together" or "anti-aliasing"
    std::string name;                                       // unique in a report, for people: "error-px 0.1"
    std::function<void(RenderOptions&)> ask = [](auto&) {}; // of the tracer
    std::function<void(LeafOptions&)> cut;                  // leaves are cut anew; null: the pack's
    std::optional<TrimSetting> trims;                       // none: exact
    bool in_double = false;                                 // by the reference instead of the device's tracer
    uint32_t samples = 1;                                   // a pixel, squared
    std::string paper;                                      // Contender::paper
    bool smooth = false;                                    // Contender::smooth
};

/// The default, alone, first. `quick`: fewer values a dial.
std::vector<AccuracySetting> accuracy_settings(bool quick);

} // namespace trimray
