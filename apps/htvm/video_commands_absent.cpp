#include "commands.h"

namespace htvm::app {

std::vector<AddCommand> video_commands() { return {}; }

}  // namespace htvm::app
