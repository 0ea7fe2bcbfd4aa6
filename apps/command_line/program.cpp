#include "command_line/program.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <set>
#include <string_view>
#include <utility>

#include "command_line/completion.h"
#include "command_line/console.h"
#include "command_line/interruption.h"
#include "command_line/manual.h"
#include "command_line/option_text.h"
#include "command_line/terminal.h"
#include "core/edit_distance.h"
#include "io/output_file.h"

namespace htvm::app {

using internal::meant_word;
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
        case ErrorKind::disk_full:
            return 6;
    }
    return 1;
}

std::vector<std::string> flags_of(const CLI::App& command) {
    std::vector<std::string> out;
    for (const auto* option : command.get_options())
        for (const auto& name : option->get_lnames()) out.push_back("--" + name);
    return out;
}

bool is_number(const std::string& text) {
    char* end = nullptr;
    std::strtod(text.c_str(), &end);
    return !text.empty() && *end == '\0';
}

// The number that an option was given and cannot take; empty if it is fine.
std::string odd_number(const CLI::Option& option, const std::string& text) {
    const auto type = option.get_type_name(), range = range_of(option);
    const bool whole = type.find("INT") != std::string::npos;
    if (!is_number(text)) return text + " is not a number";
    if (!range.empty()) return fmt::format("{} is not {}{}", text, whole ? "a whole number from " : "in ", range);
    if (whole && text.find_first_of(".eE") != std::string::npos) return text + " is not a whole number";
    return text + " is out of range";
}

// The first of the words that the parser could not place which is meant as an option; empty: there is none.
std::string unknown_flag(const CLI::App& command) {
    for (const auto& word : command.remaining())
        if (word.size() > 1 && word.starts_with('-')) return word.substr(0, word.find('='));
    return "";
}

// The flags that begin with this one and a hyphen: --fill-holes for --fill.
std::vector<std::string> longer_than(const std::string& flag, const std::vector<std::string>& flags) {
    std::vector<std::string> out;
    for (const auto& other : flags)
        if (other.starts_with(flag + "-")) out.push_back(other);
    return out;
}

// Where an option is that the chosen command does not have: "it is one of 'htvm encode', beside --fill-holes"; empty:
// nowhere.
std::string option_elsewhere(const CLI::App& app, const std::string& flag) {
    std::vector<std::string> commands;
    std::string beside;
    for (const auto* command : commands_of(app)) {
        const auto flags = flags_of(*command);
        if (std::find(flags.begin(), flags.end(), flag) == flags.end()) continue;
        commands.push_back(fmt::format("'{} {}'", app.get_name(), command->get_name()));
        if (const auto longer = longer_than(flag, flags); !longer.empty())
            beside = fmt::format(", beside {}", fmt::join(longer, ", "));
    }
    if (commands.empty()) return "";
    return fmt::format("it is one of {}{}", fmt::join(commands, ", "), commands.size() == 1 ? beside : "");
}

// What may have been meant instead of an option that is unknown here: a sentence and its end; or empty.
std::string hint_at(const CLI::App& app, const CLI::App& command, const std::string& flag) {
    if (const auto elsewhere = option_elsewhere(app, flag); !elsewhere.empty()) return elsewhere + "; ";
    const auto meant = meant_word(flag, flags_of(command));
    return meant.empty() ? "" : fmt::format("did you mean {}? ", meant);
}

// What the parser said, with the option's own words where it speaks of numbers.
std::string in_words(const CLI::App& app, const CLI::Error& error) {
    const std::string said = error.what();
    const bool of_number = said.find(" not in range ") != std::string::npos || said.starts_with("Could not convert: ");
    for (const auto* command : app.get_subcommands()) {
        for (const auto* option : command->get_options()) {
            const auto& given = option->results();
            const auto name = option->get_name();
            if (!of_number || given.size() != 1 || name.empty()) continue;
            if (said.starts_with(name + ": ") || said.starts_with("Could not convert: " + name + " = "))
                return fmt::format("{}: {}", name, odd_number(*option, given[0]));
        }
    }
    for (const auto* command : app.get_subcommands())
        if (const auto unknown = unknown_flag(*command); !unknown.empty())
            return fmt::format("{} {} has no option {}", app.get_name(), command->get_name(), unknown);
    if (!app.get_subcommands().empty()) return said;
    if (const auto unknown = unknown_flag(app); !unknown.empty()) return "there is no option " + unknown;
    return said == "A subcommand is required" ? "a command is required" : said;
}

