// trimray-batch: many CAD files in, a folder of packs and a ledger out. `trimray batch` runs it.
#include "format/command_report.h"
#include "preprocess/batch/commands.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <vector>

namespace {

constexpr const char* kFooter =
    "Packs lie in OUTDIR/store under a key of content, options and versions, and under their files' names in\n"
    "OUTDIR/packs. A valid pack under its key is never made again. OUTDIR/ledger says what happened to each file.\n"
    "\nExamples:\n"
    "  trimray batch parts/ -o packs\n"
    "  trimray batch parts/ more.zip 'abc/*.step' -o packs --jobs 8 --timeout 120 --memory-limit 4GiB\n"
    "  trimray batch parts/ -o packs --resume              # after an interruption: only what is left\n"
    "  trimray batch parts/ -o packs --retry crash,timeout # and those again\n"
    "  trimray batch retry packs --timeout 3600            # all that failed, whatever the inputs were\n"
    "  find / -name '*.stp' | trimray batch - -o packs\n"
    "  trimray batch parts/ -o /shared/packs --shard 3/16  # on the fourth of sixteen machines\n"
    "\nExit codes: 0 every file done, 1 usage, 2 the folder cannot be read or written, 6 some files failed or lost\n"
    "faces (named in the ledger; a retry by an engine is of no use), 128 + N stopped by signal N (go on with "
    "--resume).";

} // namespace

int main(int argc, char** argv)
{
    using namespace trimray;
    CLI::App app{"Converts many CAD files into scene packs, each in a process of its own with limits.",
                 "trimray batch"};
    app.footer(kFooter);
    int exit_code = kExitOk;
    register_run(app, {argv, argv + argc}, exit_code);
    register_retry(app, {argv, argv + argc}, exit_code);
    register_plan(app, exit_code);
    register_status(app, exit_code);
    register_report(app, exit_code);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) // --help
            return app.exit(error);
        return report_error({ErrorCode::Usage, "", fmt::format("{}; see --help", error.what())}, kBatchProgram);
    } catch (const std::exception& error) {
        exit_code = report_error({ErrorCode::Internal, "", error.what()}, kBatchProgram);
    }
    if ((std::fflush(stdout) != 0 || std::ferror(stdout) != 0) && exit_code == kExitOk)
        exit_code =
            report_error({ErrorCode::FileNotWritable, "stdout", "cannot be written; is the disk full?"}, kBatchProgram);
    return exit_code;
}
