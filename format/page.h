// Pages that programs write: one file each that works without a network, in light and dark and on paper. Shared here
// because this folder is what converter and runtime both see.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace trimray {

/// A page from its template: @STYLE@ becomes the pages' common style, @TOOLS@ their common functions (page.css,
/// page.js).
std::string page_of(std::string_view page_template);

/// Puts JSON where the page has `place`. "</script>" in a name does not end the script that it is in.
void fill_in(std::string_view place, const nlohmann::ordered_json& json, std::string& page);

/// A PNG as a page holds it (RFC 2397, RFC 4648).
std::string data_uri(std::span<const std::byte> png);

} // namespace trimray
