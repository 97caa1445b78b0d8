// CAD files as packs and meshes, made by trimray-pack in processes of their own.
#pragma once

#include "format/result.h"
#include "runtime/command_json.h"

#include <functional>
#include <string>
#include <vector>

namespace trimray {

/// Whether the file is a CAD model by its name: anything but a pack (.tray).
bool is_cad_file(const std::string& path);

/// A folder for files of this process alone, removed with all that is in it when this object goes.
class ScratchFolder {
public:
    /// In the system's temporary folder. Fails: FileNotWritable.
    static Result<ScratchFolder> make();
    ScratchFolder(ScratchFolder&& other) noexcept;
    ScratchFolder& operator=(ScratchFolder&&) = delete;
    ~ScratchFolder();

    std::string file(const std::string& name) const { return path_ + '/' + name; }

private:
    explicit ScratchFolder(std::string path) : path_(std::move(path)) {}
    std::string path_; // empty: moved from
};

/// Watches a conversion; both are called by the thread that waits for it, and may be empty.
struct ConverterWatch {
    std::function<void(const std::string& phase, double share)> progress; // share in [0, 1], negative where unknown
    std::function<bool()> cancelled; // asked some times a second; true ends the conversion, which leaves nothing behind
};

/// Runs `trimray-pack MODEL -o OUTPUT OPTIONS --json` and gives what it reports, also of a model that is not whole then
/// (losses). Fails: UnsupportedFormat (there is no such program, or no such format); Interrupted (cancelled); as its
/// exit code says, with its last words.
Result<Json> run_converter(const std::string& model, const std::string& output, const std::vector<std::string>& options,
                           const ConverterWatch& watch = {});

/// That faces were dropped, with what is told of the first of them, for people. Domain: count > 0.
std::string missing_faces(size_t count, size_t part, size_t face, const std::string& reason);

/// What a report of trimray-pack says is not there, or doubtful: faces dropped, faces without triangles, its warnings.
std::vector<std::string> losses(const Json& report);

} // namespace trimray