// The word behind a command's input that is no file yet, where it lacks its -o, as in "cp FROM TO"; or empty.
std::string meant_output(const CLI::App& command) {
    const auto& remaining = command.remaining();
    std::vector<std::string> words(remaining.begin(), remaining.end());
    for (const auto* option : command.get_options())
        if (words.empty() && option->get_positional() && option->results().size() > 1)
            words.push_back(option->results().back());
    std::error_code error;
    const bool one = words.size() == 1 && !words[0].starts_with('-') && !std::filesystem::exists(words[0], error);
    return one ? words[0] : std::string();
}

// What was wrong with the command line, what may have been meant, and where to read on.
std::string usage_message(const CLI::App* app, const CLI::Error& error) {
    std::string command = app->get_name(), help = "--help";
    const CLI::App* chosen = app;
    for (const auto* named : app->get_subcommands()) {
        command += " " + named->get_name();
        chosen = named;
        // The front page may lack the very option that was wrong; what is required is on it.
        const auto* all = named->get_option_no_throw("--help-all");
        if (error.get_name() != "RequiredError" && all && !all->get_group().empty()) help = "--help-all";
    }
    const auto unknown = unknown_flag(*chosen), said = in_words(*app, error);
    auto hint = unknown.starts_with("--") ? hint_at(*app, *chosen, unknown) : std::string();
    const auto* output = chosen->get_option_no_throw("--output");
    if (const auto meant = meant_output(*chosen); output && output->count() == 0 && !meant.empty())
        hint = fmt::format("did you mean -o {}? ", meant);
    return fmt::format("{}: error: {}{} {}'{} {}' tells more\n", app->get_name(), said, said.ends_with('?') ? "" : ";",
                       hint, command, help);
}

// Output that is still buffered may fail to arrive: a full disk must not look like success.
Result<void> output_arrived() {
    errno = 0;
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return {};
    return tl::unexpected(write_error("standard output", errno));
}

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

// A switch takes no value: what stands behind it would be taken for a file. words: of the command line.
void refuse_values_of_switches(const CLI::App& command, const std::vector<std::string>& words) {
    static const std::set<std::string> values = {"on", "off", "auto", "yes", "no", "true", "false"};
    for (std::size_t i = 0; i + 1 < words.size(); ++i) {
        const auto* option = words[i].starts_with("--") ? command.get_option_no_throw(words[i]) : nullptr;
        std::error_code error;
        if (!option || option->get_items_expected_max() > 0 || !values.contains(words[i + 1]) ||
            std::filesystem::exists(words[i + 1], error))
            continue;
        const auto longer = longer_than(words[i], flags_of(command));
        throw CLI::ValidationError(words[i], fmt::format("takes no value, and '{}' is behind it{}", words[i + 1],
                                                         longer.empty() ? "" : "; did you mean " + longer[0] + "?"));
    }
}

std::vector<std::string> command_names(const CLI::App& app) {
    std::vector<std::string> out;
    for (const auto* command : commands_of(app)) out.push_back(command->get_name());
    return out;
}

// For an unknown command, CLI11 only says that one is missing.
bool names_no_command(const CLI::App& app, const std::string& word) {
    const auto commands = command_names(app);
    return !word.starts_with('-') && std::find(commands.begin(), commands.end(), word) == commands.end();
}

// Whether the word is a command that this build lacks.
bool is_left_out(const Program& program, const std::string& word) { return program.may_be_left_out.contains(word); }

void say_left_out(const Program& program, const std::string& word) {
    tell_error(fmt::format("this {} was built without {}, so it has no command '{}'; docs/platforms.md tells more",
                           program.name, program.may_be_left_out.at(word), word));
}

// "htvm 0.1.0", and in a second line what is missing.
std::string version_text(const Program& program) {
    const auto version = program.name + " " HTVM_VERSION;
    if (program.built_without.empty()) return version;
    return fmt::format("{}\nbuilt without {}", version, fmt::join(program.built_without, ", "));
}

void say_no_such_command(const Program& program, const CLI::App& app, const std::string& word) {
    const auto found = program.elsewhere.find(word);
    const auto meant = meant_word(word, command_names(app));
    const auto flags = flags_of(app);
    const bool is_flag = std::find(flags.begin(), flags.end(), "--" + word) != flags.end();
    std::error_code error;
    const bool is_there = std::filesystem::exists(word, error);
    const std::string hint = found != program.elsewhere.end() ? fmt::format("it is '{}'", found->second)
                             : is_there && !program.for_files.empty()
                                 ? fmt::format("what to do with a file comes first: {}", program.for_files)
                             : is_flag       ? fmt::format("did you mean --{}?", word)
                             : meant.empty() ? fmt::format("'{} --help' lists them", program.name)
                                             : fmt::format("did you mean '{}'?", meant);
    tell_error(fmt::format("there is no command '{}'; {}", word, hint));
}

