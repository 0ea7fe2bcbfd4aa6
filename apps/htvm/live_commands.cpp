#include "commands.h"

namespace htvm::app {

std::vector<AddCommand> live_commands() { return {add_serve, add_publish, add_link}; }

}  // namespace htvm::app
