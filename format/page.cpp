#include "format/page.h"

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>

namespace trimray {
namespace {

const char kStyle[] =
#include "page.css.inc"
    ;
const char kTools[] =
#include "page.js.inc"
    ;

void replace(std::string_view place, std::string_view text, std::string& page)
{
    if (const size_t at = page.find(place); at != std::string::npos)
        page.replace(at, place.size(), text);
}

} // namespace

std::string page_of(std::string_view page_template)
{
    std::string page(page_template);
    replace("@STYLE@", kStyle, page);
    replace("@TOOLS@", kTools, page);
    return page;
}

void fill_in(std::string_view place, const nlohmann::ordered_json& json, std::string& page)
{
    std::string text;
    for (const char c : json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace))
        text += c == '<' ? std::string("\\u003c") : std::string(1, c);
    replace(place, text, page);
}

std::string data_uri(std::span<const std::byte> png)
{
    constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string uri = "data:image/png;base64,";
    for (size_t i = 0; i < png.size(); i += 3) {
        const size_t count = std::min<size_t>(3, png.size() - i);
        uint32_t word = 0;
        for (size_t k = 0; k < 3; ++k)
            word = word << 8 | (k < count ? uint32_t(png[i + k]) : 0);
        for (size_t k = 0; k < 4; ++k)
            uri += k <= count ? kDigits[word >> (18 - 6 * k) & 63] : '=';
    }
    return uri;
}

} // namespace trimray
