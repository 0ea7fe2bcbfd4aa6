// What a decoder refuses as too large; and no mesh, however regular, takes less than the least size of a payload.
#include <gtest/gtest.h>

#include <algorithm>

#include "codec/enhanced_options.h"
#include "codec/format/frame_kinds.h"
#include "codec/format/frame_payload.h"
#include "codec/format/sequence.h"
#include "codec/moving_sequences.h"
#include "htvm/decoder.hpp"

namespace htvm::internal {
namespace {

using namespace test;

const CodedSequence& stream() {
    static const auto coded = encode(walking(3, 200), motion_based(0, 3));
    return coded;
}

// The errors that the stream causes under these options, all of kind limit.
std::vector<std::string> refusals(const DecoderOptions& options) {
    std::vector<std::string> out;
    Decoder decoder(options);
    for (const auto& packet : stream().packets) {
        const auto frame = decoder.decode_copy(packet);
        if (frame || frame.error().kind == ErrorKind::corrupt_stream)
            continue;  // because it depends on what was
                       // refused
        EXPECT_EQ(frame.error().kind, ErrorKind::limit);
        out.push_back(frame.error().message);
    }
    return out;
}

void expect_refusals(const DecoderOptions& options, std::size_t count, const std::string& option) {
    const auto messages = refusals(options);
    EXPECT_EQ(messages.size(), count) << option;
    for (const auto& message : messages) EXPECT_NE(message.find(option), std::string::npos) << message;
}

TEST(Limits, TheDefaultsRefuseNothingOrdinary) { EXPECT_TRUE(refusals({}).empty()); }

TEST(Limits, EachIsHeldAgainstWhatHeadersClaim) {
    DecoderOptions options;
    options.max_vertices = 20;
    expect_refusals(options, 3, "max_vertices");
    options = {};
    options.max_triangles = 20;
    expect_refusals(options, 3, "max_triangles");
    options = {};
    options.max_joints = 14;
    expect_refusals(options, 1, "max_joints");
    options = {};
    options.max_bones = 13;
    expect_refusals(options, 1, "max_bones");
    options = {};
    options.max_packet_bytes = 0;
    expect_refusals(options, stream().packets.size(), "max_packet_bytes");
    options = {};
    options.max_memory = std::uint64_t{4} << 20;
    expect_refusals(options, 3, "max_memory");
}

TEST(Limits, ExactlyAsLargeAsAllowedIsAccepted) {
    DecoderOptions options;
    for (const auto& info : stream().infos) {
        options.max_vertices = std::max(info.vertices, options.max_vertices == 1u << 22 ? 0 : options.max_vertices);
        options.max_triangles = std::max(info.triangles, options.max_triangles == 1u << 23 ? 0 : options.max_triangles);
    }
    options.max_joints = 15;
    options.max_bones = 14;
    EXPECT_TRUE(refusals(options).empty());
}

TEST(Limits, WhatWasRefusedChangesNothing) {
    DecoderOptions options;
    options.max_joints = 15;
    Decoder decoder(options);
    const auto& packets = stream().packets;
    ASSERT_TRUE(decoder.decode_copy(packets[0]).has_value());
    ASSERT_TRUE(decoder.decode_copy(packets[1]).has_value());
    auto header = *read_sequence_header(packets[0].payload);
    header.skeleton.joint_names.push_back("one too many");
    Packet large = packets[0];
    large.payload = write_sequence_header(header);
    EXPECT_FALSE(decoder.decode_copy(large).has_value());
    for (std::size_t i = 2; i < packets.size(); ++i) EXPECT_TRUE(decoder.decode_copy(packets[i]).has_value());
}

TEST(Limits, DracoIsNotAskedForMoreThanTheFramesHeaderSays) {
    EncoderOptions options = test::enhanced_options();
    options.intra_coder = draco_intra_coder();
    DecoderOptions decoding;
    decoding.intra_coder = draco_intra_coder();
    for (const bool triangles : {true, false}) {
        auto sequence = sequence_of(tfan_test::grid(12, 12), 1, colours);
        if (!triangles) sequence.frames[0].mesh.triangles.clear();
        const auto coded = encode(sequence, options);
        Decoder decoder(decoding);
        ASSERT_TRUE(decoder.decode_copy(coded.packets[0]).has_value());
        ASSERT_TRUE(decoder.decode_copy(coded.packets[1]).has_value());
        auto payload = copy_of(*read_frame_payload(coded.packets[1].payload));
        auto bytes = payload.of(Layer::external_intra);
        for (std::size_t i = 0; i < 3; ++i) bytes[(triangles ? 12 : 11) + i] = 0xFF;  // the count of vertices
        payload.set(Layer::external_intra, bytes);
        auto packet = coded.packets[1];
        packet.payload = write_frame_payload(payload);
        const auto frame = decoder.decode_copy(packet);
        ASSERT_FALSE(frame.has_value());
        EXPECT_NE(frame.error().message.find("larger than its header says"), std::string::npos)
            << frame.error().message;
    }
}

// A sheet of squares that does not move, so that there is next to nothing to code.
TestSequence flat_sheet(std::uint32_t side, int frames) {
    TestSequence out{"flat sheet", {}, {}};
    const auto shape = tfan_test::grid(side, side);
    for (int t = 0; t < frames; ++t) {
        Mesh mesh;
        for (const auto p : shape.positions)
            mesh.positions.push_back({static_cast<float>(p.x), static_cast<float>(p.y), 0});
        mesh.triangles = shape.triangles;
        mesh.colours.assign(mesh.positions.size(), {100, 100, 100});
        out.frames.push_back({std::move(mesh), {}});
    }
    return out;
}

TEST(Limits, FramesThatShowAnothersMeshAreHeldAgainstTheBytesThatCame) {
    auto options = test::enhanced_options();
    options.geometry_step = 50;
    options.topology.frame_choice = FrameChoice::motion;
    auto packets = encode(flat_sheet(200, 2), options).packets;
    while (!is_frame(packets.back())) packets.pop_back();  // the index
    const auto moved = packets.back();
    ASSERT_EQ(moved.kind, PacketKind::predicted);
    DecoderOptions decoding;
    decoding.max_vertices_per_byte = 1000;
    Decoder decoder(decoding);
    std::size_t bytes = 0;
    for (const auto& packet : packets) bytes += packet.payload.size() + packet_overhead;
    for (const auto& packet : packets) ASSERT_TRUE(decoder.decode_copy(packet).has_value());
    // It is shown, and it refers to as many vertices.
    constexpr std::size_t work = 2 * 200 * 200;
    std::size_t decoded = 1;
    for (;; ++decoded) {
        bytes += moved.payload.size() + packet_overhead;
        const auto frame = decoder.decode_copy(moved);
        ASSERT_EQ(frame.has_value(), (decoded + 1) * work <= bytes * 1000) << decoded;
        if (frame) continue;
        EXPECT_EQ(frame.error().kind, ErrorKind::limit);
        EXPECT_NE(frame.error().message.find("max_vertices_per_byte"), std::string::npos) << frame.error().message;
        break;
    }
    EXPECT_GT(decoded, 5u);
    EXPECT_LT(decoded, 100u);
    // Whatever brings bytes of its own goes on.
    for (const auto& packet : packets) EXPECT_EQ(decoder.decode_copy(packet).has_value(), true);
}

TEST(Limits, WhatADecoderRefusesByDefaultIsKnownBeforeItIsSent) {
    EXPECT_TRUE(check_default_limits(FrameType::intra, {2000000, 4000000}));
    EXPECT_TRUE(check_default_limits(FrameType::enhanced, {2000000, 4000000}));
    const auto large = check_default_limits(FrameType::intra, {(1u << 22) + 1, 1});
    ASSERT_FALSE(large);
    EXPECT_NE(large.error().message.find("max_vertices"), std::string::npos) << large.error().message;
    const auto much = check_default_limits(FrameType::enhanced, {4000000, 8000000});
    ASSERT_FALSE(much);
    EXPECT_NE(much.error().message.find("max_memory"), std::string::npos) << much.error().message;
}

TEST(LeastPayload, NoMeshIsCodedInLess) {
    EncoderOptions options = test::enhanced_options();
    options.geometry_step = 50;
    const auto coded = encode(flat_sheet(200, 2), options);
    for (const auto& packet : coded.packets) {
        if (!is_frame(packet)) continue;
        EXPECT_GE(packet.payload.size(), 40000u / 64);
        EXPECT_LE(packet.payload.size(), 800u) << "this is as little as the coder needs, or nearly";
    }
    const auto decoded = decode_packets(coded.packets);
    EXPECT_TRUE(decoded.errors.empty());
    ASSERT_EQ(decoded.frames.size(), 2u);
    for (std::size_t t = 0; t < 2; ++t) expect_same_mesh(decoded.frames[t].mesh, coded.reconstructions[t]);
}

TEST(LeastPayload, AFrameInLessIsCorrupt) {
    for (const auto kind : {PacketKind::intra, PacketKind::enhanced}) {
        Decoder decoder;
        bool found = false;
        for (const auto& packet : stream().packets) {
            if (packet.kind == kind && !found) {
                found = true;
                auto payload = copy_of(*read_frame_payload(packet.payload));
                payload.header.vertices = 4000000;
                payload.header.triangles = 8000000;
                auto claims = packet;
                claims.payload = write_frame_payload(payload);
                ASSERT_EQ(claims.payload.size(), 62500u);
                claims.payload.resize(62499);
                const auto frame = decoder.decode_copy(claims);
                ASSERT_FALSE(frame.has_value());
                EXPECT_EQ(frame.error().kind, ErrorKind::corrupt_stream);
                EXPECT_NE(frame.error().message.find("62499 bytes"), std::string::npos) << frame.error().message;
            }
            EXPECT_TRUE(decoder.decode_copy(packet).has_value());
        }
        EXPECT_TRUE(found);
    }
}

}  // namespace
}  // namespace htvm::internal
