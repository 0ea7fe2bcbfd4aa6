// Why an I- or TP-frame was sent: what the encoder tells, and what a decoder reads of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "codec/format/frame_payload.h"
#include "codec/moving_sequences.h"
#include "codec/patched_sequences.h"

namespace htvm::internal {
namespace {

using namespace test;
using enum FrameReason;

std::vector<FrameReason> reasons_of(const CodedSequence& coded) {
    std::vector<FrameReason> out;
    for (const auto& info : coded.infos) out.push_back(info.reason);
    return out;
}

EncoderOptions without_patches() {
    auto out = patched_options();
    out.tracked.patch_share = 0;
    return out;
}

// What is seen of a person who stands still: all that is no lower than so many mm in each frame.
TestSequence seen_down_to(const std::vector<float>& heights) {
    const auto whole = synthetic_frame(1500, 0).mesh;
    TestSequence out{"seen down to a height", {}, {}};
    for (const float height : heights) {
        const auto is_seen = [&](std::uint32_t v) { return whole.positions[v][1] >= height; };
        Mesh mesh;
        std::vector<std::uint32_t> number(whole.positions.size());
        for (std::uint32_t v = 0; v < number.size(); ++v) {
            if (!is_seen(v)) continue;
            number[v] = static_cast<std::uint32_t>(mesh.positions.size());
            mesh.positions.push_back(whole.positions[v]);
            mesh.colours.push_back(whole.colours[v]);
        }
        for (const auto& [a, b, c] : whole.triangles)
            if (is_seen(a) && is_seen(b) && is_seen(c)) mesh.triangles.push_back({number[a], number[b], number[c]});
        out.frames.push_back({std::move(mesh), {}});
    }
    return out;
}

// A dance in which a part of the dancer is lost once.
TestSequence fast_dance() {
    SynthOptions options;
    options.vertices = 1000;
    options.motion = SynthMotion::fast;
    options.seed = 2;
    TestSequence out{"fast dance", {}, {}};
    for (int t = 0; t < 13; ++t) out.frames.push_back({synth_frame(options, t).mesh, {}});
    return out;
}

// A ball with texture coordinates, laid out anew from a frame on.
TestSequence textured_ball(std::size_t frames, std::size_t anew) {
    auto out = horned_ball(static_cast<int>(frames), never);
    for (std::size_t t = 0; t < frames; ++t) {
        auto& mesh = out.frames[t].mesh;
        for (const auto& p : mesh.positions)
            mesh.texcoords.push_back(
                {(p[0] + 500) / 1000, t < anew ? (p[1] + 500) / 1000 : 0.9F - (p[2] + 500) / 1000});
    }
    return out;
}

TEST(FrameReasons, AreNoneWhereTheFirstFrameOrATrackedFrameIsSent) {
    const auto coded = encode(horned_ball(3, never), patched_options());
    EXPECT_EQ(reasons_of(coded), (std::vector{none, none, none}));
    for (const auto& packet : coded.packets)
        if (packet.kind == PacketKind::intra) {
            EXPECT_FALSE(read_frame_payload(packet.payload)->has(Layer::reason));
        }
}

TEST(FrameReasons, AreNoneWhereAllFramesAreIFrames) {
    auto options = patched_options();
    options.key_interval = 1;
    EXPECT_EQ(reasons_of(encode(horned_ball(3, never), options)), (std::vector{none, none, none}));
}

TEST(FrameReasons, TakeThreeBytesOfAFrame) {
    auto sequence = horned_ball(2, never);
    const auto coded = [&](int key_interval) {
        auto options = patched_options();
        options.key_interval = key_interval;
        return encode(sequence, options).infos[1];
    };
    sequence.frames[1].mesh = {};
    const auto told = coded(2).bytes, not_told = coded(1).bytes;
    EXPECT_EQ(told[Layer::reason], 1u);
    EXPECT_EQ(not_told[Layer::reason], 0u);
    EXPECT_EQ(told.total(), not_told.total() + 3);
}

TEST(FrameReasons, TellThatTheLongestKeyIntervalHasPassed) {
    auto options = patched_options();
    options.key_interval = 2;
    EXPECT_EQ(reasons_of(encode(horned_ball(5, never), options)), (std::vector{none, none, due, none, due}));
    auto by_bones = options_at_2_mm(Profile::topology);
    by_bones.key_interval = 2;
    EXPECT_EQ(reasons_of(encode(walking(4, 300), by_bones)), (std::vector{none, none, due, none}));
}

TEST(FrameReasons, TellThatTheCallerAskedForAnIFrame) {
    auto encoder = Encoder::create(patched_options());
    ASSERT_TRUE(encoder.has_value());
    const auto mesh = horned_ball(1, never).frames[0].mesh;
    for (int t = 0; t < 3; ++t) {
        ASSERT_TRUE(encoder->push(mesh, nullptr, t * 33333, t == 2).has_value());
        EXPECT_EQ(encoder->last_frame().reason, t == 2 ? due : none);
    }
}

TEST(FrameReasons, TellThatThereIsNothingToReferTo) {
    auto sequence = horned_ball(3, never);
    sequence.frames[1].mesh = {};
    EXPECT_EQ(reasons_of(encode(sequence, patched_options())), (std::vector{none, due, none}));
}

TEST(FrameReasons, TellOfARegionThatIsLostWhetherItIsPatchedOrNot) {
    const auto patched = encode(horned_ball(4), patched_options());
    EXPECT_EQ(patched.infos[2].type, FrameType::patched);
    EXPECT_EQ(reasons_of(patched), (std::vector{none, none, region, none}));
    const auto renewed = encode(fast_dance(), without_patches());
    EXPECT_EQ(
        std::count_if(renewed.infos.begin(), renewed.infos.end(),
                      [](const FrameInfo& info) { return info.type == FrameType::intra && info.reason == region; }),
        1);
}

TEST(FrameReasons, TellOfACutHoweverCoarseTheCaptureIs) {
    // Its edges are 50 mm long: what is farther off than two of them is farther than how well it fits is looked for.
    TestSequence sequence{"cut", {}, {}};
    for (int t = 0; t < 2; ++t) {
        auto mesh = synthetic_frame(1500, 60).mesh;
        for (auto& p : mesh.positions) p[0] += 2000.0F * static_cast<float>(t);
        sequence.frames.push_back({std::move(mesh), {}});
    }
    EXPECT_EQ(reasons_of(encode(meshed_anew(sequence), patched_options())), (std::vector{none, cut}));
}

TEST(FrameReasons, TellOfSurfaceThatIsOffEverywhere) {
    auto sequence = horned_ball(3, never);
    for (auto& p : sequence.frames[2].mesh.positions)
        for (auto& c : p) c += 12 * std::sin(c / 9);
    EXPECT_EQ(reasons_of(encode(sequence, without_patches())), (std::vector{none, none, surface}));
}

TEST(FrameReasons, TellOfACut) {
    auto sequence = horned_ball(4, never);
    for (auto& p : sequence.frames[2].mesh.positions) p[0] += 900;
    for (auto& p : sequence.frames[3].mesh.positions) p[0] += 900;
    EXPECT_EQ(reasons_of(encode(sequence, patched_options())), (std::vector{none, none, cut, none}));
}

// So coarse that it does not matter how the reference is drawn to what is new.
EncoderOptions coarse_options() {
    auto out = patched_options();
    out.geometry_step = 8;
    return out;
}

TEST(FrameReasons, TellOfSurfaceThatComesIntoViewAndIsAddedByTheNextFrame) {
    const auto coded = encode(seen_down_to({900, 900, 600, 600, 600}), coarse_options());
    EXPECT_EQ(coded.infos[3].type, FrameType::patched);
    EXPECT_EQ(reasons_of(coded), (std::vector{none, none, none, border, none}));
}

TEST(FrameReasons, TellOfWhatIsLostWhereSurfaceComesAndGoesOnceTwoPatchesWereInVain) {
    auto open = horned_ball(9, 4, 120, 0.2);
    for (auto& frame : open.frames) {
        const auto below = [&](const auto& triangle) {
            return std::any_of(triangle.begin(), triangle.end(),
                               [&](std::uint32_t v) { return frame.mesh.positions[v][1] < -150; });
        };
        std::erase_if(frame.mesh.triangles, below);
    }
    const auto coded = encode(open, patched_options());
    EXPECT_EQ(coded.infos[4].type, FrameType::tracked);
    EXPECT_EQ(coded.infos[5].type, FrameType::tracked);
    EXPECT_EQ(coded.infos[6].type, FrameType::intra);
    EXPECT_EQ(reasons_of(coded), (std::vector{none, none, none, none, none, none, surface, none, none}));
}

TEST(FrameReasons, TellOfATextureThatIsLaidOutAnew) {
    EXPECT_EQ(reasons_of(encode(textured_ball(4, 2), patched_options())), (std::vector{none, none, texture, none}));
}

TEST(FrameReasons, TellThatThereAreTooManyPatches) {
    auto sequence = horned_ball(1, never);
    for (int t = 1; t < 9; ++t) sequence.frames.push_back(horned_ball(2, t % 2 == 0 ? never : 1).frames[1]);
    sequence.frames.push_back(sequence.frames.back());
    const auto coded = encode(numbered_anew(sequence), patched_options());
    EXPECT_EQ(coded.infos.back().type, FrameType::intra);
    EXPECT_EQ(coded.infos.back().reason, patches);
}

TEST(FrameReasons, OfTheBonesStrategyTellOfSceneChangesOfMotionAndOfBits) {
    auto jumps = walking(3, 600);
    for (auto& p : jumps.frames[2].mesh.positions) p[0] += 1500;
    auto fixed = test::enhanced_options();
    EXPECT_EQ(reasons_of(encode(jumps, fixed)), (std::vector{none, none, cut}));
    auto by_motion = fixed;
    by_motion.topology.frame_choice = FrameChoice::motion;
    by_motion.topology.intra_above = 1;
    by_motion.topology.scene_changes = false;
    EXPECT_EQ(reasons_of(encode(walking(2, 600), by_motion)), (std::vector{none, surface}));
    auto bare = walking(2, 600);
    bare.skeleton = {};
    for (auto& frame : bare.frames) frame.pose.reset();
    EXPECT_EQ(reasons_of(encode(bare, default_options(Profile::topology))), (std::vector{none, rate}));
}

TEST(FrameReasons, AreReadAsTheyWereWritten) {
    for (const auto& sequence : {horned_ball(5), seen_down_to({900, 900, 600, 600, 600})}) {
        auto options = patched_options();
        options.key_interval = 4;
        const auto coded = encode(sequence, options);
        const auto decoded = decode_packets(coded.packets);
        ASSERT_TRUE(decoded.errors.empty()) << decoded.errors[0].message;
        std::vector<FrameReason> read;
        for (const auto& frame : decoded.frames) read.push_back(frame.info.reason);
        EXPECT_EQ(read, reasons_of(coded));
    }
}

// What is told of the second I-frame of two whose layer has these bytes.
FrameReason reason_read(const std::vector<std::uint8_t>& layer) {
    auto options = patched_options();
    options.key_interval = 1;
    auto packets = encode(horned_ball(2, never), options).packets;
    auto& packet = packets[2];
    auto payload = copy_of(*read_frame_payload(packet.payload));
    payload.set(Layer::reason, layer);
    packet.payload = write_frame_payload(payload);
    const auto decoded = decode_packets(packets);
    EXPECT_TRUE(decoded.errors.empty());
    EXPECT_EQ(decoded.frames.size(), 2u);
    return decoded.frames.back().info.reason;
}

TEST(FrameReasons, ThatAreNotKnownAreNoneAndNoError) {
    EXPECT_EQ(reason_read({static_cast<std::uint8_t>(border)}), border);
    EXPECT_EQ(reason_read({static_cast<std::uint8_t>(frame_reasons.size())}), none);
    EXPECT_EQ(reason_read({255}), none);
    EXPECT_EQ(reason_read({}), none);
    EXPECT_EQ(reason_read({static_cast<std::uint8_t>(border), 0}), none);
}

}  // namespace
}  // namespace htvm::internal
