// htvm-lab: experiments with the coders, ours and others. Captures are compressed and played with htvm.
#include "commands.h"

int main(int argc, char** argv) {
    using namespace htvm::lab;
    htvm::app::Program program;
    program.name = "htvm-lab";
    program.description =
        "htvm-lab measures coders of human time-varying meshes on a capture: ours, others', published ones.";
    program.footer =
        "Begin with a capture: a folder of meshes, one per frame, or a synthetic one by 'htvm synth'.\n"
        "  htvm-lab rd CAPTURE -o out/rd              rates and errors of coders at several qualities\n"
        "  htvm-lab decoding STREAM                   how long each frame takes to decode\n"
        "  htvm-lab reproduce CAPTURE -o out/report   the published experiments, as one page to look at\n"
        "  htvm-lab bake CAPTURE -o out/baked         a textured capture's pictures in the layout of a stream's "
        "charts\n"
        "  htvm-lab hierarchy CAPTURE                 a base mesh with levels of displacements beside I-frames\n"
        "Or with nothing at all: they make a synthetic one, whose truth is known.\n"
        "  htvm-lab events --motion fast              whether hands and feet are followed\n"
        "  htvm-lab endure --minutes 5                whether anything grows with time";
    program.commands = {add_rd, add_decoding, add_reproduce, add_events, add_endure, add_bake, add_hierarchy};
    for (const char* name : {"synth", "encode", "decode", "info", "calibrate", "compare"})
        program.elsewhere[name] = std::string("htvm ") + name;
    return run_program(program, argc, argv);
}
