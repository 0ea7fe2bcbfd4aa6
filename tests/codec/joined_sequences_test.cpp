// Sequences one after the other in one stream: joined files, and publishers who begin again.
#include <gtest/gtest.h>

#include "codec/enhanced_options.h"
#include "codec/test_sequences.h"
#include "core/crc32.h"
#include "htvm/decoder.hpp"

namespace htvm::internal {
namespace {

using namespace test;

// The same person at two times: nothing tells their headers apart, and T-frames of one fit the I-frame of the other.
TestSequence person(int first, int frames = 4) {
    TestSequence out{"person", {}, {}};
    for (int t = 0; t < frames; ++t) out.frames.push_back({synthetic_frame(300, first + t).mesh, {}});
    // The lattice's origin follows from the first mesh.
    out.frames[0].mesh = synthetic_frame(300, 50).mesh;
    return out;
}

EncoderOptions tracked(std::uint64_t session) {
    auto out = default_options(Profile::tracked);
    out.session = session;
    return out;
}

std::vector<Packet> joined(std::vector<Packet> a, const std::vector<Packet>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

TEST(JoinedFiles, DecodeToAllFramesOfBoth) {
    const auto a = encode(person(50), tracked(0)), b = encode(person(50, 3), tracked(0));
    ASSERT_EQ(a.packets[0].payload, b.packets[0].payload) << "one header, byte for byte";
    const auto decoded = decode_packets(joined(a.packets, b.packets));
    EXPECT_TRUE(decoded.errors.empty());
    ASSERT_EQ(decoded.frames.size(), 7u);
    for (std::size_t i = 0; i < 7; ++i) {
        const bool first = i < 4;
        expect_same_mesh(decoded.frames[i].mesh, first ? a.reconstructions[i] : b.reconstructions[i - 4]);
        EXPECT_EQ(decoded.frames[i].info.sequence, first ? 0u : 1u);
        EXPECT_EQ(decoded.frames[i].info.frame, first ? i : i - 4);
    }
}

TEST(JoinedFiles, AStaleIntraFrameIsNotReferredTo) {
    const auto a = encode(person(50), tracked(0)), b = encode(person(52), tracked(0));
    ASSERT_EQ(a.packets[0].payload, b.packets[0].payload);
    ASSERT_EQ(b.packets[2].kind, PacketKind::tracked);
    auto without_intra = b.packets;
    without_intra.erase(without_intra.begin() + 1);
    const auto decoded = decode_packets(joined(a.packets, without_intra));
    EXPECT_EQ(decoded.frames.size(), 4u);
    EXPECT_EQ(decoded.errors.size(), 3u);
}

// A live encoder that is started again counts from 0, and its I-frame is lost on the way. Frame 1 would then be taken
// for one of the run before.
DecodedSequence restarted(std::uint64_t session, std::uint64_t session_after) {
    auto before = encode(person(50), tracked(session)).packets;
    before.resize(2);  // its header and I-frame
    auto after = encode(person(52), tracked(session_after)).packets;
    after.erase(after.begin() + 1);
    return decode_packets(joined(before, after));
}

TEST(Session, OfARestartedPublisherKeepsTheStaleIntraFrameFromItsFrames) {
    const auto decoded = restarted(4711, 4712);
    EXPECT_EQ(decoded.frames.size(), 1u);
    EXPECT_EQ(decoded.errors.size(), 3u);
}

TEST(Session, ThatIsTheSameWouldNot) {
    const auto decoded = restarted(4711, 4711);
    EXPECT_EQ(decoded.frames.size(), 4u) << "wrong meshes without a word: what sessions are for";
    EXPECT_TRUE(decoded.errors.empty());
}

TEST(Session, AHeaderThatIsSentAgainWithOldFramesIsARepeat) {
    const auto coded = encode(person(50, 6), tracked(1));
    std::vector<Packet> packets;
    for (const auto& packet : coded.packets) {
        packets.push_back(packet);
        packets.push_back(coded.packets[0]);
    }
    const auto decoded = decode_packets(packets);
    EXPECT_TRUE(decoded.errors.empty());
    ASSERT_EQ(decoded.frames.size(), 6u);
    for (const auto& frame : decoded.frames) EXPECT_EQ(frame.info.sequence, 0u);
}

TEST(Session, IsToldWithTheOrdinal) {
    Decoder decoder;
    const auto coded = encode(person(50, 1), tracked(9007199254740991));
    EXPECT_TRUE(coded.packets[0].has(packet_flag::session));
    EXPECT_EQ(coded.packets[0].reference, crc32(coded.packets[0].payload));
    ASSERT_TRUE(decoder.decode_copy(coded.packets[0]).has_value());
    EXPECT_EQ(decoder.sequence()->session, 9007199254740991u);
    EXPECT_EQ(decoder.sequence()->ordinal, 0u);
    ASSERT_TRUE(decoder.decode_copy(encode(person(50, 1), tracked(5)).packets[0]).has_value());
    EXPECT_EQ(decoder.sequence()->session, 5u);
    EXPECT_EQ(decoder.sequence()->ordinal, 1u);
}

}  // namespace
}  // namespace htvm::internal
