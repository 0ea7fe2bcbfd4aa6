// Frames without a surface among those that have one: each costs itself alone.
#include <gtest/gtest.h>

#include "codec/enhanced_options.h"
#include "codec/test_sequences.h"
#include "htvm/decoder.hpp"

namespace htvm::internal {
namespace {

using namespace test;

TestSequence walking(int frames) {
    TestSequence out{"walking", {}, {}};
    for (int t = 0; t < frames; ++t) out.frames.push_back({synthetic_frame(600, 50 + t).mesh, {}});
    return out;
}

EncoderOptions tracked() {
    auto out = default_options(Profile::tracked);
    out.key_interval = 30;
    return out;
}

Mesh points_of(Mesh mesh) {
    mesh.triangles.clear();
    return mesh;
}

std::string letters(const CodedSequence& coded) {
    std::string out;
    for (const auto& info : coded.infos) out += kind_of(info.type).letter;
    return out;
}

DecodedSequence expect_decodes_as_promised(const CodedSequence& coded) {
    EXPECT_TRUE(coded.errors.empty());
    auto decoded = decode_packets(coded.packets);
    EXPECT_TRUE(decoded.errors.empty());
    EXPECT_EQ(decoded.frames.size(), coded.reconstructions.size());
    for (const auto& frame : decoded.frames) expect_same_mesh(frame.mesh, coded.reconstructions[frame.info.frame]);
    return decoded;
}

TEST(BareFrames, LeaveTheReferenceOfTrackedFramesAsItWas) {
    const auto whole = encode(walking(8), tracked());
    ASSERT_EQ(letters(whole), "ITTTTTTT");
    for (const bool points : {false, true}) {
        auto sequence = walking(8);
        auto& mesh = sequence.frames[3].mesh;
        mesh = points ? points_of(mesh) : Mesh{};
        const auto coded = encode(sequence, tracked());
        EXPECT_EQ(letters(coded), "ITTITTTT");
        EXPECT_EQ(coded.infos[4].reference, 2u) << "the frame before the bare one";
        const auto decoded = expect_decodes_as_promised(coded);
        for (const auto& frame : decoded.frames) {
            const auto t = frame.info.frame;
            if (t == 3) {
                EXPECT_TRUE(frame.mesh.triangles.empty());
                EXPECT_EQ(frame.mesh.positions.empty(), !points);
                continue;
            }
            EXPECT_EQ(frame.mesh.triangles, whole.reconstructions[0].triangles);
        }
    }
}

TEST(BareFrames, AtTheBeginningAndInARowDoNoHarm) {
    auto sequence = walking(8);
    for (const std::size_t bare : {0u, 1u, 4u, 5u, 7u}) sequence.frames[bare].mesh = {};
    const auto coded = encode(sequence, tracked());
    EXPECT_EQ(letters(coded), "IIITIITI");
    expect_decodes_as_promised(coded);
}

TEST(BareFrames, DoNotMoveTheNextIntraFrame) {
    auto options = tracked();
    options.key_interval = 4;
    auto sequence = walking(9);
    sequence.frames[2].mesh = {};
    EXPECT_EQ(letters(encode(sequence, options)), "ITITITTTI");
    expect_decodes_as_promised(encode(sequence, options));
}

TEST(BareFrames, LeaveTheReferenceOfEnhancedFramesToo) {
    auto sequence = walking(5);
    sequence.frames[2].mesh = {};
    const auto coded = encode(sequence, test::enhanced_options());
    EXPECT_EQ(letters(coded), "IEPIEPEP");
    EXPECT_EQ(coded.infos[3].reference, 0u);
    expect_decodes_as_promised(coded);
}

TEST(BareFrames, UnderRateControlTakeNoPart) {
    auto options = tracked();
    options.rate.bits_per_second = 2e6;
    const auto whole = encode(walking(8), options);
    auto sequence = walking(8);
    sequence.frames[3].mesh = {};
    const auto coded = encode(sequence, options);
    EXPECT_EQ(letters(coded), "ITTITTTT");
    expect_decodes_as_promised(coded);
}

TEST(IntraFramesAlone, AreShownAndLeaveAllAsItWas) {
    auto packets = encode(walking(4), tracked()).packets;  // header, I, T, T, T
    auto options = tracked();
    options.key_interval = 1;
    auto alone = encode(walking(1), options).packets[1];
    EXPECT_FALSE(alone.has(packet_flag::referred));
    alone.frame = alone.reference = 77;
    packets.insert(packets.begin() + 3, alone);
    auto decoded = decode_packets(packets);
    EXPECT_TRUE(decoded.errors.empty());
    EXPECT_EQ(decoded.frames.size(), 5u);
    // The same frame, but told to be referred to, or by an encoder of version 1, which told nothing.
    for (const int flags : {packet_flag::flags_valid | packet_flag::referred, 0}) {
        packets[3].flags = static_cast<std::uint8_t>(flags);
        decoded = decode_packets(packets);
        EXPECT_EQ(decoded.errors.size(), 2u);
    }
}

TEST(IntraFramesAlone, StandInForTheFrameBehindThem) {
    auto options = tracked();
    options.key_interval = 1;
    const auto coded = encode(walking(2), options);
    Decoder decoder;
    for (const auto& packet : coded.packets) ASSERT_TRUE(decoder.decode_copy(packet).has_value());
    const auto stand_in = decoder.conceal_copy(2, 99);
    ASSERT_TRUE(stand_in.has_value());
    EXPECT_TRUE(stand_in->concealed);
    EXPECT_EQ(stand_in->info.reference, 1u);
    expect_same_mesh(stand_in->mesh, coded.reconstructions[1]);
}

TEST(TrackedFramesAlone, AreShownAndLeaveTheFrameBeforeAsItWas) {
    const auto coded = encode(walking(3), tracked());  // header, I, T, T
    auto packets = coded.packets;
    auto between = packets[3];
    between.frame = 77;
    between.flags = packet_flag::flags_valid | packet_flag::droppable;
    packets.insert(packets.begin() + 3, between);
    const auto decoded = decode_packets(packets);
    EXPECT_TRUE(decoded.errors.empty());
    ASSERT_EQ(decoded.frames.size(), 4u);
    expect_same_mesh(decoded.frames[2].mesh, coded.reconstructions[2]);
    expect_same_mesh(decoded.frames[3].mesh, coded.reconstructions[2]);
    Decoder decoder;
    for (std::size_t i = 0; i < 4; ++i) ASSERT_TRUE(decoder.decode_copy(packets[i]).has_value());
    expect_same_mesh(decoder.conceal_copy(78, 0)->mesh, coded.reconstructions[2]);
}

}  // namespace
}  // namespace htvm::internal
