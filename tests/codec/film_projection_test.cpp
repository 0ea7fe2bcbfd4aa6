// Streams whose texture is one camera's film: what is decoded has its places in that film.
#include "codec/reference/film_projection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "codec/filmed_sequences.h"
#include "codec/format/frame_payload.h"
#include "codec/format/sequence.h"

namespace htvm::internal {
namespace {

using namespace test;

std::vector<DecodedFrame> decoded_frames(const std::vector<Packet>& packets) {
    auto decoded = decode_packets(packets);
    for (const auto& error : decoded.errors) ADD_FAILURE() << error.message;
    return std::move(decoded.frames);
}

// u is x by depth, v is y by depth, and the depth is z.
constexpr FilmProjection simple{{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};

std::vector<QuantisedTexcoord> projected(const FilmProjection& projection, const std::vector<LatticePoint>& points) {
    std::vector<QuantisedTexcoord> out;
    project(projection, points, out);
    return out;
}

TEST(FilmProjection, PutsPointsWhereTheirRaysMeetTheFilm) {
    EXPECT_EQ(projected(simple, {{1, 3, 4}, {2, 6, 8}, {0, 4, 4}, {1, 1, 3}}),
              (std::vector<QuantisedTexcoord>{{16384, 49152}, {16384, 49152}, {0, 65536}, {21845, 21845}}));
}

TEST(FilmProjection, KeepsToTheFilmAndPutsWhatIsNotBeforeTheCameraInItsCorner) {
    EXPECT_EQ(projected(simple, {{9, -9, 4}, {1, 1, 0}, {1, 1, -4}}),
              (std::vector<QuantisedTexcoord>{{65536, 0}, {0, 0}, {0, 0}}));
    FilmProjection large;
    large.rows.fill(std::numeric_limits<float>::max());
    large.rows[11] = std::numeric_limits<float>::denorm_min();
    large.rows[8] = large.rows[9] = large.rows[10] = 0;
    EXPECT_EQ(projected(large, {{lattice_limit, lattice_limit, lattice_limit}, {-9, -9, -9}}),
              (std::vector<QuantisedTexcoord>{{65536, 65536}, {0, 0}}));
}

TEST(FilmProjection, ComesBackFromItsLayerWhichHas48BytesOfFiniteNumbers) {
    FilmProjection any;
    for (std::size_t i = 0; i < any.rows.size(); ++i) any.rows[i] = 0.37f * static_cast<float>(i) - 2;
    auto layer = write_projection_layer(any);
    ASSERT_EQ(layer.size(), 48u);
    EXPECT_EQ(read_projection_layer(layer).value(), any);
    EXPECT_FALSE(read_projection_layer(std::span(layer).first(47)));
    any.rows[7] = std::numeric_limits<float>::infinity();
    EXPECT_FALSE(read_projection_layer(write_projection_layer(any)));
    any.rows[7] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_FALSE(read_projection_layer(write_projection_layer(any)));
}

// Each vertex has the place where the camera sees it.
void expect_places_in_the_film(const Mesh& mesh, const FilmCamera& camera) {
    constexpr double pixel_share = 0.02;
    ASSERT_EQ(mesh.texcoords.size(), mesh.positions.size());
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        const auto& p = mesh.positions[v];
        const auto [x, y] =
            camera.place(static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2]));
        ASSERT_NEAR(static_cast<double>(mesh.texcoords[v][0]), x, pixel_share / 512);
        ASSERT_NEAR(static_cast<double>(mesh.texcoords[v][1]), y, pixel_share / 256);
    }
}

TEST(FilmedFrames, AreOfVersion8WhichAloneMayHaveThatLayout) {
    const auto coded = encode(filmed(horned_ball(2)), filmed_options());
    ASSERT_TRUE(coded.errors.empty()) << coded.errors[0];
    auto header = read_sequence_header(coded.packets.front().payload);
    ASSERT_TRUE(header);
    EXPECT_EQ(header->version, 8);
    EXPECT_EQ(header->texture, (StreamTexture{TextureLayout::projection, 512, 256}));
    header->version = 7;
    EXPECT_EQ(read_sequence_header(write_sequence_header(*header)).error().kind, ErrorKind::unsupported);
}

