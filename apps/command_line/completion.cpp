#include "command_line/completion.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string_view>

#include "command_line/option_text.h"

namespace htvm::app {
namespace {

std::string replaced(std::string text, std::string_view what, std::string_view by) {
    for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size()))
        text.replace(at, what.size(), by);
    return text;
}

// One line, short enough for a list of completions.
std::string brief(std::string text) {
    constexpr std::size_t longest = 90;
    // The part before the colon in "--bitrate: seconds of stream ..." names the option it belongs to.
    if (text.starts_with("--")) text.erase(0, text.find(": ") + 2);
    const auto clause = text.substr(0, std::min({text.find(": "), text.find(". "), text.find("; "), text.find(" (")}));
    return clause.size() <= longest ? clause : clause.substr(0, clause.rfind(' ', longest)) + " ...";
}

std::vector<std::string> command_names(const CLI::App& program) {
    std::vector<std::string> out;
    for (const auto* command : commands_of(program)) out.push_back(command->get_name());
    return out;
}

std::vector<std::string> option_names(const CLI::App& command) {
    std::vector<std::string> out;
    for (const auto& option : option_texts(command)) out.insert(out.end(), option.names.begin(), option.names.end());
    return out;
}

// A name for a shell function; those of programs may contain a dash.
std::string function_of(const CLI::App& program) { return "_" + replaced(program.get_name(), "-", "_"); }

// ---- bash -----------------------------------------------------------------------------------------------------------

// What follows an option: its words, files, folders, or nothing that could be offered.
std::string bash_value(const OptionText& option) {
    if (!option.words.empty()) return fmt::format("compgen -W '{}' -- \"$current\"", fmt::join(option.words, " "));
    if (option.value == "FILE") return "compgen -f -- \"$current\"";
    if (option.value == "FOLDER") return "compgen -d -- \"$current\"";
    return ":";
}

std::string bash_values(const CLI::App& command) {
    std::string out;
    for (const auto& option : option_texts(command)) {
        if (option.names.empty() || option.value.empty()) continue;
        std::vector<std::string> patterns;
        for (const auto& name : option.names) patterns.push_back(command.get_name() + ":" + name);
        out += fmt::format("        {}) {}; return ;;\n", fmt::join(patterns, " | "), bash_value(option));
    }
    return out;
}

// ---- zsh ------------------------------------------------------------------------------------------------------------

std::string zsh_quoted(const std::string& text) { return "'" + replaced(text, "'", "'\\''") + "'"; }

// Escapes text for a description in brackets, or before a colon.
std::string zsh_text(std::string text) {
    for (const char* special : {"\\", "[", "]", ":"}) text = replaced(text, special, std::string("\\") + special);
    return text;
}

std::string zsh_action(const OptionText& option) {
    if (!option.words.empty()) return fmt::format("({})", fmt::join(option.words, " "));
    if (option.value == "FOLDER") return "_files -/";
    return option.value == "FILE" ? "_files" : " ";
}

std::string zsh_options(const CLI::App& command) {
    std::string out;
    for (const auto& option : option_texts(command)) {
        const auto meaning = zsh_text(brief(option.meaning));
        const auto what = option.words.empty() ? zsh_text(option.value) : "word";
        const auto value = option.value.empty() ? "" : fmt::format(":{}:{}", what, zsh_action(option));
        for (const auto& name : option.names)
            out += " \\\n                    " +
                   zsh_quoted(fmt::format("({}){}[{}]{}", fmt::join(option.names, " "), name, meaning, value));
        if (!option.place.empty())
            out += " \\\n                    " +
                   zsh_quoted(fmt::format(":{}:{}", zsh_text(option.place), zsh_action(option)));
    }
    return out;
}

// ---- fish -----------------------------------------------------------------------------------------------------------

std::string fish_quoted(std::string text) {
    return "'" + replaced(replaced(std::move(text), "\\", "\\\\"), "'", "\\'") + "'";
}

std::string fish_options(const CLI::App& command, const std::string& begin) {
    std::string out;
    for (const auto& option : option_texts(command)) {
        if (option.names.empty()) continue;
        out += begin;
        for (const auto& name : option.names)
            out += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
        if (!option.words.empty())
            out += fmt::format(" -x -a '{}'", fmt::join(option.words, " "));
        else if (option.value == "FOLDER")
            out += " -x -a '(__fish_complete_directories)'";
        else if (option.value == "FILE")
            out += " -r -F";
        else if (!option.value.empty())
            out += " -x";
        out += " -d " + fish_quoted(brief(option.meaning)) + "\n";
    }
    return out;
}

}  // namespace

std::string bash_completion(const CLI::App& program) {
    const auto name = function_of(program);
    std::string values, options;
    for (const auto* command : commands_of(program)) {
        values += bash_values(*command);
        options += fmt::format("        {}) compgen -W '{}' -- \"$current\" ;;\n", command->get_name(),
                               fmt::join(option_names(*command), " "));
    }
    return fmt::format(
        R"(# bash completion of {0}
{1}_offers() {{
    local current=$1 before=$2 command=$3
    case $command:$before in
{2}    esac
    if [[ $current != -* ]]; then
        if [[ $command ]]; then compgen -f -- "$current"; else compgen -W '{3}' -- "$current"; fi
        return
    fi
    case $command in
{4}        *) compgen -W '{5}' -- "$current" ;;
    esac
}}
{1}() {{
    local word command=
    for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
        case $word in
            {6}) command=$word; break ;;
        esac
    done
    mapfile -t COMPREPLY < <({1}_offers "${{COMP_WORDS[COMP_CWORD]}}" "${{COMP_WORDS[COMP_CWORD-1]}}" "$command")
}}
complete -o filenames -F {1} {0}
)",
        program.get_name(), name, values, fmt::join(command_names(program), " "), options,
        fmt::join(option_names(program), " "), fmt::join(command_names(program), " | "));
}

std::string zsh_completion(const CLI::App& program) {
    std::string commands, arguments;
    for (const auto* command : commands_of(program)) {
        commands +=
            "                " + zsh_quoted(command->get_name() + ":" + zsh_text(brief(summary_of(*command)))) + "\n";
        arguments += fmt::format("                {})\n                    _arguments{}\n                    ;;\n",
                                 command->get_name(), zsh_options(*command));
    }
    return fmt::format(
        R"(#compdef {0}
{1}() {{
    local curcontext=$curcontext state line
    _arguments -C{2} \
                    ':command:->command' '*::argument:->argument'
    case $state in
        command)
            local -a commands=(
{3}            )
            _describe command commands
            ;;
        argument)
            case $line[1] in
{4}            esac
            ;;
    esac
}}
if [[ $funcstack[1] = {1} ]]; then {1} "$@"; else compdef {1} {0}; fi
)",
        program.get_name(), function_of(program), zsh_options(program), commands, arguments);
}

std::string fish_completion(const CLI::App& program) {
    const auto all = "complete -c " + program.get_name();
    std::string out = "# fish completion of " + program.get_name() + "\n";
    out += fish_options(program, all + " -n __fish_use_subcommand -f");
    for (const auto* command : commands_of(program)) {
        out += fmt::format("{} -n __fish_use_subcommand -f -a {} -d {}\n", all, command->get_name(),
                           fish_quoted(brief(summary_of(*command))));
        out += fish_options(*command, fmt::format("{} -n '__fish_seen_subcommand_from {}'", all, command->get_name()));
    }
    return out;
}

}  // namespace htvm::app
