#include "commands.h"

namespace htvm::app {

std::vector<AddCommand> live_commands() { return {}; }

}  // namespace htvm::app
