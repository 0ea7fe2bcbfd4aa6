// htvm join: streams one after the other as one stream, without encoding anything again.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <vector>

#include "command_line/terminal.h"
#include "commands.h"
#include "htvm/decoder.hpp"
#include "stream_file.h"
#include "stream_join.h"

namespace htvm::app {
namespace {

struct Options {
    std::vector<std::string> inputs;
    std::string output;
    AudioOptions audio;
    DecoderOptions limits;
};

// Tells what hints at a wrong order of the parts of one stream, or at one that is missing.
void tell_of_pause(const StreamJoin& join, const std::string& path) {
    if (!join.pause_seconds()) return;
    if (*join.pause_seconds() < 0)
        warn(
            fmt::format("{} is earlier than the streams before it, and its times are moved behind theirs; are the "
                        "streams in order?",
                        path));
    else
        note(fmt::format("{:.2f} s without frames lie before {}", *join.pause_seconds(), path));
}

Result<void> add_stream(StreamJoin& join, const std::string& path, const DecoderOptions& limits) {
    auto input = StreamInput::open(path, limits.max_packet_bytes);
    if (!input) return tl::unexpected(input.error());
    Decoder headers(limits);  // only checks the sequence headers
    join.begin_stream();
    while (auto packet = input->next()) {
        if (packet->kind == PacketKind::sequence)
            if (auto ok = headers.decode(*packet); !ok) return tl::unexpected(ok.error());
        if (auto ok = join.take(std::move(*packet)); !ok) return ok;
    }
    if (auto fine = check_whole_but_for_end(*input, path); !fine) return fine;
    if (!join.has_frames()) return fail(ErrorKind::corrupt_stream, path + " is not an htvm stream, or has no frames");
    tell_of_pause(join, path);
    return {};
}

Result<void> run_join(const Options& options) {
    auto output = StreamOutput::open(options.output);
    if (!output) return tl::unexpected(output.error());
    auto audio = AudioTrack::open(options.audio);
    if (!audio) return tl::unexpected(audio.error());
    if (*audio) output->lay(std::move(**audio));
    StreamJoin join(*output);
    for (const auto& input : options.inputs)
        if (auto added = add_stream(join, input, options.limits); !added) return added;
    if (auto finished = output->finish(); !finished) return finished;
    note(fmt::format("{}: {} in {}", options.output, counted(join.frames(), "frame"),
                     counted(join.sequences(), "sequence")));
    return {};
}

}  // namespace

void add_join(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand("join", "Put .htvm streams one after the other, without encoding them again");
    command->add_option("inputs", options->inputs, "The streams, in their order")
        ->type_name("FILE")
        ->required()
        ->expected(1, -1);
    command->add_option("-o,--output", options->output, "The new stream: a file, or - for standard output")
        ->type_name("FILE")
        ->required();
    add_audio_options(*command, options->audio);
    add_packet_limits(*command, options->limits);
    command->footer(
        "Streams with the same header, such as parts of one stream, become one sequence whose frames are numbered on.\n"
        "Timestamps stay as they are, unless they would not ascend; then those of the stream are moved behind the "
        "last. With --audio, sound that the streams have is left out.\n"
        "Examples:\n"
        "  htvm join part1.htvm part2.htvm -o whole.htvm\n"
        "  htvm join silent.htvm --audio sound.wav -o person.htvm");
    command->callback([options, &run] { run = [options] { return run_join(*options); }; });
}

}  // namespace htvm::app
