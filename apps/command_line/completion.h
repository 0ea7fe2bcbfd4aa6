// Completions for the shells: commands, options, the words that an option takes, files and folders.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace htvm::app {

std::string bash_completion(const CLI::App& program);
std::string zsh_completion(const CLI::App& program);
std::string fish_completion(const CLI::App& program);

}  // namespace htvm::app
