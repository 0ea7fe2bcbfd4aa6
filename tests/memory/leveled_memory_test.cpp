// What levels below a reference take of a decoder's memory is within what its limits take them for; and what is made of
// captures of the usual size is let through.
#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "codec/ball.h"
#include "codec/enhanced_options.h"
#include "codec/format/decoder_limits.h"
#include "codec/format/frame_kinds.h"
#include "codec/levels_by_chance.h"
#include "codec/moving_sequences.h"
#include "codec/presence_by_chance.h"
#include "codec/test_sequences.h"
#include "memory/counted_allocations.h"

namespace htvm {

using namespace internal;
namespace {

using namespace test;

// The most that decoding takes; nothing if the decoder refuses it for its memory.
std::optional<std::uint64_t> taken_by(std::span<const Packet> packets, std::uint64_t max_memory) {
    DecoderOptions options;
    options.threads = 1;
    options.max_memory = max_memory;
    std::int64_t most = 0;
    const auto live = allocations().live;
    Decoder decoder(options);
    for (const auto& packet : packets) {
        reset_allocations();
        const auto frame = decoder.decode_copy(packet);
        most = std::max(most, allocations().most_live - live);
        if (frame) continue;
        EXPECT_EQ(frame.error().kind, ErrorKind::limit) << frame.error().message;
        return std::nullopt;
    }
    return static_cast<std::uint64_t>(most);
}

// The least that a decoder must be allowed to take so that it decodes these, to 5 %.
std::uint64_t least_allowed(std::span<const Packet> packets) {
    std::uint64_t below = 1 << 20, above = std::uint64_t{1} << 32;
    while (above - below > above / 20) {
        const auto middle = below + (above - below) / 2;
        (taken_by(packets, middle) ? above : below) = middle;
    }
    return above;
}

// Up to each frame: never more is taken than had to be allowed, and not much less.
void expect_bounds_fit(const std::vector<Packet>& packets, const std::string& name) {
    SCOPED_TRACE(name);
    for (std::size_t count = 1; count <= packets.size(); ++count) {
        const auto& last = packets[count - 1];
        if (!is_frame(last)) continue;
        const std::span prefix(packets.data(), count);
        const auto allowed = least_allowed(prefix);
        const auto taken = *taken_by(prefix, allowed);
        EXPECT_LE(taken, allowed) << "frame " << last.frame << ", kind " << static_cast<int>(last.kind);
        EXPECT_GE(taken, allowed / 8) << "frame " << last.frame << ", kind " << static_cast<int>(last.kind);
    }
}

TestSequence walking_in_colour(int frames, int vertices, int step = 1, double noise = 0) {
    SynthOptions options;
    options.vertices = vertices;
    options.surface_noise_power = noise;
    TestSequence out{"walking", {}, {}};
    for (int t = 0; t < frames; ++t) out.frames.push_back({synth_frame(options, 50 + step * t).mesh, {}});
    return out;
}

EncoderOptions in_levels() {
    auto out = default_options(Profile::tracked);
    out.tracked.levels = ReferenceLevels::on;
    return out;
}

bool has_kind(const std::vector<Packet>& packets, PacketKind kind) {
    return std::any_of(packets.begin(), packets.end(), [&](const Packet& packet) { return packet.kind == kind; });
}

TEST(LeveledMemory, IsWithinWhatTheLimitsTakeItForWhereAnEncoderMadeIt) {
    auto options = in_levels();
    const auto coloured = encode(walking_in_colour(3, 8000), options).packets;
    EXPECT_TRUE(has_kind(coloured, PacketKind::patched));
    expect_bounds_fit(coloured, "colours");
    options.texture = {TextureLayout::charts, 512, 512};
    const auto charts = encode(walking_in_colour(3, 8000), options).packets;
    EXPECT_TRUE(has_kind(charts, PacketKind::patched));
    expect_bounds_fit(charts, "charts");
}

// Each triangle by itself; or many on few vertices; or a closed surface.
LatticeMesh base_of(std::string_view kind) {
    if (kind == "closed") return ball(4, [](const Vector3d& d) { return 9000 + 2000 * d[1] * d[1]; });
    std::mt19937 random(3);
    const bool apart = kind == "apart";
    LatticeMesh out;
    const std::uint32_t vertices = apart ? 3000 : 300, triangles = apart ? 1000 : 3000;
    for (std::uint32_t v = 0; v < vertices; ++v)
        out.positions.push_back(
            {between(random, -9000, 9000), between(random, -9000, 9000), between(random, -9000, 9000)});
    for (std::uint32_t t = 0; t < triangles; ++t)
        out.triangles.push_back(
            apart ? Triangle{3 * t, 3 * t + 1, 3 * t + 2}
                  : Triangle{below(random, vertices), below(random, vertices), below(random, vertices)});
    return out;
}

TEST(LeveledMemory, IsWithinWhatTheLimitsTakeItForWhateverTheConnectivity) {
    const auto model = encode(walking_in_colour(1, 1500), enhanced_options()).packets;
    for (const std::string kind : {"apart", "many triangles", "closed"}) {
        std::mt19937 random(5);
        LeveledByChanceOptions options;
        options.levels.depth = {kind == "many triangles" ? 1u : 2u, 1};
        options.levels.step = 128;
        options.levels.rules.fill({0, 8});
        options.referred = 0;
        options.normals = true;
        auto coded = leveled_by_chance(base_of(kind), options, random);
        ASSERT_TRUE(coded) << kind;
        const auto intra =
            std::find_if(model.begin(), model.end(), [](const Packet& p) { return p.kind == PacketKind::intra; });
        const auto plain = *read_frame_payload(intra->payload);
        coded->payload.set(Layer::pose, {plain.of(Layer::pose).begin(), plain.of(Layer::pose).end()});
        auto packet = *intra;
        packet.payload = write_frame_payload(coded->payload);
        ChanceMotion motion;
        motion.fields.turned = true;
        PresenceStreamByChance stream(model[0], 1500, motion, 1);
        stream.add_intra(packet, Removal::region);
        for (const bool from_last : {false, true}) stream.add_tracked(from_last, stream.any_change());
        if (kind == "closed") stream.add_patched(Removal::region, Removal::region);
        stream.add_intra(packet, Removal::region);
        expect_bounds_fit(stream.packets(), kind);
    }
}

// web/packages/decoder/src/decoder.ts
TEST(LeveledMemory, OfACaptureOf30000VerticesIsWhatTheWebDecoderAllows) {
    constexpr std::uint64_t allowed = std::uint64_t{384} << 20;
    auto options = in_levels();
    const auto packets = encode(walking_in_colour(3, 30000, 6, 2.25), options).packets;
    EXPECT_TRUE(has_kind(packets, PacketKind::patched));
    EXPECT_TRUE(taken_by(packets, allowed).has_value());
    EXPECT_LT(least_allowed(packets), allowed / 3);
}

}  // namespace
}  // namespace htvm
