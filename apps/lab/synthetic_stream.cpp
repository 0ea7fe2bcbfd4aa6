#include "synthetic_stream.h"

#include <fmt/core.h>

#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "metrics/recoded_area.h"

namespace htvm::lab {
namespace {

EncoderOptions encoder_options(const SyntheticOptions& options) {
    EncoderOptions out = default_options(Profile::tracked);
    const auto steps = quality_steps(options.quality);
    out.geometry_step = steps.geometry_step;
    out.colour_step = std::round(steps.colour_step);
    if (options.key_interval > 0) out.key_interval = options.key_interval;
    out.tracked.denoise = options.denoise;
    out.threads = options.threads;
    out.fps_numerator = static_cast<std::uint32_t>(std::lround(options.synth.fps * 1000));
    out.fps_denominator = 1000;
    return out;
}

DecoderOptions decoder_options(const SyntheticOptions& options) {
    DecoderOptions out;
    out.threads = options.threads;
    return out;
}

}  // namespace

void add_synthetic_options(CLI::App& command, SyntheticOptions& o) {
    std::map<std::string, SynthMotion> motions;
    for (const auto& [motion, name] : synth_motions) motions[name] = motion;
    command.add_option("--motion", o.synth.motion, "What the person does, as for htvm synth (default fast)")
        ->transform(CLI::CheckedTransformer(motions, CLI::ignore_case))
        ->option_text("tour|calm|everyday|fast");
    command.add_option("--people", o.synth.people, "2: a second person moves beside; not in the tour (default 1)")
        ->check(CLI::Range(1, 2));
    command.add_option("--vertices", o.synth.vertices, "Vertices of a captured frame, within 3 %")
        ->check(CLI::Range(150, 2000000))
        ->capture_default_str();
    command.add_option("--fps", o.synth.fps, "Frames per second")
        ->check(CLI::Range(0.1, 1000.0))
        ->capture_default_str();
    command.add_option("--seed", o.synth.seed, "Seed of the noise, the sampling and the order of moves")
        ->capture_default_str();
    command.add_option("--first-frame", o.first_frame, "Where in the motion it begins (default 0)")
        ->check(CLI::Range(0, 1000000));
    command.add_option("-q,--quality", o.quality, "Quality, as for htvm encode")
        ->check(CLI::Range(0.0, 100.0))
        ->capture_default_str();
    command.add_option("--keyint", o.key_interval, "Frames from one I-frame to the next (default 300)")
        ->check(CLI::Range(1, 1000000));
    const std::map<std::string, Denoising> denoising = {{"auto", Denoising::automatic}, {"off", Denoising::off}};
    command
        .add_option("--denoise", o.denoise, "Whether the noise is left out: auto (default) or off, as for htvm encode")
        ->transform(CLI::CheckedTransformer(denoising))
        ->option_text("auto|off");
    command.add_option("--threads", o.threads, "Threads to use; 0: one per core (default 1); the result is the same");
}

SyntheticStream::SyntheticStream(const SyntheticOptions& options, std::vector<SurfaceMark> marks, Encoder encoder)
    : options_(options),
      marks_(std::move(marks)),
      pool_(options.threads),
      encoder_(std::move(encoder)),
      decoder_(decoder_options(options)) {}

Result<SyntheticStream> SyntheticStream::start(const SyntheticOptions& options, std::vector<SurfaceMark> marks) {
    if (const auto ok = check_synth_options(options.synth); !ok) return tl::unexpected(ok.error());
    auto encoder = Encoder::create(encoder_options(options));
    if (!encoder) return tl::unexpected(encoder.error());
    return SyntheticStream(options, std::move(marks), std::move(*encoder));
}

Result<SyntheticFrame> SyntheticStream::next(bool with_truth) {
    SyntheticFrame out;
    out.number = options_.first_frame + made_;
    auto made = synth_frame(options_.synth, out.number, pool_.threads());
    const auto pushed = encoder_.push(made.mesh, nullptr, std::llround(1e6 * made_ / options_.synth.fps));
    if (!pushed) return fail(pushed.error().kind, fmt::format("frame {}: {}", out.number, pushed.error().message));
    ++made_;
    bool shown = false;
    while (auto packet = encoder_.pull()) {
        out.bytes += packet->payload.size() + packet_overhead;
        auto frame = decoder_.decode_copy(*packet);
        if (!frame) return tl::unexpected(frame.error());
        if (!*frame) continue;
        const auto told = inspect(*packet);
        if (!told) return tl::unexpected(told.error());
        shown = true;
        out.type = told->type;
        out.renewal = out.type == FrameType::intra && packet->has(packet_flag::flags_valid) &&
                      packet->has(packet_flag::of_tracked_mesh);
        out.topology = (*frame)->topology;
        out.decoded = std::move((*frame)->mesh);
        out.kept_triangles = kept_triangles(view_of(out.decoded), *told);
        out.recoded = recoded_share(view_of(out.decoded), *told);
    }
    if (!shown) return fail(ErrorKind::corrupt_stream, fmt::format("frame {} gave no packet to decode", out.number));
    if (with_truth) out.truth = true_frame(options_.synth, marks_, out.number, pool_.threads());
    out.surface = std::move(made.mesh);
    out.surface.positions = std::move(made.true_positions);
    out.surface.normals.clear();
    return out;
}

}  // namespace htvm::lab
