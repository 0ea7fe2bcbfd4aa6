// htvm transcode: the pictures of a stream by another coder, for browsers that do not decode its own; meshes and sound
// stay as they are, byte for byte.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>

#include "command_line/choice.h"
#include "command_line/terminal.h"
#include "commands.h"
#include "htvm/decoder.hpp"
#include "htvm/encoder_options.hpp"
#include "picture_track.h"
#include "picture_transcoding.h"
#include "stream_file.h"

namespace htvm::app {
namespace {

namespace fs = std::filesystem;

constexpr std::array coders = {
    Choice<PictureCoder>{"h264", PictureCoder::h264},
    Choice<PictureCoder>{"vp9", PictureCoder::vp9},
    Choice<PictureCoder>{"av1", PictureCoder::av1},
};

struct Options {
    std::string input, output;
    PictureCoder coder = PictureCoder::h264;
    std::optional<double> quality;
    std::string ffmpeg = "ffmpeg";
    DecoderOptions limits;
};

// The sibling that the player looks for: NAME.h264.htvm beside NAME.htvm.
std::string sibling_of(const fs::path& stream, PictureCoder coder) {
    return (stream.parent_path() /
            (stream.stem().string() + "." + word_of(coder, coders) + stream.extension().string()))
        .string();
}

// One reading of the whole stream, which is written if there is somewhere to.
Result<PictureTranscoding::Totals> pass(const Options& options, double quantiser, StreamOutput* output) {
    auto input = StreamInput::open(options.input, options.limits.max_packet_bytes);
    if (!input) return tl::unexpected(input.error());
    if (input->is_live()) return fail(ErrorKind::bad_input, options.input + " is a live stream; files are coded anew");
    std::optional<PictureTranscoding> pictures;
    Decoder headers(options.limits);
    std::uint64_t frames = 0;
    Progress progress(output ? "transcoding" : "looking for the quality", 0);
    const auto put = [&](const Result<std::vector<Packet>>& packets) -> Result<void> {
        if (!packets) return fail(packets.error().kind, options.input + ": " + packets.error().message);
        if (!output) return {};
        for (const auto& packet : *packets)
            if (auto written = output->write(packet); !written) return written;
        return {};
    };
    while (auto packet = input->next()) {
        if (output) output->add_bounds_of(*packet);
        if (packet->kind == PacketKind::front_index || packet->kind == PacketKind::index) continue;
        if (packet->kind == PacketKind::sequence && !pictures) {
            if (auto read = headers.decode(*packet); !read) return tl::unexpected(read.error());
            const auto& header = *headers.sequence();
            pictures.emplace(PictureTranscodingOptions{
                options.coder, quantiser,
                static_cast<double>(header.fps_numerator) / std::max(header.fps_denominator, 1u), options.ffmpeg});
        }
        if (frame_type(packet->kind)) {
            ++frames;
            progress.step();
        }
        if (!pictures) continue;  // nothing can be decoded before a header
        if (auto taken = put(pictures->take(std::move(*packet))); !taken) return tl::unexpected(taken.error());
    }
    if (auto fine = check_whole(*input, options.input); !fine) return tl::unexpected(fine.error());
    if (frames == 0 || !pictures)
        return fail(ErrorKind::corrupt_stream, options.input + " is not an htvm stream, or has no frames");
    if (auto finished = put(pictures->finish()); !finished) return tl::unexpected(finished.error());
    if (pictures->totals().pictures == 0)
        return fail(ErrorKind::bad_input, options.input + " has no pictures, so every browser shows it");
    return pictures->totals();
}

// How many bits a coder takes for what AV1 in files shows with one (docs/experiments/every_browser.md).
double bits_for_one(PictureCoder coder) { return coder == PictureCoder::av1 ? 1.0 : 1.5; }

// H.264's quantiser for the same SSIM as AV1's of a quality.
double h264_quantiser_of(double quality) { return std::clamp(40 - 0.26 * quality, 0.0, 51.0); }

double quantiser_of_quality(const Options& options, double quality) {
    return options.coder == PictureCoder::h264
               ? h264_quantiser_of(quality)
               : quantiser_of(options.coder, quality, /*foresees=*/options.coder == PictureCoder::av1);
}

// The quantiser at which pictures take as many bits as they need to look as they did: nothing says how fine the
// stream's own are but their bits.
Result<double> quantiser_by_bits(const Options& options) {
    constexpr double finest = 1, coarsest[] = {51, 63};
    constexpr double tolerance = 0.1, usual_slope = -1.0 / 7;  // log2 of bits, a step of the quantiser
    constexpr int most_passes = 3;
    double quantiser = quantiser_of_quality(options, default_quality);
    std::optional<std::pair<double, double>> before;
    for (int number = 0; number < most_passes; ++number) {
        const auto totals = pass(options, quantiser, nullptr);
        if (!totals) return tl::unexpected(totals.error());
        const double off = std::log2(static_cast<double>(totals->bytes) /
                                     (bits_for_one(options.coder) * static_cast<double>(totals->bytes_before)));
        if (std::abs(off) < std::log2(1 + tolerance)) break;
        double slope = usual_slope;
        if (before && std::abs(quantiser - before->first) > 0.5)
            slope = std::clamp((off - before->second) / (quantiser - before->first), -0.4, -0.04);
        before = {quantiser, off};
        quantiser = std::clamp(quantiser - off / slope, finest, coarsest[options.coder == PictureCoder::h264 ? 0 : 1]);
        if (quantiser == before->first) break;
    }
    return quantiser;
}

Result<void> run_transcode(Options options) {
    const bool is_sibling = options.output.empty();
    if (is_sibling) options.output = sibling_of(options.input, options.coder);
    // Before the passes, so that a place that cannot be written to does not cost them.
    auto output = StreamOutput::open(options.output);
    if (!output) return tl::unexpected(output.error());
    const auto quantiser =
        options.quality ? Result<double>(quantiser_of_quality(options, *options.quality)) : quantiser_by_bits(options);
    if (!quantiser) return tl::unexpected(quantiser.error());
    const auto totals = pass(options, *quantiser, &*output);
    if (!totals) return tl::unexpected(totals.error());
    if (auto finished = output->finish(); !finished) return finished;
    if (options.output == "-") return {};
    note(fmt::format("{}: {} as {}, {} bytes in place of {}", options.output, counted(totals->pictures, "picture"),
                     name_of(options.coder), totals->bytes, totals->bytes_before));
    if (is_sibling)
        note(fmt::format("beside {}, the player takes it in browsers that do not decode the other's pictures",
                         fs::path(options.input).filename().string()));
    return {};
}

}  // namespace

void add_transcode(CLI::App& app, Run& run) {
    auto options = std::make_shared<Options>();
    auto* command = app.add_subcommand(
        "transcode", "Code the pictures of a stream anew, for browsers that do not decode them as they are");
    command->add_option("input", options->input, "The stream: a file (.htvm, .mp4 or .m3u8)")
        ->type_name("FILE")
        ->required();
    command
        ->add_option("-o,--output", options->output,
                     "The new stream (default: NAME.h264.htvm beside NAME.htvm, where the player looks for it)")
        ->type_name("FILE");
    add_choice(*command, "--texture-codec", options->coder, coders,
               "h264 (default), which the program ffmpeg codes by its libx264; vp9; or av1");
    command
        ->add_option("--texture-quality", options->quality,
                     "Of the pictures, 0 to 100, as htvm encode has it (default: as they are, by the bits that the "
                     "new coder needs for it)")
        ->check(CLI::Range(0.0, 100.0))
        ->type_name("NUMBER");
    command->add_option("--ffmpeg", options->ffmpeg, "The ffmpeg program (default: ffmpeg, found as the shell does)")
        ->type_name("FILE");
    add_packet_limits(*command, options->limits);
    command->footer(
        "Meshes and sound are copied, byte for byte. H.264 is for browsers alone: 'htvm decode', 'still' and 'render'\n"
        "take the stream that it was made of.\n"
        "Examples:\n"
        "  htvm transcode person.htvm\n"
        "  htvm transcode person.htvm --texture-codec vp9");
    command->callback([options, &run] {
        if (options->input == "-") throw CLI::ValidationError("input", "is read several times: give a file");
        if (options->output.empty() && !is_stream_name(options->input))
            throw CLI::ValidationError("--output", "is needed, as the input's name says no kind of file");
        run = [options] { return run_transcode(*options); };
    });
}

}  // namespace htvm::app
