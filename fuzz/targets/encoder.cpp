// The encoder with any meshes, poses and options: must give an error, or packets that decode to exactly what it
// promised.
#include "htvm/encoder.hpp"

#include <array>
#include <cstring>
#include <limits>

#include "any_capture.h"
#include "import_mesh.h"
#include "whole_decoder.h"

namespace {

using namespace htvm;
using fuzz::require;

EncoderOptions any_options(fuzz::FuzzInput& input) {
    const std::uint8_t what = input.u8();
    const bool tracked = (what & 8) != 0;
    EncoderOptions out = default_options(tracked ? Profile::tracked : Profile::topology);
    out.threads = 1;
    constexpr std::array steps = {2.0, 0.05, 0.5, 8.0, 30.0, 1000.0, 1.0 / 65536, -1.0};
    constexpr std::array colour_steps = {6.0, 1.0, 20.0, 255.0};
    constexpr std::array lambdas = {0.12, 0.0, 2.0, 1000.0};
    out.geometry_step = steps[input.below(8)];
    out.colour_step = colour_steps[input.below(4)];
    out.lambda = lambdas[input.below(4)];
    out.key_interval = static_cast<int>(input.below(6));
    out.least_key_interval = 1 + (what & 1);
    if (tracked) {
        if (what & 32) out.tracked.references = TrackedReferences::intra;
        if (what & 64) out.tracked.denoise = Denoising::off;
        out.tracked.node_spacing = 1 + 20 * input.u8();
        out.tracked.simplify = input.below(4) * 0.4;
        if (what & 128) out.tracked.group = static_cast<int>(input.below(10));
    } else {
        out.topology.scene_changes = (what & 2) != 0;
        out.topology.merge_duplicates = (what & 4) != 0;
        if (what & 16) out.topology.registration = BoneRegistration::point;
        if (what & 64) out.topology.reference_vertices = ReferenceVertices::bone;
        out.topology.frame_choice = static_cast<FrameChoice>(input.below(3));
        out.topology.still_below = input.below(3) * 100;
        out.topology.animation_error = input.below(3) * 5;
        if (out.topology.frame_choice == FrameChoice::motion) {
            out.topology.predicted_below = input.below(4) * 400;
            out.topology.intra_above = input.below(3) * 800;
        }
        out.topology.nearest_vertices = static_cast<int>(input.below(66));
        out.topology.weight_width = input.below(4) * 25;
    }
    out.lattice_bits = static_cast<int>(input.below(18));
    const std::uint8_t control = input.u8();
    if (control > 220) out.rate.bits_per_second = 1000.0 * control * input.u8();
    if (control < 20) out.rate.target_error = 0.1 * input.u8();
    if (control % 4 == 1) out.latency_frames = static_cast<int>(input.below(3));
    return out;
}

void check_options(EncoderOptions options, const fuzz::AnyCapture& capture) {
    options.skeleton = capture.skeleton;
    auto encoder = Encoder::create(options);
    if (!encoder) return;
    DecoderOptions limits;
    limits.threads = 1;
    Decoder decoder(limits);
    // coded: how many frames the last call coded.
    const auto decode = [&](std::size_t coded) {
        std::size_t frames = 0;
        while (const auto packet = encoder->pull()) {
            const auto packets = fuzz::read_packets(write_packet(*packet), 1 << 20);
            require(packets.size() == 1, "a written packet can be read");
            const auto frame = decoder.decode_copy(packets[0]);
            if (!frame) std::cerr << frame.error().message << '\n';
            require(frame.has_value(), "what the encoder sends can be decoded");
            if (!*frame) continue;
            fuzz::require_sound((*frame)->mesh, limits);
            require(frames < coded, "no packets but of the frames coded");
            require(fuzz::same((*frame)->mesh, encoder->reconstruction(frames++)),
                    "the decoded mesh is the one that the encoder promised");
        }
        require(frames == coded, "one packet a frame");
    };
    std::int64_t time = 0;
    for (const auto& frame : capture.frames) {
        const auto pushed = encoder->push(frame.mesh, frame.pose ? &*frame.pose : nullptr, time += 33333);
        if (!pushed) require(!pushed.error().message.empty(), "an error says what is wrong");
        if (pushed) require(check_mesh(frame.mesh).has_value(), "a mesh that is none is refused");
        decode(pushed ? encoder->coded_frames().size() : 0);
    }
    // A frame that waits may fail as a push may; those before it are coded then.
    std::size_t held = encoder->held_frames();
    auto ended = encoder->finish();
    for (; !ended && held > 0; ended = encoder->finish()) {
        decode(encoder->coded_frames().size());
        require(encoder->held_frames() < held, "the frame that failed no longer waits");
        held = encoder->held_frames();
    }
    require(ended.has_value(), "what is held can be coded");
    require(encoder->coded_frames().size() == held, "all that is held is coded at the end");
    decode(held);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    const auto options = any_options(input);
    check_options(options, fuzz::any_capture(input));
    return 0;
}
