// The commands of trimray-batch. Each adds itself to the parser, and leaves its exit code when it has run.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
} // namespace CLI

namespace trimray {

inline constexpr const char* kBatchProgram = "trimray batch";

/// `trimray batch INPUTS -o OUTDIR`; `words` is the whole command line, for the ledger.
void register_run(CLI::App& app, const std::vector<std::string>& words, int& exit_code);
/// `retry`: what failed or was begun again, from the ledger alone; `words` as above.
void register_retry(CLI::App& app, const std::vector<std::string>& words, int& exit_code);
/// `plan`: lists of files of equal size, one a shard.
void register_plan(CLI::App& app, int& exit_code);
/// `status`: what became of the files, and who is at work.
void register_status(CLI::App& app, int& exit_code);
/// `report`: why files failed, and how long conversions took, as text, JSON and a page.
void register_report(CLI::App& app, int& exit_code);

} // namespace trimray