// "0 done, 1 bad input, ..."
std::string exit_codes_text() {
    std::vector<std::string> out;
    for (const auto& exit : exit_codes) out.push_back(fmt::format("{} {}", exit.code, exit.meaning));
    return fmt::format("{}", fmt::join(out, ", "));
}

Result<void> write_page(const std::filesystem::path& path, const std::string& text) {
    std::error_code ignored;
    std::filesystem::create_directories(path.parent_path(), ignored);
    return write_file(path, text);
}

Result<void> write_pages(const Program& program, const CLI::App& app, const std::filesystem::path& folder) {
    const auto& name = program.name;
    std::map<std::filesystem::path, std::string> pages = {
        {std::filesystem::path("man1") / (name + ".1"), program_page(program, app)},
        {std::filesystem::path("bash") / name, bash_completion(app)},
        {std::filesystem::path("zsh") / ("_" + name), zsh_completion(app)},
        {std::filesystem::path("fish") / (name + ".fish"), fish_completion(app)}};
    for (const auto* command : commands_of(app))
        pages[std::filesystem::path("man1") / (name + "-" + command->get_name() + ".1")] =
            command_page(program, app, *command);
    for (const auto& [path, text] : pages)
        if (auto written = write_page(folder / path, text); !written) return written;
    return {};
}

// "help encode" is "encode --help".
std::vector<std::string> asked_words(const std::vector<std::string>& words) {
    if (words.empty() || words[0] != "help") return words;
    return words.size() > 1 ? std::vector<std::string>{words[1], "--help"} : std::vector<std::string>{"--help"};
}

int exit_with(const Error& error) {
    tell_error(error.message);
    return interruption() != 0 ? 128 + interruption() : exit_code(error.kind);
}

// A command whose --help shows all it has takes --help-all, too: who knows it of one command tries it with others.
void accept_help_all(CLI::App& command) {
    if (command.get_option_no_throw("--help-all")) return;
    command.add_flag_callback("--help-all", [] { throw CLI::CallForHelp(); })->group("");
}

}  // namespace

void add_front_page(CLI::App& command, FrontPage page) {
    command.set_help_flag();
    command.add_flag_callback(
        "-h,--help",
        [&command, formatter = front_page_formatter(std::move(page))] {
            command.formatter(formatter);
            throw CLI::CallForHelp();
        },
        "Print what people need most, and exit");
    command.add_flag_callback(
        "--help-all", [] { throw CLI::CallForHelp(); }, "Print all options and exit");
}

int run_program(const Program& program, int argc, char** argv) {
    prepare_console();
    speak_as(program.name);
    CLI::App app{program.description, program.name};
    app.allow_windows_style_options(false);  // what begins with a slash is a file there, too
    app.footer(fmt::format("Exit codes: {}.\n'{} COMMAND --help' explains a command.{}{}", exit_codes_text(),
                           program.name, program.footer.empty() ? "" : "\n", program.footer));
    app.set_version_flag("-V,--version", version_text(program));
    app.failure_message(usage_message);
    app.formatter(help_formatter());
    app.require_subcommand(1);
    accept_help_all(app);
    Run run;
    for (const auto add : program.commands) add(app, run);
    const auto given = given_words(argc, argv), words = asked_words(given);
    for (auto* command : app.get_subcommands([](const CLI::App*) { return true; })) {
        command->add_flag_callback("--quiet", quieten, "Say nothing but warnings and errors");
        accept_help_all(*command);
        command->preparse_callback([command, &words](std::size_t) { refuse_values_of_switches(*command, words); });
    }
    app.add_subcommand("help", fmt::format("Explain a command: {} help COMMAND", program.name));
    if (!words.empty() && names_no_command(app, words[0]) && is_left_out(program, words[0])) {
        say_left_out(program, words[0]);
        return exit_code(ErrorKind::unsupported);
    }
    if (!words.empty() && names_no_command(app, words[0])) {
        say_no_such_command(program, app, words[0]);
        return 2;
    }
    if (given.size() == 2 && given[0] == "--write-pages") {
        const auto written = write_pages(program, app, given[1]);
        return written ? 0 : exit_with(written.error());
    }
    try {
        app.parse(std::vector<std::string>(words.rbegin(), words.rend()));  // as CLI11 wants them
        for (const auto* command : app.get_subcommands()) refuse_odd_numbers(*command);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    }
    try {
        auto done = run();
        if (done) done = output_arrived();
        return done ? 0 : exit_with(done.error());
    } catch (const std::bad_alloc&) {
        tell_error("out of memory");
        return 5;
    } catch (const std::exception& error) {
        tell_error(error.what());
        return 1;
    }
}

}  // namespace htvm::app
