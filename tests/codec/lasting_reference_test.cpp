// References that last: places to start from between I-frames, and I-frames of the tracked mesh.
#include <gtest/gtest.h>

#include <vector>

#include "codec/patched_sequences.h"
#include "codec/test_sequences.h"
#include "htvm/decoder.hpp"
#include "htvm/dependency.hpp"

namespace htvm::internal {
namespace {

using namespace test;

EncoderOptions tracked_options() {
    auto out = patched_options();
    out.tracked.patch_share = 0;
    return out;
}

std::vector<Packet> frames_in(const CodedSequence& coded) {
    std::vector<Packet> out;
    for (const auto& packet : coded.packets)
        if (frame_type(packet.kind)) out.push_back(packet);
    return out;
}

TEST(AccessFrames, ReferToTheReferenceAloneOnceInAnInterval) {
    auto options = tracked_options();
    options.tracked.access_interval = 3;
    const auto packets = frames_in(encode(horned_ball(8, never), options));
    std::vector<std::uint32_t> references;
    std::vector<bool> access;
    for (const auto& packet : packets) {
        references.push_back(packet.reference);
        access.push_back(packet.has(packet_flag::access));
    }
    EXPECT_EQ(references, (std::vector<std::uint32_t>{0, 0, 1, 2, 0, 4, 5, 0}));
    EXPECT_EQ(access, (std::vector<bool>{true, true, false, false, true, false, false, true}));
}

TEST(AccessFrames, NeedTheReferenceAndNothingElse) {
    auto options = tracked_options();
    options.tracked.access_interval = 3;
    const auto coded = encode(horned_ball(6, never), options);
    Decoder decoder;
    for (const auto& packet : coded.packets) {
        if (frame_type(packet.kind) && packet.frame > 0 && packet.frame < 4) continue;
        const auto decoded = decoder.decode_copy(packet);
        ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
        if (!*decoded) continue;
        EXPECT_EQ((*decoded)->mesh.positions, coded.reconstructions[packet.frame].positions);
    }
}

TEST(RenewedIFrames, HaveTheTrackedMeshInsteadOfTheCaptures) {
    auto options = tracked_options();
    options.key_interval = 4;
    const auto coded = encode(horned_ball(6, never), options);
    const auto packets = frames_in(coded);
    ASSERT_EQ(packets[4].kind, PacketKind::intra);
    EXPECT_FALSE(packets[0].has(packet_flag::of_tracked_mesh));
    EXPECT_TRUE(packets[4].has(packet_flag::of_tracked_mesh));
    const auto& before = coded.reconstructions[3];
    const auto& renewed = coded.reconstructions[4];
    EXPECT_EQ(renewed.positions.size(), before.positions.size());
    EXPECT_EQ(renewed.triangles.size(), before.triangles.size());
}

TEST(RenewedIFrames, AreMadeOfTheCaptureWhereTrackingIsLost) {
    auto options = tracked_options();
    options.key_interval = 2;
    auto sequence = horned_ball(3, never);
    for (auto& p : sequence.frames[2].mesh.positions) p[0] += 900;
    const auto packets = frames_in(encode(sequence, options));
    ASSERT_EQ(packets[2].kind, PacketKind::intra);
    EXPECT_FALSE(packets[2].has(packet_flag::of_tracked_mesh));
}

TEST(RenewedIFrames, ComeWhereTheCallerAsksForAnIFrame) {
    auto encoder = Encoder::create(tracked_options());
    ASSERT_TRUE(encoder.has_value());
    const auto sequence = horned_ball(3, never);
    std::vector<PacketKind> kinds;
    for (std::size_t t = 0; t < 3; ++t) {
        const auto& frame = sequence.frames[t];
        ASSERT_TRUE(encoder->push(frame.mesh, nullptr, static_cast<std::int64_t>(t) * 33333, t == 2).has_value());
        while (const auto packet = encoder->pull())
            if (frame_type(packet->kind)) kinds.push_back(packet->kind);
    }
    EXPECT_EQ(kinds, (std::vector{PacketKind::intra, PacketKind::tracked, PacketKind::intra}));
}

}  // namespace
}  // namespace htvm::internal
