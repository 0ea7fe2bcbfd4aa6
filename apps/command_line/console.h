// What systems do differently with the words of a command, with the streams of a program and with the terminal.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace htvm::app {

// Once, before anything is read or written: bytes go through as they are, text is UTF-8.
void prepare_console();

// The words behind the program's name, in UTF-8.
std::vector<std::string> given_words(int argc, char** argv);

// Whether what is said on stderr is seen by somebody, and can be overwritten.
bool errors_go_to_terminal();
// How many columns the terminal has that stdout is; 0: it is none.
std::size_t columns_of_output();

// Reads what there is on standard input, or waits a tenth of a second for it: empty if nothing came. Nothing at its
// end.
struct InputPiece {
    std::size_t bytes = 0;
    bool is_end = false;
};
InputPiece read_input(std::span<char> out);

}  // namespace htvm::app
