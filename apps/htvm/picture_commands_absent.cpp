#include "commands.h"

namespace htvm::app {

std::vector<AddCommand> picture_commands() { return {}; }

}  // namespace htvm::app
