// TP-frames: a lost region is replaced, and what follows goes on from there.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "codec/moving_sequences.h"
#include "codec/patched_sequences.h"
#include "codec/test_sequences.h"
#include "htvm/decoder.hpp"

namespace htvm::internal {
namespace {

using namespace test;

constexpr auto I = FrameType::intra, T = FrameType::tracked, TP = FrameType::patched;

TEST(PatchedFrames, ComeWhereARegionIsLostInsteadOfIFrames) {
    const auto coded = encode(horned_ball(5), patched_options());
    EXPECT_EQ(types_of(coded), (std::vector{I, T, TP, T, T}));
    EXPECT_LT(coded.infos[2].bytes.total(), coded.infos[0].bytes.total());
    auto without = patched_options();
    without.tracked.patch_share = 0;
    EXPECT_EQ(types_of(encode(horned_ball(5), without)), (std::vector{I, T, I, T, T}));
}

TEST(PatchedFrames, DecodeToWhatTheEncoderHas) {
    const auto coded = encode(horned_ball(5), patched_options());
    Decoder decoder;
    std::size_t frame = 0;
    for (const auto& packet : coded.packets) {
        const auto decoded = decoder.decode_copy(packet);
        ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
        if (!*decoded) continue;
        const auto& mesh = (*decoded)->mesh;
        const auto& sent = coded.reconstructions[frame];
        EXPECT_EQ(mesh.positions, sent.positions);
        EXPECT_EQ(mesh.triangles, sent.triangles);
        EXPECT_EQ(mesh.colours, sent.colours);
        EXPECT_EQ((*decoded)->info.vertices, coded.infos[frame].vertices);
        ++frame;
    }
    EXPECT_EQ(frame, 5u);
}

TEST(PatchedFrames, AreTheReferenceOfWhatFollows) {
    auto options = patched_options();
    options.tracked.references = TrackedReferences::intra;
    const auto coded = encode(horned_ball(5), options);
    ASSERT_EQ(types_of(coded), (std::vector{I, T, TP, T, T}));
    EXPECT_EQ(coded.infos[2].reference, 0u);
    EXPECT_EQ(coded.infos[3].reference, 2u);
    EXPECT_EQ(coded.infos[4].reference, 2u);
}

TEST(PatchedFrames, OfASmallLossWaitUntilTheCallerHasTimeForThem) {
    const auto sequence = horned_ball(4, 2, 104, 0.07);  // lost in one frame, and found again behind it
    for (const int waiting : {0, 1})
        for (const bool has_time : {false, true}) {
            auto options = patched_options();
            options.latency_frames = waiting;
            auto encoder = *Encoder::create(options);
            std::vector<FrameType> types;
            int asked = 0;
            for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
                ASSERT_TRUE(encoder.set_repair([&asked, has_time] { return ++asked, has_time; }));
                ASSERT_TRUE(encoder.push(sequence.frames[i].mesh, nullptr, 33333 * static_cast<std::int64_t>(i)));
                for (const auto& frame : encoder.coded_frames()) types.push_back(frame.info.type);
            }
            ASSERT_TRUE(encoder.finish());
            for (const auto& frame : encoder.coded_frames()) types.push_back(frame.info.type);
            EXPECT_EQ(types, (std::vector{I, T, has_time ? TP : T, T})) << waiting;
            EXPECT_EQ(asked, 1) << waiting;  // not of frames that are tracked
        }
    auto topology = *Encoder::create(default_options(Profile::topology));
    EXPECT_EQ(topology.set_repair([] { return true; }).error().kind, ErrorKind::bad_input);
}

TEST(PatchedFrames, WaitForNobodyWhereThePictureWouldFallApart) {
    const auto sequence = horned_ball(5);
    for (const int effort : {0, 5}) {
        auto encoder = *Encoder::create(patched_options());
        std::vector<FrameType> types;
        for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
            ASSERT_TRUE(encoder.set_effort(effort));
            ASSERT_TRUE(encoder.set_repair([] { return false; }));
            ASSERT_TRUE(encoder.push(sequence.frames[i].mesh, nullptr, 33333 * static_cast<std::int64_t>(i)));
            types.push_back(encoder.last_frame().type);
        }
        EXPECT_EQ(types, (std::vector{I, T, TP, T, T})) << effort;
    }
}

TEST(PatchedFrames, CodeOnlyTheTrianglesThatCome) {
    const auto coded = encode(horned_ball(3), patched_options());
    const auto patched = std::find_if(coded.packets.begin(), coded.packets.end(),
                                      [](const Packet& packet) { return packet.kind == PacketKind::patched; });
    ASSERT_NE(patched, coded.packets.end());
    const auto coming = read_frame_payload(patched->payload)->header.triangles;
    const auto before = coded.reconstructions[1].triangles.size(), after = coded.reconstructions[2].triangles.size();
    EXPECT_GT(coming, 0u);
    EXPECT_LT(coming, after / 2);
    EXPECT_LT(after - coming, before);
}

TEST(PatchedFrames, DoNotPutOffTheNextIFrame) {
    auto options = patched_options();
    options.key_interval = 4;
    EXPECT_EQ(types_of(encode(horned_ball(6), options)), (std::vector{I, T, TP, T, I, T}));
}

TEST(PatchedFrames, ThatAreLostTakeThoseBehindThemWithThemUpToTheNextIFrame) {
    auto options = patched_options();
    options.key_interval = 4;
    const auto coded = encode(horned_ball(6), options);
    Decoder decoder;
    std::vector<bool> decoded;
    for (const auto& packet : coded.packets) {
        if (!frame_type(packet.kind)) {
            EXPECT_TRUE(decoder.decode_copy(packet).has_value());
            continue;
        }
        decoded.push_back(packet.frame != 2 && decoder.decode_copy(packet).has_value());
    }
    EXPECT_EQ(decoded, (std::vector{true, true, false, false, true, true}));
}

TEST(PatchedFrames, ThatNothingMayReferToAreErrors) {
    auto coded = encode(horned_ball(3), patched_options());
    Decoder decoder;
    for (auto& packet : coded.packets) {
        const bool patched = packet.kind == PacketKind::patched;
        if (patched) packet.flags = packet_flag::flags_valid | packet_flag::droppable;
        EXPECT_EQ(decoder.decode_copy(packet).has_value(), !patched);
    }
}

TEST(PatchedFrames, ThatAreDamagedLeaveTheDecoderAsItWas) {
    const auto coded = encode(horned_ball(3), patched_options());
    const auto patched = std::find_if(coded.packets.begin(), coded.packets.end(),
                                      [](const Packet& packet) { return packet.kind == PacketKind::patched; });
    ASSERT_NE(patched, coded.packets.end());
    Decoder decoder;
    for (auto packet = coded.packets.begin(); packet != patched; ++packet) ASSERT_TRUE(decoder.decode_copy(*packet));
    for (std::size_t size = 0; size < patched->payload.size(); size += 7) {
        auto damaged = *patched;
        damaged.payload.resize(size);
        EXPECT_FALSE(decoder.decode_copy(damaged).has_value()) << size;
    }
    EXPECT_TRUE(decoder.decode_copy(*patched).has_value());
}

}  // namespace
}  // namespace htvm::internal
