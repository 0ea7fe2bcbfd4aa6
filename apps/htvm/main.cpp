// htvm: the command line for compressing and playing captures. Experiments have their own program: htvm-lab.
#include "commands.h"

int main(int argc, char** argv) {
    using namespace htvm::app;
    Program program;
    program.name = "htvm";
    program.description = "htvm compresses human time-varying meshes: captured 3D people, one triangle mesh per frame.";
    program.commands = {add_synth,     add_check,   add_encode, add_decode, add_info,
                        add_calibrate, add_compare, add_cut,    add_join,   add_pack};
    const auto add = [&](const std::vector<AddCommand>& commands) {
        program.commands.insert(program.commands.end(), commands.begin(), commands.end());
    };
    add(video_commands());
    add({add_index, add_verify});
    add(picture_commands());
    add({add_play, add_demo});
    add(live_commands());
    program.elsewhere = {{"rd", "htvm-lab rd"},  {"reproduce", "htvm-lab reproduce"}, {"compress", "htvm encode"},
                         {"live", "htvm serve"}, {"decompress", "htvm decode"},       {"view", "htvm play"},
                         {"watch", "htvm play"}};
    program.built_without = left_out_abilities();
    program.may_be_left_out = {
        {"still", "image files"},  {"render", "image files"},   {"transcode", "pictures of textures"},
        {"serve", "live streams"}, {"publish", "live streams"}, {"link", "live streams"}};
    program.for_files =
        "'htvm play FILE' shows it, 'htvm info FILE' tells what is in it, 'htvm encode FOLDER' compresses";
    return run_program(program, argc, argv);
}
