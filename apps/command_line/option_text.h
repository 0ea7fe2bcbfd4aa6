// What a parser's options are called and take: for man pages and for the shells' completions.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace htvm::app {

struct OptionText {
    std::vector<std::string> names;  // "-o", "--output"; empty: given by its place alone
    std::string place;               // the name of what is given by its place; "": nothing is
    std::string value;               // "NUMBER", "FILE", "FOLDER", "mm|cm|m"; "": it takes none
    std::vector<std::string> words;  // what the value may be, where that is one of some words
    std::string heading;             // of its group
    std::string meaning;             // in sentences, on one line
    std::vector<std::string> table;  // lines that explain it further, as they stand
    bool required = false;
};

// Of the program itself or of one of its commands, in the order of the help; hidden ones are left out.
std::vector<OptionText> option_texts(const CLI::App& command);
std::vector<const CLI::App*> commands_of(const CLI::App& program);

// The first clause of the description: what the command does, in a few words.
std::string summary_of(const CLI::App& command);

// Lines that were broken for the terminal, joined.
std::string joined(const std::string& text);

}  // namespace htvm::app
