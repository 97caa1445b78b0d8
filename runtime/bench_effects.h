// Measures on one pack what each effect costs alone, beside the picture that asks for none.
#pragma once

#include "format/result.h"
#include "runtime/tracer.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace trimray {

/// A picture with one effect.
struct EffectFigures {
    std::string effect;      // one of effect_names()
    std::string unsupported; // why this tracer has it not; then all below is empty
    // Median over the rounds of the tracer's own time; on the CPU with one thread, of processor time. 0 without rounds
    double frame_ms = 0;
    // Median over the rounds of the frame's time over that of "none" in the same round; 0 without either
    double time_to_none = 0;
    uint64_t differing_pixels = 0; // from "none", if that is measured before
    RenderStats stats;             // of one frame by a tracer that has made no other picture
};

struct EffectsReport {
    std::string device;
    Camera camera; // parallel rays aside
    std::vector<EffectFigures> figures;
};

struct EffectsBenchOptions {
    uint32_t width = 320, height = 180;
    uint32_t rounds = 5; // 0: each picture is made once, and nothing is timed
    uint32_t threads = 1;
    std::string device = "cpu";
    std::string instruction_set;      // of the CPU tracer
    std::vector<std::string> effects; // empty: all
};

/// "none", then one name for each effect, and last "unspecialised": "none" with RenderOptions::specialise off.
std::vector<std::string> effect_names();

/// The model framed from iso. Each effect has a tracer to itself; frames are timed in turns (bench_turns.h),
/// each after one untimed.
/// `progress` is told what is being done. Fails: as make_tracer and Tracer::render, but for effects that the tracer
/// has not; Usage (no such effect).
Result<EffectsReport> bench_effects(const std::shared_ptr<const Scene>& scene, const EffectsBenchOptions& options,
                                    const std::function<void(const std::string&)>& progress);

} // namespace trimray
