#include "rd_coders.h"

#include <fmt/core.h>

#include <cmath>
#include <memory>

#include "htvm/decoder.hpp"
#include "rd_stopwatch.h"

namespace htvm::lab {
namespace {

struct Codec {
    Encoder encoder;
    Decoder decoder;
    unsigned threads = 1;
};

// All packets of the frame just pushed. Bytes that are not the frame's own (the sequence header, with the first one)
// count as overhead.
Result<CodedFrame> decode_pending(Codec& codec) {
    CodedFrame out;
    out.decode_ms = 0;
    out.type = codec.encoder.last_frame().type;
    out.bytes = codec.encoder.last_frame().bytes;
    std::size_t sent = 0;
    while (auto packet = codec.encoder.pull()) {
        sent += packet->payload.size() + packet_overhead;
        const Stopwatch watch(codec.threads);
        auto frame = codec.decoder.push(*packet);
        *out.decode_ms += watch.milliseconds();
        if (!frame) return tl::unexpected(frame.error());
        if (*frame) out.decoded = std::move((*frame)->mesh);
    }
    out.bytes.overhead += sent - out.bytes.total();
    return out;
}

Result<FrameCoder> start_codec(EncoderOptions options, const SequenceFacts& facts, const QualityPoint& quality) {
    options.geometry_step = quality.geometry_step;
    options.colour_step = quality.colour_step;
    options.threads = quality.threads;
    options.fps_numerator = static_cast<std::uint32_t>(std::lround(facts.fps * 1000));
    options.fps_denominator = 1000;
    options.skeleton = facts.skeleton;
    options.radii = facts.radii;
    auto encoder = Encoder::create(options);
    if (!encoder) return tl::unexpected(encoder.error());
    DecoderOptions decoder_options;
    decoder_options.threads = quality.threads;
    auto codec = std::make_shared<Codec>(Codec{std::move(*encoder), Decoder(decoder_options), quality.threads});
    return FrameCoder([codec](const SourceFrame& frame) -> Result<CodedFrame> {
        const Stopwatch watch(codec->threads);
        const auto pushed = codec->encoder.push(frame.mesh, frame.pose ? &*frame.pose : nullptr, frame.timestamp_us);
        const double encode_ms = watch.milliseconds();
        if (!pushed) return tl::unexpected(pushed.error());
        auto coded = decode_pending(*codec);
        if (coded) coded->encode_ms = encode_ms;
        return coded;
    });
}

const char* choice_name(FrameChoice choice) {
    switch (choice) {
        case FrameChoice::fixed:
            return "fixed";
        case FrameChoice::motion:
            return "motion";
        case FrameChoice::rate_distortion:
            return "rd";
    }
    return "?";
}

}  // namespace

QualityPoint quality_point(double quality) {
    const auto steps = quality_steps(quality);
    QualityPoint out;
    out.quality = quality;
    out.geometry_step = steps.geometry_step;
    out.colour_step = std::round(steps.colour_step);  // as the encoder does
    return out;
}

CoderUnderTest codec_under_test(const std::string& name, const std::string& description,
                                const EncoderOptions& options) {
    CoderUnderTest out;
    out.name = name;
    out.description = description;
    out.settings =
        fmt::format("keyint {}, reference {}, registration {}, weights {}, lambda {}, nearest {}", options.key_interval,
                    options.topology.reference_vertices == ReferenceVertices::bone ? "bone" : "any",
                    options.topology.point_to_plane ? "plane" : "point", options.topology.weight_width, options.lambda,
                    options.topology.nearest_vertices);
    if (options.profile == Profile::tracked)
        out.settings += fmt::format(", tracked from {}, nodes {}, simplify {}",
                                    options.tracked.references == TrackedReferences::intra ? "I" : "the frame before",
                                    options.tracked.node_spacing, options.tracked.simplify);
    out.settings +=
        fmt::format(", {}, P below {}, I above {}, still below {}, animation error {}{}",
                    choice_name(options.topology.frame_choice), options.topology.predicted_below,
                    options.topology.intra_above, options.topology.still_below, options.topology.animation_error,
                    options.topology.scene_changes ? "" : ", no scene changes");
    out.start = [options](const SequenceFacts& facts, const QualityPoint& quality) {
        return start_codec(options, facts, quality);
    };
    return out;
}

EncoderOptions paper_options(int key_interval) {
    EncoderOptions out = default_options(Profile::paper);
    out.key_interval = key_interval;
    return out;
}

std::vector<CoderUnderTest> built_in_coders(int key_interval) {
    EncoderOptions ours = default_options(Profile::topology);
    ours.key_interval = key_interval;
    EncoderOptions motion = ours;
    motion.topology.still_below = default_still_below;
    EncoderOptions chosen = ours;
    chosen.topology.frame_choice = FrameChoice::rate_distortion;
    EncoderOptions tracked = default_options(Profile::tracked);
    tracked.key_interval = key_interval;
    EncoderOptions intra = ours;
    intra.key_interval = 1;
    return {
        codec_under_test("paper",
                         "I- and EP-frames with the paper's choices: reference vertices by bone, point to point",
                         paper_options(key_interval)),
        codec_under_test(
            "htvm-ep",
            "I- and EP-frames as of htvm encode --profile topology: reference vertices anywhere, point to plane", ours),
        codec_under_test("htvm-motion",
                         "htvm-ep with motion-based coding: what fits the capture is animated, not coded", motion),
        codec_under_test("htvm-rd", "I-, EP- and P-frames chosen by measured bits and errors; slow", chosen),
        codec_under_test("htvm-t", "I- and T-frames, as htvm encode makes them: a mesh laid on each frame's surface",
                         tracked),
        codec_under_test("tfan", "our TFAN alone: every frame an I-frame", intra),
        draco_under_test("draco10", 10),
        draco_under_test("draco7", 7)};
}

}  // namespace htvm::lab
