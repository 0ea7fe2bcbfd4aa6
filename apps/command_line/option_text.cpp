#include "command_line/option_text.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>

#include "command_line/console.h"
#include "command_line/program.h"

namespace htvm::app {
namespace {

std::vector<std::string> split(std::string_view text, char at) {
    std::vector<std::string> out;
    while (!text.empty()) {
        const auto end = std::min(text.find(at), text.size());
        out.emplace_back(text.substr(0, end));
        text.remove_prefix(std::min(text.size(), end + 1));
    }
    return out;
}

// CLI11 describes the value of an option as "TEXT:{mm,cm,m}", "INT:INT in [1 - 64]" or as set by the program: "y|z=y".
void tell_value(const CLI::Option& option, OptionText& out) {
    if (option.get_items_expected_max() == 0) return;
    const std::string type = option.get_type_name(), said = option.get_option_text();
    if (const auto words = said.substr(0, said.find('=')); words.find('|') != std::string::npos) {
        out.words = split(words, '|');
        out.value = words;
        return;
    }
    if (const auto brace = type.find(":{"); brace != std::string::npos && type.ends_with('}'))
        out.words = split(std::string_view(type).substr(brace + 2, type.size() - brace - 3), ',');
    const auto kind = type.substr(0, type.find(':'));
    if (!said.empty())
        out.value = said;
    else if (!out.words.empty())
        out.value = fmt::format("{}", fmt::join(out.words, "|"));
    else if (kind == "INT" || kind == "UINT" || kind == "FLOAT")
        out.value = "NUMBER";
    else
        out.value = kind;
}

std::string names_of(const std::set<CLI::Option*>& options) {
    std::vector<std::string> names;
    for (const auto* option : options) names.push_back("--" + option->get_lnames().at(0));
    std::sort(names.begin(), names.end());
    return fmt::format("{}", fmt::join(names, ", "));
}

// What else the parser checks.
std::string conditions_of(const CLI::Option& option) {
    std::vector<std::string> out;
    if (const auto range = range_of(option); !range.empty()) out.push_back(range);
    if (!option.get_default_str().empty()) out.push_back("default " + option.get_default_str());
    if (!option.get_needs().empty()) out.push_back("only with " + names_of(option.get_needs()));
    if (!option.get_excludes().empty()) out.push_back("not with " + names_of(option.get_excludes()));
    return fmt::format("{}", fmt::join(out, "; "));
}

// Columns of the terminal, or as COLUMNS says.
std::size_t terminal_width() {
    constexpr std::size_t usual = 100, least = 60;
    std::size_t columns = 0;
    if (const char* said = std::getenv("COLUMNS")) std::from_chars(said, said + std::strlen(said), columns);
    if (columns == 0) columns = columns_of_output();
    return columns == 0 ? usual : std::max(columns, least);
}

std::string broken(const std::string& text, std::size_t width) {
    std::string out;
    std::size_t line = 0;
    for (const auto& word : split(text, ' ')) {
        const bool fits = line + 1 + word.size() <= width;
        if (line > 0) out += fits ? ' ' : '\n';
        line = line > 0 && fits ? line + 1 + word.size() : word.size();
        out += word;
    }
    return out;
}

// Breaks text anew, which was broken for some width. Kept are the ends of lines that end a sentence or a heading, and
// indented lines, which are tables and commands.
std::string wrapped(const std::string& text, std::size_t width) {
    std::string out, paragraph;
    const auto add_line = [&](const std::string& line) { out += (out.empty() ? "" : "\n") + line; };
    const auto end_paragraph = [&] {
        if (!paragraph.empty()) add_line(broken(paragraph, width));
        paragraph.clear();
    };
    for (const auto& line : split(text, '\n')) {
        const bool kept = line.empty() || line.starts_with(' ');
        if (kept || paragraph.ends_with('.') || paragraph.ends_with(':')) end_paragraph();
        if (kept)
            add_line(line);
        else
            paragraph += (paragraph.empty() ? "" : " ") + line;
    }
    end_paragraph();
    return out;
}

// Indented lines of a description are a table.
void tell_meaning(const CLI::Option& option, OptionText& text) {
    const auto& description = option.get_description();
    const auto table = std::min(description.find("\n "), description.size());
    text.table = split(std::string_view(description).substr(table), '\n');
    if (!text.table.empty()) text.table.erase(text.table.begin());  // the end of the previous line
    auto& out = text.meaning;
    out = joined(description.substr(0, table));
    while (out.ends_with(':') || out.ends_with('.')) out.pop_back();
    if (const auto conditions = conditions_of(option); !conditions.empty()) out += "; " + conditions;
}

// The overview names what each command does in a few words; its own help has the rest. Values and conditions of options
// are named as in the man pages.
class Help : public CLI::Formatter {
protected:
    std::string make_subcommand(const CLI::App* command) const override {
        std::ostringstream out;
        CLI::detail::format_help(out, command->get_name(), wrapped(summary_of(*command), beside()), column_width_);
        return out.str();
    }
    std::string make_option_opts(const CLI::Option* option) const override {
        OptionText text;
        tell_value(*option, text);
        return (text.value.empty() ? "" : " " + text.value) + (option->get_required() ? " (required)" : "");
    }
    std::string make_option_desc(const CLI::Option* option) const override {
        const auto &meaning = option->get_description(), conditions = conditions_of(*option);
        if (conditions.empty() || meaning.empty()) return in_column(meaning + conditions);
        const auto words = meaning.substr(0, meaning.find("\n "));
        return in_column(words + " (" + conditions + ")" + meaning.substr(words.size()));
    }
    std::string make_description(const CLI::App* app) const override { return filled(app->get_description()) + "\n"; }
    std::string make_footer(const CLI::App* app) const override {
        return app->get_footer().empty() ? "" : filled(app->get_footer()) + "\n";
    }

