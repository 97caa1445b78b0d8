// What tools that measure packs of a corpus are asked alike.
#pragma once

#include <CLI/CLI.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace trimray {

struct PackRequest {
    std::vector<std::string> packs, views{"iso", "front", "top"}, devices{"cpu"};
    size_t listed = 5; // pixels, in each line

    /// `listed_help`: which pixels are listed.
    void add_options(CLI::App& app, const std::string& listed_help)
    {
        app.add_option("PACK", packs, "Scene packs (.tray)")->required();
        app.add_option("--views", views, "Of the whole model: iso, front, ...")->delimiter(',');
        app.add_option("--devices", devices, "cpu, vulkan (software drivers too)")
            ->delimiter(',')
            ->check(CLI::IsMember({"cpu", "vulkan"}));
        app.add_option("--listed", listed, listed_help)->capture_default_str();
    }
};

} // namespace trimray
