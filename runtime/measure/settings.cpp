#include "runtime/measure/settings.h"

#include "runtime/trim_mode.h"

#include <fmt/format.h>

#include <utility>

namespace trimray {
namespace {

using Settings = std::vector<AccuracySetting>;

AccuracySetting named(const char* dial, std::string name)
{
    AccuracySetting setting;
    setting.dial = dial;
    setting.name = std::move(name);
    return setting;
}

void add_error_px(bool quick, Settings& settings)
{
    for (const float error_px :
         quick ? std::vector{1.0f, 0.1f, 1e-3f} : std::vector{1.0f, 0.3f, 0.1f, 0.05f, 5e-3f, 1e-3f, 1e-4f}) {
        settings.push_back(named("error-px", fmt::format("error-px {:g}", error_px)));
        settings.back().ask = [error_px](RenderOptions& options) { options.error_px = error_px; };
    }
}

void add_leaves(bool quick, Settings& settings)
{
    for (const float slope_deg : quick ? std::vector{20.0f, 60.0f} : std::vector{15.0f, 20.0f, 45.0f, 60.0f, 90.0f}) {
        settings.push_back(named("leaves", fmt::format("leaf slope {:g}°", slope_deg)));
        settings.back().cut = [slope_deg](LeafOptions& leaves) { leaves.leaf_slope_deg = slope_deg; };
    }
    for (const uint32_t budget : quick ? std::vector{1u} : std::vector{1u, 4u, 16u, 64u}) {
        settings.push_back(named("leaves", fmt::format("{} {} a patch", budget, budget == 1 ? "leaf" : "leaves")));
        settings.back().cut = [budget](LeafOptions& leaves) { leaves.max_leaves_per_patch = budget; };
    }
}

void ask_for_frames(AccuracySetting& setting, uint32_t frames)
{
    setting.ask = [frames](RenderOptions& options) {
        options.closest = ClosestPolicy::Stochastic;
        options.frames = frames;
    };
}

void add_closest(bool quick, Settings& settings)
{
    for (const bool one_leaf : {false, true})
        for (const uint32_t frames : quick ? std::vector{1u, 10u} : std::vector{1u, 2u, 5u, 10u, 20u}) {
            settings.push_back(
                named("closest", fmt::format("stochastic, {} {}{}", frames, frames == 1 ? "frame" : "frames",
                                             one_leaf ? ", one leaf a patch" : "")));
            ask_for_frames(settings.back(), frames);
            if (one_leaf)
                settings.back().cut = [](LeafOptions& leaves) { leaves.max_leaves_per_patch = 1; };
        }
}

std::string trims_name(const TrimSetting& trims)
{
    if (!trims.has_textures())
        return trim_name(trims.mode);
    return fmt::format("{} {}, {}, {:g} %", trim_name(trims.mode),
                       trims.textures.source == TrimSource::Curve ? "of curves" : "of a mask",
                       trims.textures.layout == TrimLayout::Isotropic ? "isotropic" : "square", 100 * trims.memory);
}

void add_trims(bool quick, Settings& settings)
{
    for (const TrimSetting& trims : trim_settings(quick ? std::vector{1.0} : std::vector{0.5, 1.0, 2.0, 4.0})) {
        if (trims.edges || trims.mode == TrimMode::Exact)
            continue;
        settings.push_back(named("trims", trims_name(trims)));
        settings.back().trims = trims;
        if (trims.mode == TrimMode::Sdf && trims.textures.source == TrimSource::Mask &&
            trims.textures.layout == TrimLayout::Square)
            settings.back().paper = fmt::format("textures-{:g}", 100 * trims.memory);
    }
}

// What the dials give together, from the fastest on
void add_together(Settings& settings)
{
    const TrimSetting texture{TrimMode::Sdf, {}, 1, false};
    for (const float error_px : {1.0f, 0.1f}) {
        settings.push_back(
            named("together", fmt::format("error-px {:g}, stochastic, {}", error_px, trims_name(texture))));
        AccuracySetting& setting = settings.back();
        setting.trims = texture;
        setting.ask = [error_px](RenderOptions& options) {
            options.closest = ClosestPolicy::Stochastic;
            options.error_px = error_px;
        };
    }
    settings.push_back(named("together", "error-px 0.0001, leaf slope 15°"));
    settings.back().ask = [](RenderOptions& options) { options.error_px = 1e-4f; };
    settings.back().cut = [](LeafOptions& leaves) { leaves.leaf_slope_deg = 15; };
}

// One sample a pixel is the default once more, for these pictures are held against another one than the others
void add_antialiasing(bool quick, Settings& settings)
{
    const auto add = [&](std::string name) -> AccuracySetting& {
        settings.push_back(named("anti-aliasing", std::move(name)));
        settings.back().smooth = true;
        return settings.back();
    };
    for (const uint32_t samples : quick ? std::vector{1u, 2u} : std::vector{1u, 2u, 3u, 4u})
        add(samples == 1 ? "one sample" : fmt::format("{0} × {0} samples", samples)).samples = samples;
    add("one sample, trims smoothed").ask = [](RenderOptions& options) { options.antialias_trims = true; };
}

} // namespace

std::vector<AccuracySetting> accuracy_settings(bool quick)
{
    Settings settings;
    settings.push_back(named("default", "default"));
    add_error_px(quick, settings);
    add_leaves(quick, settings);
    add_closest(quick, settings);
    add_trims(quick, settings);
    add_together(settings);
    settings.push_back(named("precision", "double"));
    settings.back().in_double = true;
    add_antialiasing(quick, settings);
    return settings;
}

} // namespace trimray
