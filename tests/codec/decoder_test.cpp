// Frames depend on their I-frame and codebooks alone, and no stream does harm, whatever it contains.
#include "htvm/decoder.hpp"

#include <gtest/gtest.h>

#include <map>

#include "codec/enhanced_options.h"
#include "codec/format/frame_payload.h"
#include "codec/hostile_bytes.h"
#include "codec/moving_sequences.h"
#include "codec/test_sequences.h"

namespace htvm::internal {
namespace {

using namespace test;

// Nine frames, with an I-frame every third, and attributes of every kind.
const CodedSequence& nine_frames() {
    static const CodedSequence coded = [] {
        auto sequence = synthetic(true, 9, 500);
        for (auto& frame : sequence.frames) {
            const auto original = frame.mesh.colours;
            give_attributes(frame.mesh, all, 1);
            frame.mesh.colours = original;
        }
        EncoderOptions options = test::enhanced_options();
        options.key_interval = 3;
        return encode(sequence, options);
    }();
    return coded;
}

std::map<std::uint32_t, Mesh> by_number(const DecodedSequence& decoded) {
    std::map<std::uint32_t, Mesh> out;
    for (const auto& frame : decoded.frames) out[frame.info.frame] = frame.mesh;
    return out;
}

// Checks that the frames that arrived are as encoded; returns their numbers.
std::vector<std::uint32_t> checked_numbers(const DecodedSequence& decoded) {
    std::vector<std::uint32_t> out;
    for (const auto& [number, mesh] : by_number(decoded)) {
        out.push_back(number);
        SCOPED_TRACE("frame " + std::to_string(number));
        expect_same_mesh(mesh, nine_frames().reconstructions[number]);
    }
    return out;
}

template <class Keep>
std::vector<Packet> kept(const Keep& keep) {
    std::vector<Packet> out;
    for (const auto& packet : nine_frames().packets)
        if (keep(packet)) out.push_back(packet);
    return out;
}

TEST(Independence, AnyEnhancedFramesMayBeMissing) {
    for (unsigned subset = 0; subset < 64; ++subset) {
        std::vector<std::uint32_t> expected;
        for (std::uint32_t t = 0; t < 9; ++t)
            if (t % 3 == 0 || (subset >> (t / 3 * 2 + t % 3 - 1) & 1)) expected.push_back(t);
        const auto decoded = decode_packets(kept([&](const Packet& packet) {
            return packet.kind != PacketKind::enhanced ||
                   std::find(expected.begin(), expected.end(), packet.frame) != expected.end();
        }));
        EXPECT_TRUE(decoded.errors.empty());
        EXPECT_EQ(checked_numbers(decoded), expected);
    }
}

TEST(Independence, ADecoderMayBeginAtAnyIntraFrame) {
    const auto decoded = decode_packets(
        kept([](const Packet& packet) { return packet.kind == PacketKind::sequence || packet.frame >= 3; }));
    EXPECT_TRUE(decoded.errors.empty());
    EXPECT_EQ(checked_numbers(decoded), (std::vector<std::uint32_t>{3, 4, 5, 6, 7, 8}));
}

TEST(Independence, AMissingIntraFrameCostsTheFramesThatReferToIt) {
    const auto decoded = decode_packets(
        kept([](const Packet& packet) { return packet.kind != PacketKind::intra || packet.frame != 3; }));
    ASSERT_EQ(decoded.errors.size(), 2u);
    for (const auto& error : decoded.errors) {
        EXPECT_EQ(error.kind, ErrorKind::corrupt_stream);
        EXPECT_NE(error.message.find("refers to frame 3"), std::string::npos) << error.message;
    }
    EXPECT_EQ(checked_numbers(decoded), (std::vector<std::uint32_t>{0, 1, 2, 6, 7, 8}));
}

TEST(Independence, AMissingCodebookCostsTheFramesThatNameIt) {
    const auto& packets = nine_frames().packets;
    for (std::size_t missing = 0; missing < packets.size(); ++missing) {
        if (packets[missing].kind != PacketKind::codebook) continue;
        auto rest = packets;
        rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(missing));
        // Until the next codebook for the same purpose, or the next I-frame.
        std::vector<std::uint32_t> expected;
        for (std::uint32_t t = 0; t < 9; ++t) expected.push_back(t);
        for (std::size_t i = missing + 1; i < packets.size(); ++i) {
            if (packets[i].kind == PacketKind::intra) break;
            if (packets[i].kind == PacketKind::codebook && packets[i].payload[0] == packets[missing].payload[0]) break;
            if (packets[i].kind == PacketKind::enhanced) std::erase(expected, packets[i].frame);
        }
        const auto decoded = decode_packets(rest);
        EXPECT_EQ(checked_numbers(decoded), expected);
        EXPECT_EQ(decoded.errors.size(), 9 - expected.size());
        EXPECT_LT(expected.size(), 9u);
        for (const auto& error : decoded.errors) EXPECT_EQ(error.kind, ErrorKind::corrupt_stream);
    }
}

TEST(Independence, WithoutTheHeaderNothingIsDecoded) {
    const auto decoded = decode_packets(kept([](const Packet& packet) { return packet.kind != PacketKind::sequence; }));
    EXPECT_TRUE(decoded.frames.empty());
    EXPECT_EQ(decoded.errors.size(), 9u);
    for (const auto& error : decoded.errors) EXPECT_EQ(error.kind, ErrorKind::corrupt_stream);
}

TEST(Independence, ARepeatedHeaderChangesNothing) {
    std::vector<Packet> packets;
    for (const auto& packet : nine_frames().packets) {
        packets.push_back(packet);
        packets.push_back(nine_frames().packets[0]);
        packets.back().frame = packet.frame + 1;
    }
    const auto decoded = decode_packets(packets);
    EXPECT_TRUE(decoded.errors.empty());
    EXPECT_EQ(checked_numbers(decoded).size(), 9u);
}

TEST(Independence, AnotherHeaderBeginsAnotherSequence) {
    const auto other = encode(synthetic(false, 1, 200), {});
    auto packets = kept([](const Packet& packet) { return packet.frame < 3 && packet.kind != PacketKind::index; });
    packets.insert(packets.begin() + 2, other.packets[0]);  // after the first I-frame
    const auto decoded = decode_packets(packets);
    EXPECT_EQ(checked_numbers(decoded), std::vector<std::uint32_t>{0});
    ASSERT_EQ(decoded.errors.size(), 2u);
    EXPECT_EQ(decoded.errors[0].kind, ErrorKind::corrupt_stream);
}

TEST(Independence, FlippedBitsOnTheWayCostThePacketsTheyHit) {
    std::mt19937 random(1);
    for (int i = 0; i < 30; ++i) {
        auto bytes = nine_frames().bytes;
        auto& byte = bytes[below(random, static_cast<std::uint32_t>(bytes.size()))];
        byte = static_cast<std::uint8_t>(byte ^ (1u << below(random, 8)));
        const auto packets = read_packets(bytes, 4096);
        EXPECT_EQ(packets.size(), nine_frames().packets.size() - 1);
        checked_numbers(decode_packets(packets));
    }
}

TEST(Decoder, UnknownPacketKindsAndTheIndexAreSkipped) {
    Decoder decoder;
    for (const int kind : {0, 5, 99, 77, 255}) {
        Packet packet;
        packet.kind = static_cast<PacketKind>(kind);
        packet.payload = {1, 2, 3};
        const auto frame = decoder.decode_copy(packet);
        ASSERT_TRUE(frame.has_value());
        EXPECT_FALSE(frame->has_value());
    }
    EXPECT_FALSE(decoder.sequence().has_value());
}

TEST(Decoder, SaysWhatTheHeaderSays) {
    Decoder decoder;
    ASSERT_TRUE(decoder.decode_copy(nine_frames().packets[0]).has_value());
    const auto& info = decoder.sequence();
    ASSERT_TRUE(info.has_value());
    EXPECT_EQ(info->lattice_step, 1.0 / 16);
    EXPECT_EQ(info->fps_numerator, 30u);
    EXPECT_EQ(info->skeleton.bones.size(), synth_skeleton().bones.size());
    EXPECT_EQ(info->skeleton.joint_names, synth_skeleton().joint_names);
    EXPECT_EQ(info->radii.size(), info->skeleton.bones.size());
    EXPECT_TRUE(info->has_skeleton);
}

TEST(Decoder, LargerFramesThanAllowedAreRefused) {
    DecoderOptions options;
    options.max_vertices = 10;
    const auto of_vertices = decode_packets(nine_frames().packets, options);
    options.max_vertices = 1u << 20;
    options.max_triangles = 10;
    const auto of_triangles = decode_packets(nine_frames().packets, options);
    for (const auto& decoded : {of_vertices, of_triangles}) {
        EXPECT_TRUE(decoded.frames.empty());
        EXPECT_EQ(decoded.errors.size(), 9u);
        for (const auto& error : decoded.errors) EXPECT_EQ(error.kind, ErrorKind::limit) << error.message;
    }
}

TEST(Decoder, IntraFramesOfACoderThatIsNotThereAreUnsupported) {
    EncoderOptions options = test::enhanced_options();
    options.intra_coder = draco_intra_coder();
    const auto decoded = decode_packets(encode(synthetic(false, 2, 200), options).packets);
    ASSERT_EQ(decoded.errors.size(), 2u);
    EXPECT_EQ(decoded.errors[0].kind, ErrorKind::unsupported);
    EXPECT_NE(decoded.errors[0].message.find("Draco"), std::string::npos);
    EXPECT_EQ(decoded.errors[1].kind, ErrorKind::corrupt_stream) << "its I-frame is not there";
}

TEST(Decoder, ThePoseComesBack) {
    const auto sequence = synthetic(true, 3, 400);
    EncoderOptions options = test::enhanced_options();
    const auto decoded = decode_packets(encode(sequence, options).packets);
    ASSERT_EQ(decoded.frames.size(), 3u);
    const auto& pose = decoded.frames[0].pose;
    ASSERT_EQ(pose.joints.size(), sequence.frames[0].pose->joints.size());
    for (std::size_t k = 0; k < pose.joints.size(); ++k)
        for (std::size_t axis = 0; axis < 3; ++axis)
            EXPECT_NEAR(pose.joints[k][axis], sequence.frames[0].pose->joints[k][axis], 0.5 / 16 + 1e-9);
    for (const auto& frame : decoded.frames) EXPECT_EQ(frame.pose.orientations.size(), 14u);
}

// The stream up to packet `at`, then that packet with each of its layers damaged, then the rest. CRCs are no protection
// here: a hostile writer can make such streams.
void expect_harmless(const std::vector<Packet>& packets, std::size_t at, const DecoderOptions& options, int flips) {
    hostile::try_everything(
        packets[at].payload,
        [&](const std::vector<std::uint8_t>& payload) {
            Decoder decoder(options);
            for (std::size_t i = 0; i < std::min(at + 3, packets.size()); ++i) {
                auto packet = packets[i];
                if (i == at) packet.payload = payload;
                const auto frame = decoder.decode_copy(packet);
                if (!frame || !*frame) continue;
                const auto& mesh = (**frame).mesh;
                // Zippering joins the contents of the packet with the I-frame's mesh.
                ASSERT_LE(mesh.positions.size(), is_in_part(packet) ? 2 * options.max_vertices : options.max_vertices);
                for (const auto& t : mesh.triangles)
                    for (const auto v : t) ASSERT_LT(v, mesh.positions.size());
                for (const auto& p : mesh.positions)
                    for (const auto c : p) ASSERT_TRUE(std::isfinite(c));
            }
        },
        flips);
}

DecoderOptions small_limits() {
    DecoderOptions options;
    options.max_vertices = 4000;
    options.max_triangles = 8000;
    options.threads = 2;
    return options;
}

CodedSequence small_stream(bool draco) {
    auto sequence = sequence_of(tfan_test::grid(7, 6), 2, all);
    EncoderOptions options = test::enhanced_options();
    if (draco) options.intra_coder = draco_intra_coder();
    return encode(sequence, options);
}

TEST(Hostile, EveryPacketDamagedBehindItsCrcDoesNoHarm) {
    const auto coded = small_stream(false);
    for (std::size_t at = 0; at < coded.packets.size(); ++at) expect_harmless(coded.packets, at, small_limits(), 300);
}

CodedSequence small_moving_stream() {
    const auto sequence = walking(3, 80);
    auto options = motion_based(40, 3);
    auto out = encode(sequence, options);
    options.topology.frame_choice = FrameChoice::motion;
    options.topology.predicted_below = 1e6;
    auto predicted = encode(sequence, options);
    for (auto& packet : predicted.packets)
        if (packet.kind == PacketKind::predicted && packet.frame == 1) out.packets.push_back(std::move(packet));
    return out;
}

TEST(Hostile, PredictedAndMotionBasedFramesDamagedBehindTheirCrcDoNoHarm) {
    const auto coded = small_moving_stream();
    std::size_t in_part = 0, predicted = 0;
    for (std::size_t at = 0; at < coded.packets.size(); ++at) {
        const auto& packet = coded.packets[at];
        if (!is_in_part(packet) && packet.kind != PacketKind::predicted) continue;
        ++(packet.kind == PacketKind::predicted ? predicted : in_part);
        expect_harmless(coded.packets, at, small_limits(), 300);
    }
    EXPECT_GE(in_part, 1u);
    EXPECT_EQ(predicted, 1u);
}

TEST(Hostile, DracoIntraFramesDamagedBehindTheirCrcDoNoHarm) {
    const auto coded = small_stream(true);
    auto options = small_limits();
    options.intra_coder = draco_intra_coder();
    for (std::size_t at = 0; at < coded.packets.size(); ++at)
        if (coded.packets[at].kind == PacketKind::intra) expect_harmless(coded.packets, at, options, 60);
}

void expect_noise_is_harmless(const CodedSequence& coded) {
    for (const auto& original : coded.packets) {
        if (!is_frame(original)) continue;
        std::mt19937 random(1);
        for (int i = 0; i < 300; ++i) {
            auto payload = copy_of(*read_frame_payload(original.payload));
            const auto layer = static_cast<Layer>(1 + below(random, layer_count - 1));
            std::vector<std::uint8_t> noise(below(random, 200));
            for (auto& byte : noise) byte = static_cast<std::uint8_t>(random());
            payload.set(layer, noise);
            if (below(random, 3) == 0) payload.header.vertices = below(random, 4000);
            if (below(random, 3) == 0) payload.header.triangles = below(random, 8000);
            Decoder decoder(small_limits());
            for (auto packet : coded.packets) {
                if (packet.kind == original.kind && packet.frame == original.frame)
                    packet.payload = write_frame_payload(payload);
                (void)decoder.decode_copy(packet);
            }
        }
    }
}

TEST(Hostile, EveryLayerReplacedByNoiseDoesNoHarm) {
    expect_noise_is_harmless(small_stream(false));
    expect_noise_is_harmless(small_moving_stream());
}

}  // namespace
}  // namespace htvm::internal