TEST(FilmedFrames, HaveThePlacesOfTheirDecodedPositionsInTheFilm) {
    for (const int group : {1, 3})
        for (const double step : {0.0, 20.0}) {
            SCOPED_TRACE(testing::Message() << "groups of " << group << ", the camera moves " << step << " mm");
            auto options = filmed_options();
            options.tracked.group = group;
            const auto coded = encode(filmed(horned_ball(7, 4), step), options);
            ASSERT_TRUE(coded.errors.empty()) << coded.errors[0];
            const auto frames = decoded_frames(coded.packets);
            ASSERT_EQ(frames.size(), 7u);
            FilmCamera camera;
            for (std::size_t i = 0; i < frames.size(); ++i, camera.right += step) {
                const auto& mesh = frames[i].mesh;
                EXPECT_EQ(mesh.texcoords, coded.reconstructions[i].texcoords);
                EXPECT_TRUE(mesh.colours.empty()) << "the pictures say them";
                expect_places_in_the_film(mesh, camera);
                ASSERT_FALSE(HasFatalFailure());
            }
        }
}

// A ball whose horn is on the side from frame 2 on: the region where it was is small enough to be patched.
TestSequence patched_ball() { return horned_ball(6, 2, 80, 0.03); }

std::size_t patch_in(const CodedSequence& coded) {
    const auto is_patch = [](const FrameInfo& info) { return info.type == FrameType::patched; };
    EXPECT_EQ(std::count_if(coded.infos.begin(), coded.infos.end(), is_patch), 1);
    return static_cast<std::size_t>(std::find_if(coded.infos.begin(), coded.infos.end(), is_patch) -
                                    coded.infos.begin());
}

TEST(FilmedFrames, ThatArePatchedHaveTheirPlacesInTheFilmAsWell) {
    for (const int group : {1, 3})
        for (const double step : {0.0, 20.0}) {
            SCOPED_TRACE(testing::Message() << "groups of " << group << ", the camera moves " << step << " mm");
            auto options = filmed_options();
            options.tracked.group = group;
            const auto coded = encode(filmed(patched_ball(), step), options);
            ASSERT_TRUE(coded.errors.empty()) << coded.errors[0];
            const auto patch = patch_in(coded);
            ASSERT_TRUE(patch > 0 && patch < 5) << patch;
            const auto frames = decoded_frames(coded.packets);
            ASSERT_EQ(frames.size(), 6u);
            EXPECT_NE(frames[patch].reference_topology, frames[patch - 1].reference_topology);
            EXPECT_EQ(frames[patch + 1].reference_topology, frames[patch].reference_topology);
            FilmCamera camera;
            for (std::size_t i = 0; i < frames.size(); ++i, camera.right += step) {
                const auto& mesh = frames[i].mesh;
                EXPECT_EQ(mesh.positions, coded.reconstructions[i].positions);
                if (frames[i].presence.empty()) {
                    EXPECT_EQ(mesh.triangles, coded.reconstructions[i].triangles);
                }
                EXPECT_EQ(mesh.texcoords, coded.reconstructions[i].texcoords);
                expect_places_in_the_film(mesh, camera);
                ASSERT_FALSE(HasFatalFailure());
            }
        }
}

// Who starts at the patch needs the meshes that it is made of, and not the frames between, nor their projections.
TEST(FilmedFrames, ThatArePatchedDecodeWithoutTheFramesBetween) {
    auto options = filmed_options();
    options.tracked.references = TrackedReferences::intra;
    const auto coded = encode(filmed(patched_ball(), 20), options);
    ASSERT_TRUE(coded.errors.empty()) << coded.errors[0];
    const auto patch = patch_in(coded);
    ASSERT_TRUE(patch > 1 && patch < 5) << patch;
    ASSERT_EQ(coded.infos[patch].reference, 0u);
    std::vector<Packet> needed;
    for (const auto& packet : coded.packets)
        if (!frame_type(packet.kind) || packet.frame == 0 || packet.frame >= patch) needed.push_back(packet);
    const auto all = decoded_frames(coded.packets), some = decoded_frames(needed);
    ASSERT_EQ(some.size(), 7 - patch);
    for (std::size_t i = patch; i < 6; ++i) {
        EXPECT_EQ(some[i - patch + 1].mesh.positions, all[i].mesh.positions);
        EXPECT_EQ(some[i - patch + 1].mesh.texcoords, all[i].mesh.texcoords);
    }
}

