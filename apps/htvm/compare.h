// htvm compare: the metrics of a decoded sequence against its original.
#pragma once

#include "commands.h"

namespace htvm::app {

void add_compare(CLI::App& app, Run& run);

}  // namespace htvm::app
