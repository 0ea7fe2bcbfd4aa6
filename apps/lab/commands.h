// The commands of htvm-lab: one file each, with one function that adds it to the parser.
#pragma once

#include "command_line/program.h"

namespace htvm::lab {

void add_decoding(CLI::App& app, app::Run& run);
void add_rd(CLI::App& app, app::Run& run);
void add_reproduce(CLI::App& app, app::Run& run);
void add_events(CLI::App& app, app::Run& run);
void add_endure(CLI::App& app, app::Run& run);
void add_bake(CLI::App& app, app::Run& run);
void add_hierarchy(CLI::App& app, app::Run& run);

}  // namespace htvm::lab
