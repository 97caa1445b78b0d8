#include "preprocess/batch/convert_file.h"

#include "format/pack_reader.h"

#include <algorithm>
#include <cstdlib>
#include <fmt/format.h>
#include <optional>
#include <xxhash.h>

namespace trimray {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr size_t kMostNamed = 100; // dropped faces and warnings in the ledger; the pack and `trimray pack` have all

std::string json_text(const Json& json)
{
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json first_of(const Json& list)
{
    Json first = Json::array();
    for (size_t i = 0; i < std::min(list.size(), kMostNamed); ++i)
        first.push_back(list[i]);
    return first;
}

/// A pack that is there: valid, every byte. Otherwise nothing, and what is wrong with it.
std::optional<Json> found_pack(const fs::path& path, std::vector<std::string>& warnings)
{
    std::error_code failed;
    if (!fs::exists(path, failed))
        return std::nullopt;
    const Result<LoadedPack> pack = read_pack(path.string(), {});
    if (!pack) {
        warnings.push_back(fmt::format("the pack that was there was damaged and is made again: {}: {}",
                                       pack.error().where, pack.error().detail));
        return std::nullopt;
    }
    const PackImage& image = pack->image;
    Json dropped = Json::array();
    for (const DroppedFace& face : image.dropped)
        dropped.push_back(
            {{"face", face.face_in_part}, {"part", face.part}, {"reason", image.strings.strings[face.reason]}});
    return Json{{"found", true},
                {"pack_bytes", pack->file_bytes},
                {"faces", image.faces.size() + image.dropped.size()},
                {"converted", image.faces.size()},
                {"dropped_faces", image.dropped.size()},
                {"dropped", first_of(dropped)}};
}

Json made_pack(const Json& report)
{
    Json made = {{"found", false},
                 {"pack_bytes", report["bytes"]},
                 {"faces", report["faces"]},
                 {"converted", report["converted"]},
                 {"dropped_faces", report["dropped"].size()},
                 {"dropped", first_of(report["dropped"])},
                 {"seconds", report["seconds"]}};
    return made;
}

} // namespace

std::string pack_key(const std::string& content_hash, const std::string& basis)
{
    const std::string text = "trimray pack key 1\n" + content_hash + '\n' + basis;
    const XXH128_hash_t hash = XXH3_128bits(text.data(), text.size());
    return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

Result<std::string> convert_file(const FileJob& job, const Store& store, const std::string& basis,
                                 const PackMaker& make, const WorkerReport& report)
{
    setenv("TMPDIR", job.scratch.c_str(), 1); // whatever is left of this process lies there
    report("open", -1);
    const Result<SourceFile> source = SourceFile::open(job.file.path);
    if (!source)
        return source.error();
    const std::string key = pack_key(source->content_hash, basis);
    report.note(key);

    const fs::path pack = store.pack_path(key);
    std::vector<std::string> warnings;
    std::optional<Json> outcome = found_pack(pack, warnings);
    std::optional<FileLock> claim;
    if (!outcome) {
        claim = FileLock::take(store.claim_path(key));
        if (!claim && is_locked(store.claim_path(key)))
            return json_text({{"busy", true}});
        warnings.clear();
        outcome = found_pack(pack, warnings); // made between the look and the claim
    }
    if (!outcome) {
        const fs::path scratch_pack = job.scratch / "pack.tray";
        const Result<Json> made = make(*source, job.file.path, scratch_pack.string(), job.other_healing, report);
        if (!made)
            return made.error();
        if (const Status published = store.publish(scratch_pack, key); !published)
            return published.error();
        outcome = made_pack(*made);
        for (const Json& warning : first_of((*made)["warnings"]))
            warnings.push_back(warning.get<std::string>());
    }
    if (claim)
        claim->remove_file();
    if (const Status linked = store.link(job.file.name, key); !linked)
        warnings.push_back(fmt::format("{}: {}", linked.error().where, linked.error().detail));
    (*outcome)["source_bytes"] = source->bytes;
    (*outcome)["source_hash"] = source->hash;
    (*outcome)["warnings"] = warnings;
    return json_text(*outcome);
}

} // namespace trimray
