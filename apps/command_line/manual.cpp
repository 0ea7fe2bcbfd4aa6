#include "command_line/manual.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <sstream>
#include <string_view>

#include "command_line/option_text.h"
#include "command_line/program.h"

namespace htvm::app {
namespace {

// Escapes text so that roff prints it literally.
std::string escaped(std::string_view text) {
    std::string out;
    if (text.starts_with('.') || text.starts_with('\'')) out += "\\&";
    for (const char c : text) switch (c) {
            case '\\':
                out += "\\e";
                break;
            case '-':
                out += "\\-";
                break;
            case '\'':
                out += "\\(aq";
                break;
            case '^':
                out += "\\(ha";
                break;
            case '~':
                out += "\\(ti";
                break;
            case '"':
                out += "\\(dq";
                break;
            default:
                out += c;
        }
    return out;
}

std::string upper(std::string text) {
    for (auto& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    return text;
}

std::string lower_first(std::string text) {
    if (!text.empty()) text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
    return text;
}

// Keeps indented lines, which are commands and tables, as they are; joins others into paragraphs.
std::string paragraphs(const std::string& text) {
    std::string out;
    std::istringstream lines(text);
    bool literal = false, paragraph = false;
    for (std::string line; std::getline(lines, line);) {
        const bool indented = line.starts_with(' ');
        if (literal && !indented) out += ".fi\n";
        if ((literal != indented || line.empty()) && !out.empty()) paragraph = true;
        if (line.empty()) continue;
        if (paragraph) out += ".PP\n";
        paragraph = false;
        if (indented && !literal) out += ".nf\n";
        literal = indented;
        out += escaped(line) + "\n";
    }
    if (literal) out += ".fi\n";
    return out;
}

struct Footer {
    std::string notes, examples;
};

// A command's footer ends with its examples: after a line "Examples:", or after the word.
Footer split_footer(const std::string& footer) {
    Footer out;
    std::istringstream lines(footer);
    bool in_examples = false;
    for (std::string line; std::getline(lines, line);) {
        if (line.starts_with("Example")) {
            in_examples = true;
            const auto colon = line.find(':');
            const auto rest = line.find_first_not_of(' ', colon + 1);
            if (rest == std::string::npos) continue;
            // A command is kept verbatim, a sentence is not.
            line = (line.compare(rest, 4, "htvm") == 0 ? "  " : "") + line.substr(rest);
            if (!line.starts_with(' ')) line += ':';
        }
        (in_examples ? out.examples : out.notes) += line + "\n";
    }
    return out;
}

std::string option_line(const OptionText& option) {
    std::vector<std::string> names;
    for (const auto& name : option.names) names.push_back(escaped(name));
    std::string out = "\\fB" + fmt::format("{}", fmt::join(names, "\\fR, \\fB")) + "\\fR";
    if (names.empty()) out = "\\fI" + escaped(option.place) + "\\fR";
    if (!names.empty() && !option.value.empty()) {
        const auto value = escaped(option.value);
        out += option.words.empty() ? " \\fI" + value + "\\fR" : " " + value;
    }
    return out;
}

std::string options_section(const CLI::App& command) {
    std::string out = ".SH OPTIONS\n";
    // The groups in the order of their first options; positional arguments come first.
    std::vector<std::pair<std::string, std::string>> groups = {{"", ""}};
    for (const auto& option : option_texts(command)) {
        const auto heading = option.heading == "Options" ? "" : option.heading;
        auto group = std::find_if(groups.begin(), groups.end(), [&](const auto& g) { return g.first == heading; });
        if (group == groups.end()) group = groups.insert(groups.end(), {heading, ""});
        auto meaning = option.meaning;
        if (option.required) meaning += "; must be given";
        group->second +=
            ".TP\n" + option_line(option) + "\n" + escaped(meaning) + (option.table.empty() ? "." : ":") + "\n";
        if (option.table.empty()) continue;
        group->second += ".RS\n.nf\n";
        for (const auto& line : option.table) group->second += escaped(line) + "\n";
        group->second += ".fi\n.RE\n";
    }
    for (const auto& [heading, options] : groups) {
        if (!heading.empty()) out += ".SS \"" + escaped(heading) + "\"\n";
        out += options;
    }
    return out;
}

std::string title(const std::string& name) {
    return fmt::format(".TH \"{}\" 1 \"\" \"htvm {}\" \"htvm manual\"\n", escaped(upper(name)), HTVM_VERSION);
}

std::string exit_section() {
    std::string out = ".SH \"EXIT STATUS\"\n";
    for (const auto& exit : exit_codes) out += fmt::format(".TP\n\\fB{}\\fR\n{}\n", exit.code, escaped(exit.meaning));
    return out;
}

std::string see_also(const Program& program, const CLI::App& app, const std::string& but) {
    std::vector<std::string> names = {program.name};
    for (const auto* command : commands_of(app)) names.push_back(program.name + "-" + command->get_name());
    names.emplace_back(program.name == "htvm" ? "htvm-lab" : "htvm");
    std::string out = ".SH \"SEE ALSO\"\n", separator;
    for (const auto& name : names) {
        if (name == but) continue;
        out += separator + "\\fB" + escaped(name) + "\\fR(1)";
        separator = ",\n";
    }
    return out + "\n";
}

}  // namespace

std::string program_page(const Program& program, const CLI::App& app) {
    std::string out = title(program.name);
    // "htvm compresses ...": in a man page a dash takes the place of the program's name.
    const auto what = program.description.substr(program.name.size() + 1);
    out += fmt::format(".SH NAME\n{} \\- {}\n", escaped(program.name), escaped(what.substr(0, what.find(": "))));
    const auto name = escaped(program.name);
    out += fmt::format(
        ".SH SYNOPSIS\n\\fB{}\\fR \\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n.br\n\\fB{}\\fR [\\fB\\-\\-help\\fR] "
        "[\\fB\\-\\-version\\fR]\n",
        name, name);
    out += ".SH DESCRIPTION\n" + paragraphs(program.description);
    out += ".SS Commands\n";
    for (const auto* command : commands_of(app))
        out += fmt::format(".TP\n\\fB{}\\-{}\\fR(1)\n{}.\n", name, escaped(command->get_name()),
                           escaped(summary_of(*command)));
    out += options_section(app);
    if (!program.footer.empty()) out += ".SH EXAMPLES\n" + paragraphs(program.footer);
    return out + exit_section() + see_also(program, app, program.name);
}

std::string command_page(const Program& program, const CLI::App& app, const CLI::App& command) {
    const auto name = program.name + "-" + command.get_name();
    std::string out = title(name);
    out += fmt::format(".SH NAME\n{} \\- {}\n", escaped(name), escaped(lower_first(summary_of(command))));
    out += fmt::format(".SH SYNOPSIS\n\\fB{} {}\\fR [\\fIOPTIONS\\fR]", escaped(program.name),
                       escaped(command.get_name()));
    for (const auto& option : option_texts(command)) {
        if (!option.place.empty())
            out += " \\fI" + escaped(option.place) + "\\fR";
        else if (option.required)
            out += fmt::format(" \\fB{}\\fR \\fI{}\\fR", escaped(option.names.front()), escaped(option.value));
    }
    const auto footer = split_footer(command.get_footer());
    const auto& description = command.get_description();
    const bool sentence = description.ends_with('.') || description.find('\n') != std::string::npos;
    out += "\n.SH DESCRIPTION\n" + paragraphs(description + (sentence ? "\n" : ".\n"));
    if (!footer.notes.empty()) out += ".PP\n" + paragraphs(footer.notes);
    out += options_section(command);
    if (!footer.examples.empty()) out += ".SH EXAMPLES\n" + paragraphs(footer.examples);
    return out + exit_section() + see_also(program, app, name);
}

}  // namespace htvm::app
