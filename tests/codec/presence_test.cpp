// Presence: which vertices of a tracked mesh are there, how it is coded, and what is shown of it.
#include <gtest/gtest.h>

#include <algorithm>

#include "codec/enhanced_options.h"
#include "codec/presence_by_chance.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

using namespace test;

// Vertices in rows of eleven, triangles between them.
struct Grid {
    tfan_test::TestMesh mesh = tfan_test::grid(11, 9);
    std::size_t vertices = mesh.vertex_count;
    VerticesAround around = vertices_around(vertices, mesh.triangles);
    std::vector<LatticePoint> positions = tfan_test::positions_of(mesh, 1);
};

std::vector<std::uint8_t> written(const VerticesAround& around, std::span<const std::uint8_t> before,
                                  std::span<const std::uint8_t> presence) {
    RangeEncoder encoder;
    write_presence(encoder, around, before, presence);
    return encoder.finish();
}

Presence read(const std::vector<std::uint8_t>& bytes, const VerticesAround& around,
              std::span<const std::uint8_t> before) {
    RangeDecoder decoder(bytes);
    auto out = read_presence(decoder, around, before);
    EXPECT_FALSE(decoder.exhausted());
    return out;
}

TEST(Presence, IsReadAsItWasWrittenWhateverWasBefore) {
    std::mt19937 random(1);
    for (const auto& shape : tfan_test::special_meshes()) {
        SCOPED_TRACE(shape.name);
        const auto around = vertices_around(shape.vertex_count, shape.triangles);
        const auto positions = tfan_test::positions_of(shape, 1);
        for (const auto gone : removals)
            for (const auto gone_before : removals) {
                const auto before = presence_by_chance(gone_before, positions, random);
                const auto presence = presence_by_chance(gone, positions, random);
                auto doubtful = presence_between(before, presence_by_chance(Removal::region, positions, random));
                EXPECT_EQ(read(written(around, before, presence), around, before), presence);
                EXPECT_EQ(read(written(around, doubtful, presence), around, doubtful), presence);
                EXPECT_EQ(read(written(around, {}, presence), around, {}), presence);
            }
    }
}

TEST(Presence, WithoutAnythingBeforeAllWasThere) {
    const Grid grid;
    std::mt19937 random(2);
    const auto presence = presence_by_chance(Removal::region, grid.positions, random);
    EXPECT_EQ(written(grid.around, {}, presence), written(grid.around, Presence(grid.vertices, 1), presence));
}

TEST(Presence, WhatIsAsBeforeTakesNoMoreThanAByte) {
    const Grid grid;
    std::mt19937 random(3);
    const auto presence = presence_by_chance(Removal::some, grid.positions, random);
    EXPECT_LE(written(grid.around, presence, presence).size(), 1u);
    // Behind both of the frames around it a vertex is there if that is doubtful.
    auto doubtful = presence;
    for (auto& is : doubtful)
        if (is == 1) is = doubtful_presence;
    EXPECT_LE(written(grid.around, doubtful, presence).size(), 1u);
}

TEST(Presence, ABorderThatMovesByOneVertexTakesLessThanThreeBitsForEachThatChanges) {
    // Half of a wide grid was there; now one row more is.
    constexpr std::uint32_t width = 101, height = 41;
    const auto mesh = tfan_test::grid(width, height);
    const auto around = vertices_around(mesh.vertex_count, mesh.triangles);
    const std::size_t rows = mesh.vertex_count / width;
    Presence before(mesh.vertex_count, 0), now(mesh.vertex_count, 0);
    std::fill_n(before.begin(), width * (rows / 2), 1);
    std::fill_n(now.begin(), width * (rows / 2 + 1), 1);
    EXPECT_LT(8 * written(around, before, now).size(), 3 * width);
    // Without knowing what was there, it takes more.
    EXPECT_LT(written(around, before, now).size(), written(around, {}, now).size());
}

TEST(Presence, AnyBytesGiveZeroOrOneForEachVertex) {
    const Grid grid;
    std::mt19937 random(4);
    Presence doubtful(grid.vertices);
    for (auto& is : doubtful) is = static_cast<std::uint8_t>(below(random, 3));
    for (int i = 0; i < 200; ++i) {
        std::vector<std::uint8_t> bytes(below(random, 40));
        for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
        RangeDecoder decoder(bytes);
        const auto presence = read_presence(decoder, grid.around, doubtful);
        ASSERT_EQ(presence.size(), grid.vertices);
        EXPECT_TRUE(std::ranges::all_of(presence, [](auto is) { return is <= 1; }));
    }
}

