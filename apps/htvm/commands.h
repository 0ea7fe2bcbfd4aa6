// The commands of htvm: one file each, with one function that adds it to the parser.
#pragma once

#include "command_line/program.h"

namespace htvm::app {

void add_calibrate(CLI::App& app, Run& run);
void add_check(CLI::App& app, Run& run);
void add_compare(CLI::App& app, Run& run);
void add_cut(CLI::App& app, Run& run);
void add_decode(CLI::App& app, Run& run);
void add_demo(CLI::App& app, Run& run);
void add_encode(CLI::App& app, Run& run);
void add_index(CLI::App& app, Run& run);
void add_info(CLI::App& app, Run& run);
void add_join(CLI::App& app, Run& run);
void add_link(CLI::App& app, Run& run);
void add_pack(CLI::App& app, Run& run);
void add_play(CLI::App& app, Run& run);
void add_publish(CLI::App& app, Run& run);
void add_render(CLI::App& app, Run& run);
void add_serve(CLI::App& app, Run& run);
void add_still(CLI::App& app, Run& run);
void add_synth(CLI::App& app, Run& run);
void add_transcode(CLI::App& app, Run& run);
void add_verify(CLI::App& app, Run& run);

}  // namespace htvm::app
