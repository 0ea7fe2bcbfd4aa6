// htvm pack: a stream in another kind of file, without encoding anything again.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "command_line/terminal.h"
#include "commands.h"
#include "htvm/decoder.hpp"
#include "segment_folder.h"
#include "stream_file.h"

namespace htvm::app {
namespace {

struct Options {
    std::string input, output;
    Mp4Options mp4;
    SegmentOptions segments;
    HubTrust trust;
    DecoderOptions limits;
};

// Segments as the packets come, so that a live stream can be watched by its playlist.
Result<void> run_segments(const Options& options, StreamInput& input) {
    auto settings = options.segments;
    settings.is_live = input.is_live() || settings.window_seconds > 0;
    SegmentFolder folder(options.output, settings);
    std::uint64_t frames = 0;
    Progress progress("packing", 0);
    while (auto packet = input.next()) {
        if (packet->kind == PacketKind::index) continue;
        if (frame_type(packet->kind)) {
            ++frames;
            progress.step();
        }
        if (auto written = folder.write(std::move(*packet)); !written) return written;
    }
    const auto fine = check_whole(input, options.input);
    if (!fine && !input.is_live()) return fine;
    if (frames == 0) return fail(ErrorKind::corrupt_stream, options.input + " is not an htvm stream, or has no frames");
    if (auto finished = folder.finish(); !finished) return finished;
    note(fmt::format("{}: {} in {}, {} bytes", options.output, counted(frames, "frame"),
                     counted(folder.segments(), "segment"), folder.bytes()));
    return fine;
}

Result<void> run_pack(const Options& options) {
    auto input = StreamInput::open(options.input, options.limits.max_packet_bytes, options.trust);
    if (!input) return tl::unexpected(input.error());
    if (is_playlist_name(options.output)) return run_segments(options, *input);
    auto output = StreamOutput::open(options.output);
    if (!output) return tl::unexpected(output.error());
    output->set(options.mp4);
    std::uint64_t frames = 0;
    Progress progress("packing", 0);
    while (const auto packet = input->next()) {
        output->add_bounds_of(*packet);
        if (packet->kind == PacketKind::front_index) continue;
        if (frame_type(packet->kind)) {
            ++frames;
            progress.step();
        }
        if (auto written = output->write(*packet); !written) return written;
    }
    if (auto fine = check_whole(*input, options.input); !fine) return fine;
    if (frames == 0) return fail(ErrorKind::corrupt_stream, options.input + " is not an htvm stream, or has no frames");
    if (auto finished = output->finish(); !finished) return finished;
    if (options.output != "-")
        note(fmt::format("{}: {}, {} bytes", options.output, counted(frames, "frame"), output->bytes()));
    return {};
}

}  // namespace

void add_pack(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand(
        "pack", "Put a stream into an .mp4 or segments for HTTP, or back, without encoding it again");
    command
        ->add_option("input", options->input,
                     "The stream: a file (.htvm, .mp4 or .m3u8), - for standard input, or a live one: "
                     "ws://HOST:PORT/watch/NAME")
        ->type_name("FILE")
        ->required();
    command
        ->add_option("-o,--output", options->output,
                     "The new file, whose ending says of which kind it is: .mp4, .htvm or .m3u8, which is a playlist\n"
                     "of segments that are written beside it; or - for standard output")
        ->type_name("FILE")
        ->required();
    auto* fragmented = command->add_flag("--fragmented", options->mp4.fragmented,
                                         "An .mp4 in fragments, each with the tables of its own samples");
    command
        ->add_option("--fragment", options->mp4.fragment_seconds,
                     "Seconds that a fragment lasts at least: it ends where players can start (default 2)")
        ->check(CLI::Range(0.1, 60.0))
        ->needs(fragmented);
    command
        ->add_option(
            "--segment", options->segments.seconds,
            "Of a playlist: seconds that a segment lasts at least; it ends where players can start (default 2)")
        ->check(CLI::Range(0.1, 60.0));
    command
        ->add_option("--window", options->segments.window_seconds,
                     "Of a playlist: seconds of the stream that it keeps; older segments are removed (default: all)")
        ->check(CLI::Range(1.0, 1e6));
    add_hub_trust(*command, options->trust);
    add_packet_limits(*command, options->limits);
    command->footer(
        "Every command reads .mp4 as it reads .htvm, and 'encode', 'cut' and 'join' write one where the output's name\n"
        "ends in .mp4. In it, pictures are an ordinary track of AV1 or VP9 and sound one of Opus, which other tools "
        "play;\n"
        "meshes are a track of their own (docs/mp4.md). A stream that was packed comes back as it was, byte for byte.\n"
        "Examples:\n"
        "  htvm pack person.htvm -o person.mp4\n"
        "  htvm pack person.htvm -o www/person.m3u8\n"
        "  htvm pack ws://localhost:8080/watch/anna -o www/anna.m3u8 --window 60\n"
        "  htvm pack person.mp4 -o person.htvm");
    command->callback([options, &run] { run = [options] { return run_pack(*options); }; });
}

}  // namespace htvm::app
