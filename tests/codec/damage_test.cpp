// Damage in transmission: CRCs detect every flipped bit, and damage that gets past them does no harm and does not last.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "codec/enhanced_options.h"
#include "codec/format/frame_payload.h"
#include "codec/moving_sequences.h"
#include "codec/tracked_sequences.h"
#include "htvm/decoder.hpp"

namespace htvm::internal {
namespace {

using namespace test;

// A header, two groups of an I-frame, codebooks, EP-frames whole and in part, and P-frames, and an index.
const std::vector<Packet>& animated() {
    static const std::vector<Packet> packets = [] {
        auto options = motion_based(40, 4);
        options.topology.frame_choice = FrameChoice::motion;
        options.topology.predicted_below = 800;
        auto out = encode(walking(8, 100), options).packets;
        // The first EP-frames are in part: this adds one of the whole mesh.
        auto whole = encode(walking(8, 100), motion_based(0, 4)).packets;
        EXPECT_TRUE(std::any_of(out.begin(), out.end(), is_in_part));
        EXPECT_TRUE(std::any_of(whole.begin(), whole.end(),
                                [](const Packet& p) { return p.kind == PacketKind::enhanced && !is_in_part(p); }));
        std::erase_if(whole, [](const Packet& p) { return p.kind == PacketKind::index; });
        whole.insert(whole.end(), out.begin(), out.end());
        return whole;
    }();
    return packets;
}

// A header, then twice an I-frame and four T-frames.
const std::vector<Packet>& tracked() {
    static const std::vector<Packet> packets = [] {
        EncoderOptions options = test::enhanced_options();
        options.key_interval = 1;
        return with_tracked_frames(encode(synthetic(true, 2, 100), options).packets, 1500, {}, 0, 1);
    }();
    return packets;
}

std::vector<Packet> everything() {
    auto out = animated();
    out.insert(out.end(), tracked().begin(), tracked().end());
    return out;
}

bool same(const Packet& a, const Packet& b) {
    return a.kind == b.kind && a.frame == b.frame && a.reference == b.reference && a.timestamp_us == b.timestamp_us &&
           a.payload == b.payload;
}

void flip(std::vector<std::uint8_t>& bytes, std::mt19937& random) {
    auto& byte = bytes[below(random, static_cast<std::uint32_t>(bytes.size()))];
    byte = static_cast<std::uint8_t>(byte ^ (1u << below(random, 8)));
}

TEST(Damage, EveryFlippedBitIsNoticedAndCostsItsPacketAlone) {
    const auto packets = everything();
    std::map<int, std::vector<std::size_t>> of_kind;
    for (std::size_t i = 0; i < packets.size(); ++i)
        of_kind[static_cast<int>(packets[i].kind) + (is_in_part(packets[i]) ? 100 : 0)].push_back(i);
    ASSERT_EQ(of_kind.size(), 8u) << "seven kinds of packets, and EP-frames in part";
    std::mt19937 random(1);
    const auto neighbour = write_packet(packets.front());
    for (const auto& [kind, places] : of_kind)
        for (int i = 0; i < 10000; ++i) {
            const auto& packet = packets[places[static_cast<std::size_t>(i) % places.size()]];
            auto bytes = write_packet(packet);
            flip(bytes, random);
            PacketReader reader;
            reader.push(bytes);
            reader.push(neighbour);
            const auto first = reader.pull();
            ASSERT_TRUE(first && same(*first, packets.front())) << "kind " << kind << ", flip " << i;
            ASSERT_EQ(reader.damaged_bytes(), bytes.size());
            ASSERT_FALSE(reader.pull().has_value());
            ASSERT_EQ(reader.pending_bytes(), 0u);
        }
}

TEST(Damage, AStreamCutAnywhereGivesAllCompletePacketsAndSaysThatItWasCut) {
    const auto packets = everything();
    std::vector<std::uint8_t> bytes;
    std::vector<std::size_t> ends;
    for (const auto& packet : packets) {
        const auto written = write_packet(packet);
        bytes.insert(bytes.end(), written.begin(), written.end());
        ends.push_back(bytes.size());
    }
    for (std::size_t size = 0; size < bytes.size(); size += 1 + size % 97) {
        const auto complete = static_cast<std::size_t>(std::upper_bound(ends.begin(), ends.end(), size) - ends.begin());
        PacketReader reader;
        reader.push(std::span(bytes).first(size));
        for (std::size_t i = 0; i < complete; ++i) {
            const auto packet = reader.pull();
            ASSERT_TRUE(packet && same(*packet, packets[i]));
        }
        ASSERT_FALSE(reader.pull().has_value());
        ASSERT_EQ(reader.pending_bytes() + reader.damaged_bytes(), size - (complete > 0 ? ends[complete - 1] : 0));
    }
}

void expect_sound(const Mesh& mesh) {
    for (const auto& t : mesh.triangles)
        for (const auto v : t) ASSERT_LT(v, mesh.positions.size());
    for (const auto& p : mesh.positions)
        for (const auto c : p) ASSERT_TRUE(std::isfinite(c));
}

// A decoder that was given those packets before `at` that the packet there depends on.
Decoder decoder_before(const std::vector<Packet>& packets, std::size_t at) {
    DecoderOptions options;
    options.max_vertices = 20000;
    options.max_triangles = 40000;
    options.threads = 1;
    Decoder decoder(options);
    for (std::size_t k = 0; k < at; ++k)
        if (packets[at].kind != PacketKind::intra || packets[k].kind == PacketKind::sequence)
            (void)decoder.decode_copy(packets[k]);
    return decoder;
}

// Flips bits of each packet's payload, corrects the CRC, and passes it to a decoder that knows the packets before.
// Afterwards the undamaged packet must still be accepted.
void expect_harmless(const std::vector<Packet>& packets, int flips) {
    const auto whole = decode_packets(packets);
    ASSERT_TRUE(whole.errors.empty());
    auto expected = whole.frames.begin();
    std::mt19937 random(2);
    for (std::size_t at = 0; at < packets.size(); ++at) {
        auto decoder = decoder_before(packets, at);
        for (int i = 0; i < flips; ++i) {
            auto packet = packets[at];
            flip(packet.payload, random);
            const auto frame = decoder.decode_copy(packet);
            if (frame && *frame) expect_sound((**frame).mesh);
        }
        // Frames after a damaged T-frame may be lost with it, and a damaged header may begin another sequence.
        if (packets[at].kind == PacketKind::tracked || packets[at].kind == PacketKind::sequence)
            decoder = decoder_before(packets, at);
        const auto again = decoder.decode_copy(packets[at]);
        ASSERT_TRUE(again.has_value()) << again.error().message;
        ASSERT_EQ(again->has_value(), is_frame(packets[at]));
        if (*again) expect_same_mesh((**again).mesh, (expected++)->mesh);
    }
}

TEST(Damage, FlippedBitsBehindARightCrcGiveAnErrorOrAFrameAndDoNotLast) {
    expect_harmless(animated(), 4000 / static_cast<int>(animated().size()));
    expect_harmless(tracked(), 6000 / static_cast<int>(tracked().size()));
}

TEST(Damage, ABadIntraFrameLeavesTrackedFramesTheirReference) {
    const auto whole = decode_packets(tracked());
    Decoder decoder;
    std::size_t frames = 0;
    for (const auto& packet : tracked()) {
        if (packet.kind == PacketKind::tracked) {
            Packet bad = tracked()[1];
            bad.payload.resize(bad.payload.size() / 2);
            ASSERT_FALSE(decoder.decode_copy(bad).has_value());
            const auto instead = decoder.conceal_copy(packet.frame, 0);
            ASSERT_TRUE(instead.has_value());
            expect_same_mesh(instead->mesh, whole.frames[frames - 1].mesh);
            EXPECT_EQ(instead->pose.joints, whole.frames[frames - 1].pose.joints);
        }
        const auto frame = decoder.decode_copy(packet);
        ASSERT_TRUE(frame.has_value()) << frame.error().message;
        if (*frame) expect_same_mesh((**frame).mesh, whole.frames[frames++].mesh);
    }
    EXPECT_EQ(frames, whole.frames.size());
}

TEST(Damage, BehindADamagedIntraFrameDecodingGoesOnAtTheNext) {
    for (const auto* packets : {&animated(), &tracked()}) {
        const auto whole = decode_packets(*packets);
        std::vector<std::uint8_t> bytes;
        std::size_t intra = 0;
        for (const auto& packet : *packets) {
            auto written = write_packet(packet);
            if (packet.kind == PacketKind::intra && intra++ == 0) written[written.size() / 2] ^= 1;
            bytes.insert(bytes.end(), written.begin(), written.end());
        }
        ASSERT_GE(intra, 2u);
        const auto decoded = decode_packets(read_packets(bytes, 4096));
        const auto next = static_cast<std::size_t>(
            std::find_if(whole.frames.begin() + 1, whole.frames.end(),
                         [](const DecodedFrame& frame) { return frame.info.type == FrameType::intra; }) -
            whole.frames.begin());
        ASSERT_EQ(decoded.frames.size(), whole.frames.size() - next);
        EXPECT_EQ(decoded.errors.size(), next - 1);
        for (const auto& error : decoded.errors) EXPECT_EQ(error.kind, ErrorKind::corrupt_stream);
        for (std::size_t i = 0; i < decoded.frames.size(); ++i)
            expect_same_mesh(decoded.frames[i].mesh, whole.frames[next + i].mesh);
    }
}

}  // namespace
}  // namespace htvm::internal
