// htvm reproduce: the paper's experiments on a capture, as one page to look at.
#pragma once

#include "commands.h"

namespace htvm::app {

void add_reproduce(CLI::App& app, Run& run);

}  // namespace htvm::app
