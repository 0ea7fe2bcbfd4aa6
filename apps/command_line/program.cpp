#include "command_line/program.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <new>
#include <string_view>

#include "command_line/completion.h"
#include "command_line/manual.h"
#include "command_line/option_text.h"
#include "command_line/terminal.h"

namespace htvm::app {
namespace {

int exit_code(ErrorKind kind) {
    switch (kind) {
        case ErrorKind::bad_input:
            return 1;
        case ErrorKind::corrupt_stream:
            return 3;
        case ErrorKind::unsupported:
            return 4;
        case ErrorKind::limit:
            return 5;
    }
    return 1;
}

// What is wrong with the command line, and where to find help.
std::string usage_message(const CLI::App* app, const CLI::Error& error) {
    std::string command = app->get_name();
    for (const auto* named : app->get_subcommands()) command += " " + named->get_name();
    return fmt::format("{}: error: {}; '{} --help' tells more\n", app->get_name(), error.what(), command);
}

// Writing buffered output can still fail: a full disk must not look like success.
bool output_arrived() { return std::fflush(stdout) == 0 && std::ferror(stdout) == 0; }

// CLI11 accepts "nan" as a number within any range, and "-1" as a very large one.
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

// For an unknown command, CLI11 only says that one is missing.
bool names_no_command(const CLI::App& app, const std::string& word) {
    const auto commands = app.get_subcommands([](const CLI::App*) { return true; });
    return !word.starts_with('-') && std::none_of(commands.begin(), commands.end(),
                                                  [&](const CLI::App* command) { return command->get_name() == word; });
}

void say_no_such_command(const Program& program, const std::string& word) {
    const auto found = program.elsewhere.find(word);
    const std::string hint = found == program.elsewhere.end() ? fmt::format("'{} --help' lists them", program.name)
                                                              : fmt::format("it is '{}'", found->second);
    fmt::print(stderr, "{}: error: there is no command '{}'; {}\n", program.name, word, hint);
}

// "0 done, 1 bad input, ..."
std::string exit_codes_text() {
    std::vector<std::string> out;
    for (const auto& exit : exit_codes) out.push_back(fmt::format("{} {}", exit.code, exit.meaning));
    return fmt::format("{}", fmt::join(out, ", "));
}

bool write_file(const std::filesystem::path& path, const std::string& text) {
    std::error_code ignored;
    std::filesystem::create_directories(path.parent_path(), ignored);
    std::ofstream file(path, std::ios::binary);
    file << text;
    return static_cast<bool>(file.flush());
}

bool write_pages(const Program& program, const CLI::App& app, const std::filesystem::path& folder) {
    const auto& name = program.name;
    bool written = write_file(folder / "man1" / (name + ".1"), program_page(program, app)) &&
                   write_file(folder / "bash" / name, bash_completion(app)) &&
                   write_file(folder / "zsh" / ("_" + name), zsh_completion(app)) &&
                   write_file(folder / "fish" / (name + ".fish"), fish_completion(app));
    for (const auto* command : commands_of(app))
        written = written && write_file(folder / "man1" / (name + "-" + command->get_name() + ".1"),
                                        command_page(program, app, *command));
    return written;
}

}  // namespace

int run_program(const Program& program, int argc, char** argv) {
    speak_as(program.name);
    CLI::App app{program.description, program.name};
    app.footer(
        fmt::format("Exit codes: {}.\n"
                    "'{} COMMAND --help' explains a command.{}{}",
                    exit_codes_text(), program.name, program.footer.empty() ? "" : "\n", program.footer));
    app.set_version_flag("--version", program.name + " " HTVM_VERSION);
    app.failure_message(usage_message);
    app.require_subcommand(1);
    Run run;
    for (const auto add : program.commands) add(app, run);
    if (argc > 1 && names_no_command(app, argv[1])) {
        say_no_such_command(program, argv[1]);
        return 2;
    }
    if (argc == 3 && std::string_view(argv[1]) == "--write-pages") {
        if (write_pages(program, app, argv[2])) return 0;
        fmt::print(stderr, "{}: error: {} cannot be written to\n", program.name, argv[2]);
        return 1;
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
            fmt::print(stderr, "{}: error: standard output cannot be written\n", program.name);
            return 1;
        }
        fmt::print(stderr, "{}: error: {}\n", program.name, done.error().message);
        return exit_code(done.error().kind);
    } catch (const std::bad_alloc&) {
        fmt::print(stderr, "{}: error: out of memory\n", program.name);
        return 5;
    } catch (const std::exception& error) {
        fmt::print(stderr, "{}: error: {}\n", program.name, error.what());
        return 1;
    }
}

}  // namespace htvm::app
