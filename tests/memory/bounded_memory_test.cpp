// Memory is bounded by what the limits are computed from and by what was received, whatever the length of the stream.
#include <gtest/gtest.h>

#include <string>

#include "codec/enhanced_options.h"
#include "codec/format/frame_kinds.h"
#include "core/crc32.h"
#include "memory/counted_allocations.h"
#include "memory/memory_streams.h"

namespace htvm {

using namespace internal;
namespace {

using namespace test;

// Triangles that each have their own three vertices, or random ones among all vertices.
TestSequence soup(std::uint32_t vertices, std::uint32_t triangles, bool apart, int frames) {
    TestSequence out{"soup", {}, {}};
    std::mt19937 random(1);
    Mesh mesh;
    for (std::uint32_t v = 0; v < vertices; ++v)
        mesh.positions.push_back({static_cast<float>(below(random, 1700)), static_cast<float>(below(random, 1700)),
                                  static_cast<float>(below(random, 1700))});
    for (std::uint32_t t = 0; t < triangles; ++t)
        mesh.triangles.push_back(
            apart ? Triangle{3 * t, 3 * t + 1, 3 * t + 2}
                  : Triangle{below(random, vertices), below(random, vertices), below(random, vertices)});
    give_attributes(mesh, all, 1);
    for (int t = 0; t < frames; ++t) out.frames.push_back({mesh, {}});
    return out;
}

EncoderOptions nothing_merged() {
    EncoderOptions options = test::enhanced_options();
    options.topology.merge_duplicates = false;
    options.topology.nearest_vertices = 64;
    options.topology.weight_width = 1000;
    return options;
}

// The decoder's memory never exceeds the estimate that the limits use.
void expect_within_estimate(const std::vector<Packet>& packets, const std::string& name) {
    SCOPED_TRACE(name);
    DecoderOptions options;
    options.threads = 2;
    Decoder decoder(options);
    const auto live = allocations().live;
    MeshCounts reference;
    bool tracking = false, presence = false;
    for (const auto& packet : packets) {
        reset_allocations();
        {
            const auto frame = decoder.decode_copy(packet);
            ASSERT_TRUE(frame.has_value()) << frame.error().message;
        }
        if (packet.kind == PacketKind::sequence) {
            const auto header = *read_sequence_header(packet.payload);
            tracking = header.node_spacing > 0;
            presence = header.version >= presence_version;
        }
        const auto type = frame_type(packet.kind);
        if (!type) continue;
        const auto& rules = rules_of(*type);
        const bool refers = rules.refers_to != RefersTo::nothing;
        auto coded = reference;
        if (*type != FrameType::tracked) {
            const auto header = read_frame_payload(packet.payload)->header;
            coded = {header.vertices, header.triangles};
        }
        const auto renewed = refers ? MeshCounts{} : coded;
        const auto kept = memory_of_reference(reference) +
                          (presence ? memory_of_presence(reference) + memory_of_presence(renewed) : 0) +
                          (tracking ? memory_of_tracking(reference) + memory_of_tracking(renewed) : 0);
        const auto estimate = kept + memory_of_frame(rules.memory, coded, refers ? reference : MeshCounts{});
        const auto taken = static_cast<std::uint64_t>(allocations().most_live - live);
        EXPECT_LE(taken, estimate) << "frame " << packet.frame << ", kind " << static_cast<int>(packet.kind);
        EXPECT_GE(taken, estimate / 20) << "frame " << packet.frame << ", kind " << static_cast<int>(packet.kind);
        if (!refers) reference = coded;
    }
}

TEST(DecoderMemory, IsWithinWhatTheLimitsTakeItFor) {
    expect_within_estimate(animated_stream(12000), "animated");
    expect_within_estimate(tracked_stream(12000), "tracked");
    expect_within_estimate(encode(soup(20000, 0, false, 2), nothing_merged()).packets, "points");
    expect_within_estimate(encode(soup(30000, 10000, true, 2), nothing_merged()).packets, "triangles apart");
    expect_within_estimate(encode(soup(2500, 40000, false, 2), nothing_merged()).packets, "many triangles");
    const auto tracked = [](const CodedSequence& coded) {
        ChanceMotion motion;
        motion.fields.turned = true;
        return with_tracked_frames(coded.packets, 1500, motion, 0, 1);
    };
    auto options = nothing_merged();
    options.key_interval = 1;
    expect_within_estimate(tracked(encode(soup(20000, 0, false, 2), options)), "points, tracked");
    expect_within_estimate(tracked(encode(soup(30000, 10000, true, 2), options)), "triangles apart, tracked");
    expect_within_estimate(tracked(encode(soup(2500, 40000, false, 2), options)), "many triangles, tracked");
    const auto there = [](const CodedSequence& coded) { return presence_stream(coded.packets); };
    expect_within_estimate(there(encode(soup(20000, 0, false, 2), options)), "points, some there");
    expect_within_estimate(there(encode(soup(30000, 10000, true, 2), options)), "triangles apart, some there");
    expect_within_estimate(there(encode(soup(2500, 40000, false, 2), options)), "many triangles, some there");
}

TEST(DecoderMemory, IsNotTakenForWhatAHeaderClaims) {
    const auto packets = animated_stream(150);
    for (const auto& packet : packets) {
        if (!is_frame(packet)) continue;
        Decoder decoder;
        for (const auto& before : packets) {
            if (before.frame == packet.frame && before.kind == packet.kind) break;
            ASSERT_TRUE(decoder.decode_copy(before).has_value());
        }
        auto payload = copy_of(*read_frame_payload(packet.payload));
        payload.header.vertices = 1u << 22;
        payload.header.triangles = 1u << 23;
        auto claims = packet;
        claims.payload = write_frame_payload(payload);
        claims.payload.resize(std::min<std::size_t>(claims.payload.size(), 1000));
        reset_allocations();
        const auto live = allocations().live;
        EXPECT_FALSE(decoder.decode_copy(claims).has_value());
        EXPECT_LT(allocations().most_live - live, 100000) << "kind " << static_cast<int>(packet.kind);
    }
}

// The memory for bones and mapping is not allocated until a frame needs it.
TEST(DecoderMemory, SkinningIsNotMadeForTrackedFrames) {
    const auto packets = tracked_stream(2000);
    const auto held = [&](bool skinned) {
        DecoderOptions options;
        options.threads = 1;
        const auto live = allocations().live;
        Decoder decoder(options);
        for (const auto& packet : packets) {
            EXPECT_TRUE(decoder.decode(packet).has_value());
            // Moves the I-frame's mesh by its bones.
            if (skinned && packet.kind == PacketKind::intra) {
                EXPECT_TRUE(decoder.conceal(0, 0).has_value());
            }
        }
        return allocations().live - live;
    };
    // At least the bone of each vertex and the vertices of each bone.
    EXPECT_GE(held(true), held(false) + 6 * 2000);
}

TEST(DecoderMemory, TrackedFramesThatAreLentCopyNoTriangles) {
    const auto packets = tracked_stream(2000);
    const auto taken = [&](bool lent) {
        DecoderOptions options;
        options.threads = 1;
        Decoder decoder(options);
        std::int64_t bytes = 0;
        for (const auto& packet : packets) {
            reset_allocations();
            if (lent)
                EXPECT_TRUE(decoder.decode(packet).has_value());
            else
                EXPECT_TRUE(decoder.decode_copy(packet).has_value());
            if (packet.kind == PacketKind::tracked) bytes = allocations().bytes;
        }
        return bytes;
    };
    const auto mesh = inspect(*std::find_if(packets.begin(), packets.end(), is_frame));
    ASSERT_TRUE(mesh.has_value());
    // A copy has positions, colours, normals, texture coordinates and triangles.
    EXPECT_GE(taken(false), taken(true) + 12 * (std::int64_t{mesh->vertices} + mesh->triangles));
}

TEST(DecoderMemory, IsRefusedBeforeItIsTaken) {
    const auto packets = animated_stream(1000);
    DecoderOptions options;
    options.max_memory = 1000000;
    Decoder decoder(options);
    for (const auto& packet : packets) {
        reset_allocations();
        const auto live = allocations().live;
        (void)decoder.decode_copy(packet);
        EXPECT_LT(allocations().most_live - live, 1000000);
    }
}

TEST(PacketReaderMemory, IsTakenForWhatWasPushedAlone) {
    Packet packet;
    packet.payload.assign(100, 1);
    auto bytes = write_packet(packet);
    bytes[24 + 3] = 0x0F;  // makes the size a quarter of a gigabyte
    const auto crc = crc32(std::span(bytes).subspan(4, 24));
    for (std::size_t i = 0; i < 4; ++i) bytes[28 + i] = static_cast<std::uint8_t>(crc >> (8 * i));
    PacketReader reader;
    reset_allocations();
    const auto live = allocations().live;
    reader.push(bytes);
    EXPECT_FALSE(reader.pull().has_value());
    EXPECT_EQ(reader.pending_bytes(), bytes.size());
    EXPECT_LT(allocations().most_live - live, 1000);
}

// The packets of a stream, repeated as one longer stream.
std::vector<Packet> repeated(const std::vector<Packet>& packets, std::uint32_t times) {
    std::vector<Packet> out;
    std::uint32_t frames = 0;
    for (const auto& packet : packets)
        if (is_frame(packet)) frames = packet.frame + 1;
    for (std::uint32_t i = 0; i < times; ++i)
        for (auto packet : packets) {
            if (packet.kind == PacketKind::index) continue;
            packet.frame += i * frames;
            packet.reference += i * frames;
            packet.timestamp_us += std::int64_t{i} * frames * 33333;
            out.push_back(std::move(packet));
        }
    return out;
}

std::int64_t most_memory_of_decoding(const std::vector<Packet>& packets) {
    DecoderOptions options;
    options.threads = 1;
    reset_allocations();
    const auto live = allocations().live;
    Decoder decoder(options);
    for (const auto& packet : packets) EXPECT_TRUE(decoder.decode_copy(packet).has_value());
    return allocations().most_live - live;
}

TEST(DecoderMemory, DoesNotGrowWithTheStream) {
    for (const auto& packets : {animated_stream(600), tracked_stream(600)}) {
        const auto twice = repeated(packets, 2), long_stream = repeated(packets, 30);
        EXPECT_EQ(most_memory_of_decoding(long_stream), most_memory_of_decoding(twice));
    }
}

TEST(EncoderMemory, GrowsWithTheIndexAlone) {
    const auto sequence = walking(6, 300);
    const auto most = [&](int times) {
        EncoderOptions options = test::enhanced_options();
        options.skeleton = sequence.skeleton;
        options.key_interval = 3;
        options.threads = 1;
        auto encoder = *Encoder::create(options);
        reset_allocations();
        const auto live = allocations().live;
        std::int64_t time = 0;
        for (int i = 0; i < times; ++i)
            for (const auto& frame : sequence.frames) {
                EXPECT_TRUE(encoder.push(frame.mesh, &*frame.pose, time += 33333).has_value());
                while (encoder.pull()) {
                }
            }
        return allocations().most_live - live;
    };
    const auto few = most(2);
    EXPECT_LT(most(12), few + few / 20);
}

}  // namespace
}  // namespace htvm
