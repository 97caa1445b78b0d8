// trimray-measure: `trimray bench accuracy` and `bench speed` run it, as `trimray-measure accuracy` and `... speed`.
#include "format/command_report.h"
#include "format/shell_word.h"
#include "runtime/measure/commands.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <string>

namespace {
using namespace trimray;

std::string command_line(int argc, char** argv)
{
    std::string line = "trimray bench";
    for (int i = 1; i < argc; ++i)
        line += ' ' + shell_word(argv[i]);
    return line;
}

} // namespace

int main(int argc, char** argv)
{
    CLI::App app{"Trimray measured beside its peers", "trimray bench"};
    app.require_subcommand(1);
    int exit_code = kExitOk;
    register_accuracy(app, command_line(argc, argv), exit_code);
    register_speed(app, exit_code);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) // --help
            return app.exit(error);
        const std::string command = argc > 1 && app.got_subcommand(argv[1]) ? std::string(" ") + argv[1] : "";
        return report_error({ErrorCode::Usage, "bench" + command, fmt::format("{}; see --help", error.what())});
    } catch (const std::bad_alloc&) {
        return report_error({ErrorCode::Internal, "", "out of memory; ask for smaller pictures"});
    } catch (const std::exception& error) {
        return report_error({ErrorCode::Internal, "", error.what()});
    }
    return exit_code;
}
