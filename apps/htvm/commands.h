// The commands of htvm: one file each, with one function that adds it to the parser.
#pragma once

#include <string>
#include <vector>

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

// Those of an ability that a build may leave out (cmake/abilities.cmake): none where it is.
std::vector<AddCommand> video_commands();    // transcode: pictures of textures
std::vector<AddCommand> picture_commands();  // still, render: image files
std::vector<AddCommand> live_commands();     // serve, publish, link: live streams
// What this program was built without, as cmake/abilities.cmake calls it.
std::vector<std::string> left_out_abilities();

}  // namespace htvm::app