TEST(Presence, ALayerIsReadAsWrittenAndOneThatIsCutShortIsCorrupt) {
    const Grid grid;
    std::mt19937 random(5);
    const auto presence = presence_by_chance(Removal::some, grid.positions, random);
    auto layer = write_presence_layer(grid.mesh.triangles, presence);
    ASSERT_GT(layer.size(), 8u);
    const auto back = read_presence_layer(layer, grid.vertices, grid.mesh.triangles);
    ASSERT_TRUE(back.has_value());
    EXPECT_EQ(*back, presence);
    layer.resize(2);
    const auto cut = read_presence_layer(layer, grid.vertices, grid.mesh.triangles);
    ASSERT_FALSE(cut.has_value());
    EXPECT_EQ(cut.error().kind, ErrorKind::corrupt_stream);
}

TEST(Presence, BetweenTwoFramesItIsDoubtfulWhereTheyDiffer) {
    EXPECT_EQ(presence_between(Presence{0, 0, 1, 1}, Presence{0, 1, 0, 1}), (Presence{0, 2, 2, 1}));
    // Before the first of them everything was there.
    EXPECT_EQ(presence_between({}, Presence{0, 1}), (Presence{2, 1}));
    EXPECT_EQ(presence_between({}, {}), Presence{});
}

TEST(Presence, OfAPatchedMeshStaysWhatItWasAndWhatIsNewIsThere) {
    const std::vector<std::uint32_t> stays{0, 2, 3};
    EXPECT_EQ(presence_of_patched(Presence{0, 0, 1, 0}, stays, 5), (Presence{0, 1, 0, 1, 1}));
    EXPECT_EQ(presence_of_patched({}, stays, 4), (Presence{1, 1, 1, 1}));
}

TEST(Presence, ATriangleIsShownIfItsThreeVerticesAreThere) {
    const std::vector<Triangle> triangles{{0, 1, 2}, {1, 3, 2}, {2, 1, 0}, {0, 0, 0}};
    std::vector<Triangle> shown{{9, 9, 9}};
    triangles_shown(triangles, Presence{1, 1, 1, 0}, shown);
    EXPECT_EQ(shown, (std::vector<Triangle>{{0, 1, 2}, {2, 1, 0}, {0, 0, 0}}));
    triangles_shown(triangles, Presence{0, 1, 1, 1}, shown);
    EXPECT_EQ(shown, (std::vector<Triangle>{{1, 3, 2}}));
    triangles_shown(triangles, {}, shown);
    EXPECT_EQ(shown, triangles);
    EXPECT_TRUE(anything_absent(Presence{1, 0}));
    EXPECT_FALSE(anything_absent(Presence{1, 1}));
    EXPECT_FALSE(anything_absent({}));
}

// ---- In the decoder -------------------------------------------------------------------------------------------------

// A grid as an I-frame of which a region is missing, to which frames are added.
PresenceStreamByChance grid_stream(Removal gone, bool told = true) {
    EncoderOptions options = test::enhanced_options();
    options.key_interval = 1;
    options.geometry_step = 6;
    const auto intra = encode(sequence_of(tfan_test::grid(11, 9), 1, none), options).packets;
    PresenceStreamByChance out(intra[0], 1500, {}, 3);
    out.add_intra(*std::ranges::find(intra, PacketKind::intra, &Packet::kind), gone, told);
    return out;
}

std::vector<DecodedFrame> frames_of(const PresenceStreamByChance& stream) {
    const auto decoded = decode_packets(stream.packets());
    EXPECT_TRUE(decoded.errors.empty());
    return decoded.frames;
}

std::vector<Triangle> shown_of(const std::vector<Triangle>& triangles, const Presence& presence) {
    std::vector<Triangle> out;
    triangles_shown(triangles, presence, out);
    return out;
}

