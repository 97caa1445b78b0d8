// The options of a conversion, as `trimray pack` and `trimray batch` take them.
#pragma once

#include "format/result.h"
#include "preprocess/build_pack.h"
#include "preprocess/import/cad_import.h"
#include "preprocess/worker/worker.h"

#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
} // namespace CLI

namespace trimray {

struct PackOptions {
    ImportOptions import;
    BuildOptions build;
    bool previews = true;
};

/// The words of a command line, before they are understood.
struct PackWords {
    PackOptions options; // those that need no second look
    std::string surfaces = "native", source = "curve", layout = "isotropic", trim_memory = "100%";
    bool no_previews = false;
};

/// Adds the options that decide what a pack holds; returns them. `words` lives as long as `app`.
std::vector<CLI::Option*> add_pack_options(CLI::App& app, PackWords& words);

/// Fails: Usage.
Result<PackOptions> understand(const PackWords& words);

/// What was said of such options, to say it again: {"--leaf-budget", "8", "--heal"}.
std::vector<std::string> said_words(const std::vector<CLI::Option*>& options);

/// `base`, but for the options that are also in `over`, and `over`; both as said_words.
std::vector<std::string> overridden_words(const std::vector<std::string>& base, const std::vector<std::string>& over);

/// The other way: what words as said_words mean. Fails: Usage.
Result<PackOptions> understand_words(const std::vector<std::string>& words);

/// The limits of a conversion as words.
struct LimitWords {
    double timeout_seconds = WorkerLimits{}.wall_seconds;
    std::string memory = "auto", disk = "16GiB";
};
void add_limit_options(CLI::App& app, LimitWords& words);
/// `jobs`: conversions at a time, which share the machine's memory. Fails: Usage.
Result<WorkerLimits> understand(const LimitWords& words, int jobs);

/// "8MiB", "4GB", "1048576" -> bytes.
std::optional<double> parse_bytes(const std::string& text);

/// The options that change a pack's content, as JSON, for its provenance.
std::string provenance_options(const PackOptions& options);

} // namespace trimray
