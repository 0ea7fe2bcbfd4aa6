#include "commands.h"

namespace htvm::app {

std::vector<AddCommand> video_commands() { return {add_transcode}; }

}  // namespace htvm::app
