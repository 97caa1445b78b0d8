#include "runtime/view/state_json.h"

#include "format/pack_writer.h"
#include "format/read_file.h"

#include <fmt/format.h>

#include <cstddef>
#include <span>
#include <vector>

namespace trimray {

Result<Json> read_state_json(const std::string& file)
{
    const Result<std::vector<std::byte>> bytes = read_file(file);
    if (!bytes.ok() && bytes.error().code == ErrorCode::FileNotFound)
        return Json();
    if (!bytes.ok())
        return bytes.error();
    const auto* const text = reinterpret_cast<const char*>(bytes->data());
    Json json = Json::parse(text, text + bytes->size(), nullptr, false);
    if (json.is_discarded())
        return not_state(file, "it is not JSON");
    return json;
}

Error not_state(const std::string& file, const std::string& why)
{
    return {ErrorCode::InvalidScene, file, fmt::format("{}; remove it, and it is begun anew", why)};
}

std::string state_text(const Json& json)
{
    return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

Status write_state_json(const std::string& file, const Json& json)
{
    const std::string text = state_text(json);
    const auto bytes = std::as_bytes(std::span(text));
    return write_file_atomically(file, {bytes.begin(), bytes.end()}, Durability::Unsynced);
}

} // namespace trimray
