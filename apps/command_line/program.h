// A program with subcommands: what `htvm` and `htvm-lab` share from main() on.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "htvm/result.hpp"

namespace CLI {
class App;
}

namespace htvm::app {

// What the chosen subcommand does once its options are parsed; an error becomes a line on stderr and an exit code.
using Run = std::function<Result<void>()>;

// Adds one subcommand to the parser; its callback sets the Run.
using AddCommand = void (*)(CLI::App& app, Run& run);

struct Program {
    std::string name;         // as typed by the user
    std::string description;  // one sentence, at the top of --help
    std::string footer;       // at the end of --help, after the exit codes; may be empty
    std::vector<AddCommand> commands;
    std::map<std::string, std::string> elsewhere = {};  // what is no command here, and what to type in its place
    std::vector<std::string> built_without = {};        // abilities that were left out, for --version
    std::map<std::string, std::string> may_be_left_out =
        {};                      // commands, and the ability without which they are missing
    std::string for_files = "";  // what people who type a file's name in place of a command may have meant
};

struct ExitCode {
    int code;
    const char* meaning;
};
inline constexpr std::array exit_codes = {
    ExitCode{0, "done"},        ExitCode{1, "bad input"},
    ExitCode{2, "usage"},       ExitCode{3, "corrupt stream"},
    ExitCode{4, "unsupported"}, ExitCode{5, "limit exceeded, or frames dropped to keep to a bitrate"},
    ExitCode{6, "disk full"},   ExitCode{130, "interrupted (143: by SIGTERM)"},
};

// Parses the command line, runs the chosen subcommand, and reports errors on stderr. Returns one of the exit codes.
// `NAME help COMMAND` is `NAME COMMAND --help`; every command has --quiet.
// `--write-pages FOLDER` writes man pages and shell completions to man1, bash, zsh and fish in that folder instead. The
// build calls it, so pages and completions always match the options that the program parses.
int run_program(const Program& program, int argc, char** argv);

// What --help shows of a command with many options: those that people need, in plain words. --help-all and the man page
// have all of them, under headings.
struct FrontPage {
    struct Entry {
        const char* option;        // a flag, or the name of a positional argument
        std::string meaning = "";  // "": as --help-all has it
    };
    std::vector<Entry> options;  // flags in the order of the page; positional arguments are there in any case
    std::string footer = "";     // "": as --help-all has it
};
void add_front_page(CLI::App& command, FrontPage page);

}  // namespace htvm::app
