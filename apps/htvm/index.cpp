// htvm index: the index at the beginning of a file, for any stream.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "command_line/terminal.h"
#include "commands.h"
#include "htvm/decoder.hpp"
#include "io/mesh_file.h"
#include "stream_file.h"

namespace htvm::app {
namespace {

struct Options {
    std::string input, output;
    bool bounds = false;
    DecoderOptions limits;
};

Result<void> run_index(const Options& options) {
    auto input = StreamInput::open(options.input, options.limits.max_packet_bytes);
    if (!input) return tl::unexpected(input.error());
    const auto path = options.output.empty() ? options.input : options.output;
    auto output = options.output.empty() ? StreamOutput::replace(path) : StreamOutput::open(path);
    if (!output) return tl::unexpected(output.error());
    auto settings = options.limits;
    settings.intra_coder = draco_intra_coder();
    Decoder decoder(settings);
    std::uint64_t frames = 0;
    Progress progress("index", 0);
    while (const auto packet = input->next()) {
        if (packet->kind == PacketKind::front_index) {
            if (!options.bounds) output->add_bounds_of(*packet);
            continue;
        }
        if (options.bounds) {
            const auto frame = decoder.decode(*packet);
            if (!frame) return fail(frame.error().kind, options.input + ": " + frame.error().message);
            if (*frame)
                if (const auto bounds = bounds_of((**frame).mesh.positions)) output->add_bounds(*bounds);
        }
        if (frame_type(packet->kind)) {
            ++frames;
            progress.step();
        }
        if (auto written = output->write(*packet); !written) return written;
    }
    if (auto fine = check_whole_but_for_end(*input, options.input); !fine) return fine;
    if (frames == 0) return fail(ErrorKind::corrupt_stream, options.input + " is not an htvm stream, or has no frames");
    if (auto finished = output->finish(); !finished) return finished;
    if (path == "-") return {};
    if (!output->has_index()) return fail(ErrorKind::disk_full, path + " could not be given an index");
    note(fmt::format("{}: an index of {} is at its beginning{}", path, counted(frames, "frame"),
                     output->has_bounds() ? "" : ", without their bounds, which --bounds finds by decoding them"));
    return {};
}

}  // namespace

void add_index(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand("index", "Write an index at the beginning of an .htvm file, for seeking");
    command->add_option("input", options->input, "The stream: a file, or - for standard input")
        ->type_name("FILE")
        ->required();
    command->add_option("-o,--output", options->output, "Another file (default: in place)")->type_name("FILE");
    command->add_flag("--bounds", options->bounds, "Decode all frames for their bounds (default: only an index's own)");
    add_decoder_limits(*command, options->limits);
    command->footer(
        "Files that 'htvm encode', 'cut' and 'join' write have one. Recordings whose hub was killed do not; if their "
        "end is torn,\n"
        "it is left out.\n"
        "Example:\n"
        "  htvm index recorded.htvm");
    command->callback([options, &run] {
        if (options->input == "-" && options->output.empty())
            throw CLI::ValidationError("--output", "is needed if the stream comes from standard input");
        run = [options] { return run_index(*options); };
    });
}

}  // namespace htvm::app