    // The space beside the column of flags.
    std::size_t beside() const { return width_ - column_width_; }
    std::string filled(const std::string& text) const { return wrapped(text, width_); }
    std::string in_column(const std::string& meaning) const {
        const auto table = std::min(meaning.find("\n "), meaning.size());
        return broken(joined(meaning.substr(0, table)), beside()) + meaning.substr(table);
    }

private:
    std::size_t width_ = terminal_width();
};

// Few options, in the page's order and words.
class FrontPageHelp : public Help {
public:
    explicit FrontPageHelp(FrontPage page) : page_(std::move(page)) {}

private:
    std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode) const override {
        return make_description(app) + make_usage(app, std::move(name)) + make_positionals(app) + make_flags(app) +
               "\n" + make_footer(app);
    }
    std::string make_flags(const CLI::App* app) const {
        std::vector<const CLI::Option*> flags;
        for (const auto& entry : page_.options) {
            const auto* option = app->get_option(entry.option);
            if (option->nonpositional()) flags.push_back(option);
        }
        flags.push_back(app->get_option("--help"));
        return make_group("Options", false, std::move(flags));
    }
    std::string make_option_desc(const CLI::Option* option) const override {
        for (const auto& entry : page_.options)
            if (!entry.meaning.empty() && option->check_name(entry.option)) return in_column(entry.meaning);
        return Help::make_option_desc(option);
    }
    std::string make_footer(const CLI::App* app) const override {
        const auto more = static_cast<std::size_t>(std::ranges::count_if(
            app->get_options(), [&](const CLI::Option* option) { return option->nonpositional() && !shows(*option); }));
        const auto& footer = page_.footer.empty() ? app->get_footer() : page_.footer;
        return filled(fmt::format("{}{}--help-all shows {} more options, by what they are for.", footer,
                                  footer.empty() ? "" : "\n", more)) +
               "\n";
    }
    bool shows(const CLI::Option& option) const {
        return option.check_name("--help") || option.check_name("--help-all") ||
               std::ranges::any_of(page_.options, [&](const auto& entry) { return option.check_name(entry.option); });
    }

    FrontPage page_;
};

}  // namespace

std::shared_ptr<CLI::FormatterBase> help_formatter() { return std::make_shared<Help>(); }

std::shared_ptr<CLI::FormatterBase> front_page_formatter(FrontPage page) {
    return std::make_shared<FrontPageHelp>(std::move(page));
}

std::vector<OptionText> option_texts(const CLI::App& command) {
    std::vector<OptionText> out;
    for (const auto* option : command.get_options()) {
        if (option->get_group().empty()) continue;
        OptionText text;
        for (const auto& name : option->get_snames()) text.names.push_back("-" + name);
        for (const auto& name : option->get_lnames()) text.names.push_back("--" + name);
        if (option->get_positional()) text.place = option->get_name(true);
        tell_value(*option, text);
        text.heading = option->get_group();
        tell_meaning(*option, text);
        text.required = option->get_required();
        out.push_back(std::move(text));
    }
    return out;
}

std::string range_of(const CLI::Option& option) {
    const std::string type = option.get_type_name();
    const auto range = type.find(" in [");
    if (range == std::string::npos || !type.ends_with(']')) return {};
    auto limits = type.substr(range + 5, type.size() - range - 6);
    if (const auto dash = limits.find(" - "); dash != std::string::npos) limits.replace(dash, 3, " to ");
    return limits;
}

std::vector<const CLI::App*> commands_of(const CLI::App& program) {
    return program.get_subcommands([](const CLI::App*) { return true; });
}

std::string summary_of(const CLI::App& command) {
    const auto text = joined(command.get_description());
    return text.substr(0, std::min({text.find(": "), text.find(". "), text.find("; ")}));
}

std::string joined(const std::string& text) {
    std::string out;
    for (const auto& line : split(text, '\n')) {
        const auto begin = line.find_first_not_of(' ');
        if (begin == std::string::npos) continue;
        if (!out.empty()) out += ' ';
        out += line.substr(begin);
    }
    return out;
}

}  // namespace htvm::app
