// Lost P- and EP-frames affect no other frames, and their stand-ins are as the format says; inconsistent frames of both
// kinds are refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "codec/format/frame_payload.h"
#include "codec/moving_sequences.h"
#include "codec/test_sequences.h"
#include "htvm/decoder.hpp"

namespace htvm::internal {
namespace {

using namespace test;

std::map<std::uint32_t, Mesh> by_number(const DecodedSequence& decoded) {
    std::map<std::uint32_t, Mesh> out;
    for (const auto& frame : decoded.frames) out[frame.info.frame] = frame.mesh;
    return out;
}

// Two groups of five frames: I, then P-frames and EP-frames, whole or in part.
const CodedSequence& ten_frames() {
    static const CodedSequence coded = [] {
        auto sequence = walking(10, 500);
        auto options = motion_based(40, 5);
        options.topology.frame_choice = FrameChoice::motion;
        options.topology.predicted_below = 800;
        return encode(sequence, options);
    }();
    return coded;
}

std::vector<Packet> ten_frames_without(std::size_t place) {
    auto packets = ten_frames().packets;
    packets.erase(packets.begin() + static_cast<std::ptrdiff_t>(place));
    return packets;
}

// A decoder that was given the packets before `place`.
Decoder decoder_before(const std::vector<Packet>& packets, std::size_t place) {
    Decoder decoder;
    for (std::size_t i = 0; i < place; ++i) EXPECT_TRUE(decoder.decode_copy(packets[i]).has_value());
    return decoder;
}

// What a P-frame with the packet's transforms would show.
Mesh moved_by(const std::vector<Packet>& packets, std::size_t place) {
    auto decoder = decoder_before(packets, place);
    std::uint32_t vertices = 0, triangles = 0;
    for (std::size_t i = 0; i < place; ++i)
        if (packets[i].kind == PacketKind::intra && packets[i].frame == packets[place].reference) {
            const auto info = inspect(packets[i]);
            vertices = info->vertices;
            triangles = info->triangles;
        }
    FramePayload payload;
    payload.header.vertices = vertices;
    payload.header.triangles = triangles;
    payload.set(Layer::transforms, copy_of(*read_frame_payload(packets[place].payload)).of(Layer::transforms));
    Packet packet = packets[place];
    packet.kind = PacketKind::predicted;
    packet.payload = write_frame_payload(payload);
    auto frame = decoder.decode_copy(packet);
    EXPECT_TRUE(frame.has_value() && frame->has_value());
    return frame && *frame ? (**frame).mesh : Mesh{};
}

TEST(Loss, TheSequenceOfTheseTestsHasEveryKindOfFrame) {
    EXPECT_EQ(frames_of(ten_frames(), FrameType::intra), 2u);
    EXPECT_GE(frames_of(ten_frames(), FrameType::predicted), 2u);
    EXPECT_GE(frames_in_part(ten_frames()), 2u);
}

TEST(Loss, AnyPredictedOrEnhancedFrameMayBeMissing) {
    for (std::size_t missing = 0; missing < ten_frames().packets.size(); ++missing) {
        const auto& packet = ten_frames().packets[missing];
        if (!is_frame(packet) || packet.kind == PacketKind::intra) continue;
        const auto decoded = decode_packets(ten_frames_without(missing));
        EXPECT_TRUE(decoded.errors.empty());
        const auto frames = by_number(decoded);
        EXPECT_EQ(frames.size(), 9u);
        EXPECT_FALSE(frames.contains(packet.frame));
        for (const auto& [number, mesh] : frames) expect_same_mesh(mesh, ten_frames().reconstructions[number]);
    }
}

TEST(Loss, AMissingIntraFrameCostsEveryFrameUpToTheNext) {
    for (const std::uint32_t missing : {0u, 5u}) {
        std::vector<Packet> packets;
        for (const auto& packet : ten_frames().packets)
            if (packet.kind != PacketKind::intra || packet.frame != missing) packets.push_back(packet);
        const auto decoded = decode_packets(packets);
        EXPECT_EQ(decoded.errors.size(), 4u);
        for (const auto& error : decoded.errors) {
            EXPECT_EQ(error.kind, ErrorKind::corrupt_stream);
            EXPECT_NE(error.message.find("refers to frame " + std::to_string(missing)), std::string::npos)
                << error.message;
        }
        const auto frames = by_number(decoded);
        EXPECT_EQ(frames.size(), 5u);
        for (const auto& [number, mesh] : frames) {
            EXPECT_NE(number / 5, missing / 5);
            expect_same_mesh(mesh, ten_frames().reconstructions[number]);
        }
    }
}

TEST(Loss, WithoutAnIntraFrameNothingStandsIn) {
    Decoder decoder;
    EXPECT_FALSE(decoder.conceal_copy(0, 0).has_value());
    ASSERT_TRUE(decoder.decode_copy(ten_frames().packets[0]).has_value());
    EXPECT_FALSE(decoder.conceal_copy(0, 0).has_value());
}

TEST(Loss, BehindAnIntraFrameItsOwnMeshStandsIn) {
    auto decoder = decoder_before(ten_frames().packets, 2);
    const auto frame = decoder.conceal_copy(1, 4711);
    ASSERT_TRUE(frame.has_value());
    EXPECT_TRUE(frame->concealed);
    EXPECT_EQ(frame->info.type, FrameType::predicted);
    EXPECT_EQ(frame->info.frame, 1u);
    EXPECT_EQ(frame->info.reference, 0u);
    EXPECT_EQ(frame->info.timestamp_us, 4711);
    EXPECT_EQ(frame->info.bytes.total(), 0u);
    EXPECT_EQ(frame->pose.joints.size(), synth_skeleton().joint_names.size());
    expect_same_mesh(frame->mesh, ten_frames().reconstructions[0]);
}

TEST(Loss, TheIntraFrameMovedAsTheFrameBeforeStandsIn) {
    const auto& packets = ten_frames().packets;
    for (std::size_t i = 0; i + 1 < packets.size(); ++i) {
        if (packets[i].kind != PacketKind::enhanced && packets[i].kind != PacketKind::predicted) continue;
        const auto frame = decoder_before(packets, i + 1).conceal_copy(packets[i].frame + 1, 0);
        ASSERT_TRUE(frame.has_value());
        expect_same_mesh(frame->mesh, moved_by(packets, i));
    }
}

TEST(Loss, StandInsChangeNothingOfWhatComes) {
    Decoder decoder;
    for (const auto& packet : ten_frames().packets) {
        const auto frame = decoder.decode_copy(packet);
        ASSERT_TRUE(frame.has_value());
        (void)decoder.conceal_copy(packet.frame + 1, 0);
        if (!*frame) continue;
        EXPECT_FALSE((**frame).concealed);
        expect_same_mesh((**frame).mesh, ten_frames().reconstructions[packet.frame]);
    }
}

TEST(Loss, WithoutItsCodebookAFrameIsMovedByItsOwnTransforms) {
    std::vector<Packet> packets;
    for (const auto& packet : ten_frames().packets)
        if (packet.kind != PacketKind::codebook) packets.push_back(packet);
    Decoder decoder;
    std::size_t lost = 0;
    for (std::size_t i = 0; i < packets.size(); ++i) {
        const auto frame = decoder.decode_copy(packets[i]);
        if (packets[i].kind != PacketKind::enhanced) {
            EXPECT_TRUE(frame.has_value());
            continue;
        }
        ++lost;
        ASSERT_FALSE(frame.has_value());
        EXPECT_EQ(frame.error().kind, ErrorKind::corrupt_stream);
        EXPECT_NE(frame.error().message.find("codebook"), std::string::npos) << frame.error().message;
        const auto instead = decoder.conceal_copy(packets[i].frame, packets[i].timestamp_us);
        ASSERT_TRUE(instead.has_value());
        auto complete = ten_frames().packets;
        const auto place = std::find_if(complete.begin(), complete.end(), [&](const Packet& packet) {
            return packet.kind == PacketKind::enhanced && packet.frame == packets[i].frame;
        });
        expect_same_mesh(instead->mesh, moved_by(complete, static_cast<std::size_t>(place - complete.begin())));
    }
    EXPECT_GE(lost, 2u);
}

// ten_frames() up to the first frame of motion-based coding, changed.
template <class Change>
Result<std::optional<DecodedFrame>> changed_frame_in_part(const Change& change) {
    const auto& packets = ten_frames().packets;
    const auto at =
        static_cast<std::size_t>(std::find_if(packets.begin(), packets.end(), is_in_part) - packets.begin());
    auto payload = copy_of(*read_frame_payload(packets[at].payload));
    change(payload);
    Packet packet = packets[at];
    packet.payload = write_frame_payload(payload);
    return decoder_before(packets, at).decode_copy(packet);
}

TEST(MotionBased, TheCodedBonesAreOneBitForEveryBone) {
    for (const std::size_t bytes : {0u, 1u, 3u}) {
        const auto frame = changed_frame_in_part(
            [&](FramePayload& payload) { payload.set(Layer::coded_bones, std::vector<std::uint8_t>(bytes, 0xFF)); });
        ASSERT_FALSE(frame.has_value());
        EXPECT_EQ(frame.error().kind, ErrorKind::corrupt_stream);
    }
}

TEST(MotionBased, BitsBehindTheLastBoneAreIgnored) {
    std::uint32_t number = 0;
    for (const auto& packet : ten_frames().packets)
        if (is_in_part(packet) && number == 0) number = packet.frame;
    const auto frame = changed_frame_in_part([](FramePayload& payload) {
        auto bones = payload.of(Layer::coded_bones);
        bones.back() = static_cast<std::uint8_t>(bones.back() | 0xC0);
        payload.set(Layer::coded_bones, bones);
    });
    ASSERT_TRUE(frame.has_value() && frame->has_value());
    expect_same_mesh((**frame).mesh, ten_frames().reconstructions[number]);
}

TEST(MotionBased, VerticesNeedReferenceVerticesOfCodedBones) {
    const auto frame = changed_frame_in_part([](FramePayload& payload) { payload.set(Layer::coded_bones, {0, 0}); });
    ASSERT_FALSE(frame.has_value());
    EXPECT_EQ(frame.error().kind, ErrorKind::corrupt_stream);
}

TEST(MotionBased, AFrameOfNoBoneIsTheAnimatedReferenceMesh) {
    const auto& packets = ten_frames().packets;
    const auto at =
        static_cast<std::size_t>(std::find_if(packets.begin(), packets.end(), is_in_part) - packets.begin());
    const auto frame = changed_frame_in_part([](FramePayload& payload) {
        payload.set(Layer::coded_bones, {0, 0});
        payload.header.vertices = payload.header.triangles = 0;
        for (const auto layer : {Layer::mapping, Layer::geometry, Layer::colour, Layer::fans, Layer::distance_orders})
            payload.set(layer, {});
    });
    ASSERT_TRUE(frame.has_value() && frame->has_value());
    expect_same_mesh((**frame).mesh, moved_by(packets, at));
    EXPECT_EQ((**frame).info.vertices, (**frame).mesh.positions.size());
}

TEST(Predicted, OtherCountsThanTheReferenceMeshsAreRefused) {
    const auto& packets = ten_frames().packets;
    const auto at = static_cast<std::size_t>(
        std::find_if(packets.begin(), packets.end(),
                     [](const Packet& packet) { return packet.kind == PacketKind::predicted; }) -
        packets.begin());
    const auto original = copy_of(*read_frame_payload(packets[at].payload));
    for (const int which : {0, 1, 2}) {
        auto payload = original;
        if (which == 0) ++payload.header.vertices;
        if (which == 1) --payload.header.triangles;
        if (which == 2) payload.header.vertices = payload.header.triangles = 0;
        Packet packet = packets[at];
        packet.payload = write_frame_payload(payload);
        auto decoder = decoder_before(packets, at);
        const auto frame = decoder.decode_copy(packet);
        ASSERT_FALSE(frame.has_value());
        EXPECT_EQ(frame.error().kind, ErrorKind::corrupt_stream);
        // The undamaged one is still accepted.
        const auto again = decoder.decode_copy(packets[at]);
        ASSERT_TRUE(again.has_value() && again->has_value());
        expect_same_mesh((**again).mesh, ten_frames().reconstructions[packets[at].frame]);
    }
}

}  // namespace
}  // namespace htvm::internal
