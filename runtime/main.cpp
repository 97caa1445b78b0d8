// trimray: arguments in, a subcommand's exit code out.
#include "format/command_report.h"
#include "format/result.h"
#include "runtime/commands.h"
#include "runtime/nearest_word.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cctype>
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <vector>

namespace {
using namespace trimray;

std::vector<const CLI::App*> commands_of(const CLI::App& app)
{
    return app.get_subcommands([](const CLI::App*) { return true; });
}

const CLI::App* find_command(const CLI::App& app, const std::string& name)
{
    for (const CLI::App* command : commands_of(app))
        if (command->get_name() == name)
            return command;
    return nullptr;
}

std::vector<std::string> command_names(const CLI::App& app)
{
    std::vector<std::string> names;
    for (const CLI::App* command : commands_of(app))
        names.push_back(command->get_name());
    return names;
}

std::vector<std::string> option_names(const CLI::App& command)
{
    std::vector<std::string> names;
    for (const CLI::Option* option : command.get_options())
        for (const std::string& name : option->get_lnames())
            names.push_back("--" + name);
    return names;
}

int usage_error(const std::string& where, const std::string& what, const std::string& what_to_do)
{
    return report_error({ErrorCode::Usage, where, what + "; " + what_to_do});
}

std::string see_help(const std::string& command)
{
    return fmt::format("see 'trimray {}{}--help'", command, command.empty() ? "" : " ");
}

/// What to say about arguments that no option takes; the likeliest meant option, if one is near.
int unexpected_argument(const CLI::App& command, const std::string& where)
{
    const std::vector<std::string> extras = command.remaining(true);
    const std::string extra = extras.empty() ? "?" : extras.front();
    const std::string near = extra.starts_with("--") ? nearest_word(extra, option_names(command)) : "";
    return usage_error(where, fmt::format("unexpected argument '{}'", extra),
                       near.empty() ? see_help(where) : fmt::format("did you mean '{}'?", near));
}

// "-.5,1,2" is a number, though the parser takes it for an option: write it as "-0.5,1,2".
std::string with_leading_zero(const std::string& argument)
{
    const bool bare = argument.size() > 2 && argument.starts_with("-.") && std::isdigit(argument[2]);
    return bare ? "-0" + argument.substr(1) : argument;
}

int run(const std::vector<std::string>& arguments)
{
    CLI::App app{"Trimray: ray traces the trimmed spline surfaces of CAD models, without triangles", "trimray"};
    app.set_version_flag("--version", "trimray " TRIMRAY_VERSION);
    app.footer("Examples:\n"
               "  trimray pack model.step -o model.tray\n"
               "  trimray render model.tray -o picture.png\n"
               "\nExit codes: 0 done, 1 usage, 2 file not read or written, 3 invalid input, 4 unsupported, 5 internal, "
               "6 done but incomplete.\n'trimray COMMAND --help' describes a command.");
    app.require_subcommand(1);
    int exit_code = kExitOk;
    register_externals(app);
    for (const auto register_command : {register_render, register_info, register_validate, register_thumbnail,
                                        register_export, register_preview, register_bench, register_version})
        register_command(app, exit_code);

    if (arguments.empty()) {
        fmt::print("{}", app.help());
        return kExitOk;
    }
    const std::string& name = arguments.front();
    for (const ExternalCommand& command : external_commands())
        if (is_asked_for(command, arguments))
            return run_external(command, {arguments.begin() + 1, arguments.end()});
    if (!name.starts_with("-") && find_command(app, name) == nullptr) {
        const std::string near = nearest_word(name, command_names(app));
        return usage_error("", fmt::format("no command '{}'", name),
                           near.empty() ? see_help("") : fmt::format("did you mean '{}'?", near));
    }

    std::vector<std::string> reversed; // the parser takes its arguments last first
    for (auto argument = arguments.rbegin(); argument != arguments.rend(); ++argument)
        reversed.push_back(with_leading_zero(*argument));
    try {
        app.parse(reversed);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) // --help, --version
            return app.exit(error);
        const CLI::App* command = find_command(app, name);
        std::string where = command ? name : "";
        while (command && !command->get_subcommands().empty()) { // bench trims
            command = command->get_subcommands().front();
            where += " " + command->get_name();
        }
        if (!command) // not a word, so not a command: an option that nobody takes
            return usage_error("", fmt::format("unexpected argument '{}'", name), see_help(""));
        if (dynamic_cast<const CLI::ExtrasError*>(&error))
            return unexpected_argument(*command, where);
        return usage_error(where, error.what(), see_help(where));
    }
    return exit_code;
}

} // namespace

int main(int argc, char** argv)
{
    int exit_code = kExitInternal;
    try {
        exit_code = run({argv + 1, argv + argc});
    } catch (const std::bad_alloc&) {
        exit_code = report_error({ErrorCode::Internal, "", "out of memory; ask for a smaller picture"});
    } catch (const std::exception& error) {
        exit_code = report_error({ErrorCode::Internal, "", error.what()});
    }
    if ((std::fflush(stdout) != 0 || std::ferror(stdout) != 0) && exit_code == kExitOk)
        exit_code = report_error({ErrorCode::FileNotWritable, "stdout", "cannot be written; is the disk full?"});
    return exit_code;
}