TEST(PresenceDecoder, ShowsTheTrianglesThatAreThereAndAllVertices) {
    auto stream = grid_stream(Removal::nothing, false);
    const auto hole = stream.any_change();
    stream.add_tracked(false, hole);
    const auto frames = frames_of(stream);
    ASSERT_EQ(frames.size(), 2u);
    EXPECT_LT(frames[1].mesh.triangles.size(), frames[0].mesh.triangles.size());
    EXPECT_EQ(frames[1].mesh.triangles, shown_of(frames[0].mesh.triangles, hole));
    EXPECT_EQ(frames[1].mesh.positions.size(), frames[0].mesh.positions.size());
    EXPECT_EQ(frames[1].info.triangles, frames[1].mesh.triangles.size());
}

TEST(PresenceDecoder, TheSamePresenceHasTheSameTopologyNumberAndAllOfItTheReferencesOwn) {
    auto stream = grid_stream(Removal::nothing, false);
    const auto all = stream.last_presence(false);
    auto one = all, other = all;
    one[0] = other[5] = 0;
    for (const auto& presence : {all, one, one, other, all, one}) stream.add_tracked(false, presence);
    const auto frames = frames_of(stream);
    ASSERT_EQ(frames.size(), 7u);
    std::vector<std::uint32_t> numbers;
    for (const auto& frame : frames) numbers.push_back(frame.topology);
    EXPECT_EQ(numbers[1], numbers[0]);
    EXPECT_NE(numbers[2], numbers[0]);
    EXPECT_EQ(numbers[3], numbers[2]);
    EXPECT_NE(numbers[4], numbers[2]);
    EXPECT_NE(numbers[4], numbers[0]);
    EXPECT_EQ(numbers[5], numbers[0]);
    for (std::size_t a = 0; a < frames.size(); ++a)
        for (std::size_t b = 0; b < a; ++b)
            if (numbers[a] == numbers[b]) {
                EXPECT_EQ(frames[a].mesh.triangles, frames[b].mesh.triangles);
            }
}

TEST(PresenceDecoder, LendsWhichVerticesAreThereAndWhichMeshTheyArePartsOf) {
    auto stream = grid_stream(Removal::nothing, false);
    const auto all = stream.last_presence(false);
    auto one = all;
    one[3] = 0;
    for (const auto& presence : {all, one, all}) stream.add_tracked(false, presence);
    const auto frames = frames_of(stream);
    ASSERT_EQ(frames.size(), 4u);
    const std::vector<Presence> expected{{}, {}, one, {}};  // none where all are there
    for (std::size_t f = 0; f < frames.size(); ++f) {
        EXPECT_EQ(frames[f].presence, expected[f]) << f;
        EXPECT_EQ(frames[f].reference_topology, frames[0].topology) << f;
    }
    EXPECT_NE(frames[2].topology, frames[2].reference_topology);
}

TEST(PresenceDecoder, AnIntraFramesLayerSaysWhatIsThereOfItAndOfWhatRefersToIt) {
    auto stream = grid_stream(Removal::region);
    stream.add_tracked(false, stream.last_presence(false));
    const auto told = frames_of(stream);
    const auto whole = frames_of(grid_stream(Removal::region, false));
    ASSERT_EQ(told.size(), 2u);
    EXPECT_EQ(told[0].mesh.positions, whole[0].mesh.positions);
    EXPECT_EQ(told[0].mesh.triangles, shown_of(whole[0].mesh.triangles, stream.last_presence(false)));
    EXPECT_LT(told[0].mesh.triangles.size(), whole[0].mesh.triangles.size());
    EXPECT_EQ(told[1].mesh.triangles, told[0].mesh.triangles);
    EXPECT_EQ(told[1].topology, told[0].topology);
}

TEST(PresenceDecoder, APredictedFrameShowsOfItsReferenceWhatIsThere) {
    auto stream = grid_stream(Removal::region);
    stream.add_predicted();
    const auto frames = frames_of(stream);
    ASSERT_EQ(frames.size(), 2u);
    EXPECT_EQ(frames[1].mesh.triangles, frames[0].mesh.triangles);
    EXPECT_EQ(frames[1].topology, frames[0].topology);
}

TEST(PresenceDecoder, AnIntraFrameThatNothingRefersToIsShownWhole) {
    auto stream = grid_stream(Removal::region);
    auto packets = stream.packets();
    packets.back().flags = packet_flag::flags_valid | packet_flag::droppable;
    const auto unreferred = decode_packets(packets).frames;
    ASSERT_EQ(unreferred.size(), 1u);
    EXPECT_EQ(unreferred[0].mesh.triangles.size(),
              frames_of(grid_stream(Removal::nothing, false))[0].mesh.triangles.size());
}