TEST(FilmedFrames, OfOneReferenceHaveOneTopologyAndPlacesOfTheirOwn) {
    const auto frames = decoded_frames(encode(filmed(horned_ball(3, 9), 20), filmed_options()).packets);
    ASSERT_EQ(frames.size(), 3u);
    ASSERT_EQ(frames[2].info.type, FrameType::tracked);
    EXPECT_EQ(frames[2].reference_topology, frames[0].reference_topology);
    EXPECT_NE(frames[2].mesh.texcoords, frames[0].mesh.texcoords);
}

TEST(FilmedFrames, OfACameraThatStaysTakeAsManyBytesAsWithoutIt) {
    const auto sequence = filmed(horned_ball(4, 9));
    const auto stays = encode(sequence, filmed_options());
    const auto moves = encode(filmed(horned_ball(4, 9), 20), filmed_options());
    ASSERT_EQ(stays.infos.size(), 4u);
    for (std::size_t i = 1; i < 4; ++i) {
        EXPECT_LE(stays.infos[i].bytes.overhead, 36u + 12u) << "packet header, place in the group, the frame's head";
        EXPECT_GE(moves.infos[i].bytes.overhead, stays.infos[i].bytes.overhead + 40) << "twelve numbers";
    }
}

TEST(FilmedFrames, WhoseCoordinatesAreNoProjectionAreRefusedAndTheSequenceGoesOn) {
    auto sequence = filmed(horned_ball(4, 9));
    for (auto& t : sequence.frames[1].mesh.texcoords) t = {t[0] * t[0], t[1] * t[0]};
    sequence.frames[2].mesh.texcoords.clear();
    const auto coded = encode(sequence, filmed_options());
    ASSERT_EQ(coded.errors.size(), 2u);
    EXPECT_NE(coded.errors[0].find("not one camera's projection"), std::string::npos) << coded.errors[0];
    EXPECT_NE(coded.errors[1].find("no texture coordinates"), std::string::npos) << coded.errors[1];
    EXPECT_EQ(decoded_frames(coded.packets).size(), 2u);
}

TEST(FilmedFrames, NeedTheTrackedProfileAndSayWhatIsThere) {
    auto options = filmed_options();
    options.tracked.presence = SurfacePresence::off;
    EXPECT_FALSE(Encoder::create(options));
    options = default_options(Profile::topology);
    options.texture = {TextureLayout::projection, 512, 256};
    EXPECT_FALSE(Encoder::create(options));
}

TEST(FilmedFrames, WithABadProjectionAreErrorsAndLeaveWhatWasThere) {
    const auto coded = encode(filmed(horned_ball(2, 9)), filmed_options());
    Decoder decoder;
    for (const auto& packet : coded.packets) {
        if (packet.kind == PacketKind::intra) {
            const auto read = read_frame_payload(packet.payload);
            ASSERT_TRUE(read);
            auto layer = read->of(Layer::charts);
            ASSERT_EQ(layer.size(), 48u);
            auto bad = packet;
            const auto at = static_cast<std::size_t>(layer.data() - packet.payload.data());
            bad.payload[at + 2] = 0x80;
            bad.payload[at + 3] = 0x7F;  // infinity
            EXPECT_EQ(decoder.decode(bad).error().kind, ErrorKind::corrupt_stream);
        }
        EXPECT_TRUE(decoder.decode(packet));
    }
}

}  // namespace
}  // namespace htvm::internal
