// The names and values of a parser's options, for help, man pages and shell completions.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
class FormatterBase;
}  // namespace CLI

namespace htvm::app {

struct FrontPage;

struct OptionText {
    std::vector<std::string> names;  // "-o", "--output"; empty: given by position only
    std::string place;               // name of the positional argument; "": none
    std::string value;               // "NUMBER", "FILE", "FOLDER", "mm|cm|m"; "": it takes none
    std::vector<std::string> words;  // the possible values, if they are words
    std::string heading;             // of its group
    std::string meaning;             // in sentences, on one line
    std::vector<std::string> table;  // further lines of explanation, verbatim
    bool required = false;
};

// The options of the program itself or of one of its commands, in the order of the help, without hidden ones.
std::vector<OptionText> option_texts(const CLI::App& command);
std::vector<const CLI::App*> commands_of(const CLI::App& program);

// The numbers that an option takes: "0 to 100"; empty where any will do.
std::string range_of(const CLI::Option& option);

// Lays out --help for the width of the terminal (or COLUMNS), with the same words for values as the man pages.
std::shared_ptr<CLI::FormatterBase> help_formatter();
// The same for a front page (program.h), which lists few options.
std::shared_ptr<CLI::FormatterBase> front_page_formatter(FrontPage page);

// The first clause of the description: what the command does, in a few words.
std::string summary_of(const CLI::App& command);

// Joins lines that were broken for the terminal.
std::string joined(const std::string& text);

}  // namespace htvm::app