TEST(PresenceDecoder, AStandInShowsWhatWasThere) {
    auto stream = grid_stream(Removal::region);
    stream.add_tracked(false, stream.any_change());
    Decoder decoder;
    const auto& packets = stream.packets();
    ASSERT_TRUE(decoder.decode(packets[0]).has_value());
    for (std::size_t i = 1; i < packets.size(); ++i) {
        const auto shown = *decoder.decode_copy(packets[i]);
        const auto stand_in = decoder.conceal_copy(shown->info.frame + 1, 0);
        ASSERT_TRUE(stand_in.has_value());
        EXPECT_EQ(stand_in->mesh.triangles, shown->mesh.triangles);
        EXPECT_EQ(stand_in->topology, shown->topology);
    }
}

TEST(PresenceDecoder, AGroupsFramesAreShownAsTheirOwnPacketsSay) {
    auto stream = grid_stream(Removal::nothing, false);
    const auto all = frames_of(stream)[0].mesh.triangles;
    stream.add_group(4, false);
    const auto frames = frames_of(stream);
    ASSERT_EQ(frames.size(), 5u);
    for (int t = 1; t < 4; ++t) EXPECT_LT(frames[static_cast<std::size_t>(t)].mesh.triangles.size(), all.size());
    EXPECT_EQ(frames[4].mesh.triangles, all);  // the group's last frame is as the reference
}

TEST(PresenceDecoder, AStreamOfAnEarlierVersionPassesOverTheLayer) {
    auto packets = grid_stream(Removal::region).packets();
    auto header = *read_sequence_header(packets[0].payload);
    header.version = textured_version;
    packets[0].payload = write_sequence_header(header);
    const auto frames = decode_packets(packets).frames;
    ASSERT_EQ(frames.size(), 1u);
    EXPECT_EQ(frames[0].mesh.triangles.size(),
              frames_of(grid_stream(Removal::nothing, false))[0].mesh.triangles.size());
}

TEST(PresenceDecoder, AVertexThatIsRepeatedAtASeamIsThereIfItIs) {
    // An I-frame with charts, of which every other vertex is missing.
    auto options = test::options_at_2_mm(Profile::tracked);
    options.texture = {TextureLayout::charts, 64, 64};
    auto packets = encode(sequence_of(tfan_test::perturbed_sphere(15, 20, 2), 1, none), options).packets;
    std::erase_if(packets, [](const Packet& packet) {
        return packet.kind != PacketKind::sequence && packet.kind != PacketKind::intra;
    });
    const auto whole = decode_packets(packets).frames.at(0).mesh;
    auto payload = copy_of(*read_frame_payload(packets[1].payload));
    const std::size_t vertices = payload.header.vertices;
    ASSERT_GT(whole.positions.size(), vertices) << "there is no seam";
    Presence presence(vertices, 1);
    for (std::size_t v = 0; v < vertices; v += 9) presence[v] = 0;
    payload.set(Layer::presence,
                write_presence_layer(decode_intra_frame(view_of(payload), nullptr)->triangles, presence));
    packets[1].payload = write_frame_payload(payload);
    auto header = *read_sequence_header(packets[0].payload);
    header.version = presence_version;
    packets[0].payload = write_sequence_header(header);
    const auto shown = decode_packets(packets).frames.at(0).mesh;
    EXPECT_EQ(shown.positions, whole.positions);
    EXPECT_EQ(shown.texcoords, whole.texcoords);
    // Copies lie where the vertex does that they are of.
    std::vector<Vector3f> missing;
    for (std::size_t v = 0; v < vertices; v += 9) missing.push_back(whole.positions[v]);
    std::vector<Triangle> expected;
    for (const auto& t : whole.triangles)
        if (std::ranges::none_of(
                t, [&](auto v) { return std::ranges::find(missing, whole.positions[v]) != missing.end(); }))
            expected.push_back(t);
    EXPECT_EQ(shown.triangles, expected);
    EXPECT_LT(shown.triangles.size(), whole.triangles.size());
}

}  // namespace
}  // namespace htvm::internal
