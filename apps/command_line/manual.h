// Man pages, for section 1: one for the program, one for each of its commands.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace htvm::app {

struct Program;

std::string program_page(const Program& program, const CLI::App& app);
std::string command_page(const Program& program, const CLI::App& app, const CLI::App& command);

}  // namespace htvm::app
