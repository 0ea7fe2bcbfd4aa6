// htvm: the command line. Exit codes: 0 done, 1 bad input, 2 usage, 3 corrupt stream, 4 unsupported, 5 limit.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "commands.h"
#include "compare.h"
#include "reproduce.h"

namespace {

int exit_code(htvm::ErrorKind kind) {
    switch (kind) {
        case htvm::ErrorKind::bad_input:
            return 1;
        case htvm::ErrorKind::corrupt_stream:
            return 3;
        case htvm::ErrorKind::unsupported:
            return 4;
        case htvm::ErrorKind::limit:
            return 5;
    }
    return 1;
}

// What was wrong with the command line, and where to read on.
std::string usage_message(const CLI::App* app, const CLI::Error& error) {
    std::string command = "htvm";
    for (const auto* named : app->get_subcommands()) command += " " + named->get_name();
    return fmt::format("htvm: error: {}; '{} --help' tells more\n", error.what(), command);
}

// Output that is still buffered may fail to arrive: a full disk must not look like success.
bool output_arrived() { return std::fflush(stdout) == 0 && std::ferror(stdout) == 0; }

// CLI11 takes "nan" for a number within any range, and "-1" for a very large one.
void refuse_odd_numbers(const CLI::App& command) {
    for (const auto* option : command.get_options())
        for (const auto& text : option->results()) {
            const auto type = option->get_type_name();
            if (type.starts_with("FLOAT") && std::isnan(std::strtod(text.c_str(), nullptr)))
                throw CLI::ValidationError(option->get_name(), text + " is not a number");
            if (type.starts_with("UINT") && text.starts_with('-'))
                throw CLI::ValidationError(option->get_name(), text + " is less than 0");
        }
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{"htvm compresses human time-varying meshes: captured 3D people, one triangle mesh a frame.", "htvm"};
    app.footer(
        "Exit codes: 0 done, 1 bad input, 2 usage, 3 corrupt stream, 4 unsupported, 5 limit exceeded.\n"
        "'htvm COMMAND --help' explains a command.");
    app.set_version_flag("--version", "htvm " HTVM_VERSION);
    app.failure_message(usage_message);
    app.require_subcommand(1);
    htvm::app::Run run;
    htvm::app::add_synth(app, run);
    htvm::app::add_encode(app, run);
    htvm::app::add_decode(app, run);
    htvm::app::add_info(app, run);
    htvm::app::add_calibrate(app, run);
    htvm::app::add_compare(app, run);
    htvm::app::add_rd(app, run);
    htvm::app::add_reproduce(app, run);
    const auto commands = app.get_subcommands([](CLI::App*) { return true; });
    const auto is_named = [&](const CLI::App* command) { return command->get_name() == argv[1]; };
    if (argc > 1 && argv[1][0] != '-' && std::none_of(commands.begin(), commands.end(), is_named)) {
        fmt::print(stderr, "htvm: error: there is no command '{}'; 'htvm --help' lists them\n", argv[1]);
        return 2;
    }
    try {
        app.parse(argc, argv);
        for (const auto* command : app.get_subcommands()) refuse_odd_numbers(*command);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    }
    try {
        const auto done = run();
        if (done && output_arrived()) return 0;
        if (done) {
            fmt::print(stderr, "htvm: error: standard output cannot be written\n");
            return 1;
        }
        fmt::print(stderr, "htvm: error: {}\n", done.error().message);
        return exit_code(done.error().kind);
    } catch (const std::bad_alloc&) {
        fmt::print(stderr, "htvm: error: out of memory\n");
        return 5;
    } catch (const std::exception& error) {
        fmt::print(stderr, "htvm: error: {}\n", error.what());
        return 1;
    }
}
