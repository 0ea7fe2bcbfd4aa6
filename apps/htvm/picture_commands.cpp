#include "commands.h"

namespace htvm::app {

std::vector<AddCommand> picture_commands() { return {add_still, add_render}; }

}  // namespace htvm::app
