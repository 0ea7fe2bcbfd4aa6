// Streams with charts: what the decoder shows has texture coordinates of the stream's own, which last.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "codec/format/sequence.h"
#include "codec/patched_sequences.h"
#include "codec/test_sequences.h"
#include "htvm/decoder.hpp"

namespace htvm::internal {
namespace {

using namespace test;

constexpr auto T = FrameType::tracked, TP = FrameType::patched;

EncoderOptions charted_options() {
    auto out = patched_options();
    out.texture = {TextureLayout::charts, 512, 256};
    return out;
}

// The horned ball, and beside it a bumpy one that stays: without colours an I-frame of the first alone would take
// hardly more than a patch does.
TestSequence two_balls(int frames) {
    auto out = horned_ball(frames);
    const auto beside = ball(4, [](const Vector3d& d) {
        return 300 + 2 * std::sin(9 * d[0]) * std::sin(11 * d[1]) * std::sin(7 * d[2] + 1);
    });
    for (auto& frame : out.frames) {
        auto& mesh = frame.mesh;
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        for (const auto& p : beside.positions) {
            mesh.positions.push_back({static_cast<float>(p.x + 900), static_cast<float>(p.y), static_cast<float>(p.z)});
            mesh.colours.push_back({90, 120, 150});
        }
        for (const auto& [a, b, c] : beside.triangles) mesh.triangles.push_back({first + a, first + b, first + c});
    }
    return out;
}

std::vector<DecodedFrame> decoded_frames(const std::vector<Packet>& packets) {
    auto decoded = decode_packets(packets);
    for (const auto& error : decoded.errors) ADD_FAILURE() << error.message;
    return std::move(decoded.frames);
}

// The texture coordinates of each triangle's corners.
using Corners = std::array<Vector2f, 3>;
std::vector<Corners> corners_of(const Mesh& mesh) {
    std::vector<Corners> out;
    for (const auto& [a, b, c] : mesh.triangles)
        out.push_back({mesh.texcoords[a], mesh.texcoords[b], mesh.texcoords[c]});
    return out;
}

TEST(ChartedFrames, AreOfVersion6AndSayHowLargeThePicturesAre) {
    const auto coded = encode(horned_ball(2), charted_options());
    ASSERT_TRUE(coded.errors.empty());
    Decoder decoder;
    ASSERT_TRUE(decoder.decode_copy(coded.packets.front()));
    EXPECT_EQ(decoder.sequence()->version, 6);
    EXPECT_EQ(decoder.sequence()->texture, (StreamTexture{TextureLayout::charts, 512, 256}));
    const auto without = encode(horned_ball(2), patched_options());
    ASSERT_TRUE(decoder.decode_copy(without.packets.front()));
    EXPECT_EQ(decoder.sequence()->version, 4);
    EXPECT_EQ(decoder.sequence()->texture, StreamTexture());
}

TEST(ChartedFrames, DecodeToWhatTheEncoderHas) {
    for (const int group : {1, 3}) {
        auto options = charted_options();
        options.tracked.group = group;
        const auto coded = encode(horned_ball(6), options);
        ASSERT_TRUE(coded.errors.empty()) << coded.errors[0];
        const auto frames = decoded_frames(coded.packets);
        ASSERT_EQ(frames.size(), 6u);
        for (std::size_t i = 0; i < frames.size(); ++i) {
            const auto &mesh = frames[i].mesh, &sent = coded.reconstructions[i];
            EXPECT_EQ(mesh.positions, sent.positions);
            EXPECT_EQ(mesh.triangles, sent.triangles);
            EXPECT_EQ(mesh.texcoords, sent.texcoords);
            EXPECT_EQ(mesh.texcoords.size(), mesh.positions.size());
            EXPECT_TRUE(mesh.colours.empty()) << "the pictures say them";
            EXPECT_EQ(frames[i].info.vertices, mesh.positions.size());
            EXPECT_EQ(coded.infos[i].vertices, mesh.positions.size());
        }
    }
}

TEST(ChartedFrames, OfOneReferenceHaveTheSameCoordinatesAndTopology) {
    const auto frames = decoded_frames(encode(horned_ball(3, 9), charted_options()).packets);
    ASSERT_EQ(frames.size(), 3u);
    for (std::size_t i = 1; i < 3; ++i) {
        ASSERT_EQ(frames[i].info.type, T);
        EXPECT_EQ(frames[i].topology, frames[0].topology);
        EXPECT_EQ(frames[i].mesh.texcoords, frames[0].mesh.texcoords);
        EXPECT_EQ(frames[i].mesh.triangles, frames[0].mesh.triangles);
    }
}

TEST(ChartedFrames, AtSeamsVerticesAreRepeatedAndMoveAsOne) {
    auto encoder = Encoder::create(charted_options());
    const auto sequence = horned_ball(3, 9);
    for (std::int64_t i = 0; i < 3; ++i) {
        ASSERT_TRUE(encoder->push(sequence.frames[static_cast<std::size_t>(i)].mesh, nullptr, 33333 * i));
        const auto mesh = encoder->reconstruction();
        const auto repeated = encoder->repeated_vertices();
        ASSERT_GT(repeated.size(), 0u);
        const std::size_t own = mesh.positions.size() - repeated.size();
        for (std::size_t k = 0; k < repeated.size(); ++k) {
            ASSERT_LT(repeated[k], own);
            EXPECT_EQ(mesh.positions[own + k], mesh.positions[repeated[k]]);
            EXPECT_NE(mesh.texcoords[own + k], mesh.texcoords[repeated[k]]);
        }
    }
}

TEST(ChartedFrames, WherePartOfTheMeshIsReplacedTheRestKeepsItsCoordinates) {
    const auto coded = encode(two_balls(5), charted_options());
    ASSERT_TRUE(coded.errors.empty()) << coded.errors[0];
    const auto frames = decoded_frames(coded.packets);
    ASSERT_EQ(frames.size(), 5u);
    ASSERT_EQ(frames[2].info.type, TP);
    EXPECT_GT(frames[2].info.bytes[Layer::charts], 0u);
    const auto before = corners_of(frames[1].mesh), after = corners_of(frames[2].mesh);
    const std::set<Corners> known(before.begin(), before.end());
    const auto kept =
        std::count_if(after.begin(), after.end(), [&](const Corners& corners) { return known.count(corners) > 0; });
    EXPECT_GT(kept, static_cast<std::ptrdiff_t>(after.size() / 2));
    EXPECT_LT(kept, static_cast<std::ptrdiff_t>(after.size()));
    EXPECT_EQ(frames[3].mesh.texcoords, frames[2].mesh.texcoords);
    EXPECT_NE(frames[3].topology, frames[1].topology);
}

TEST(ChartedFrames, AreEncodedToTheSameBytesByAnyNumberOfThreads) {
    auto options = charted_options();
    options.threads = 1;
    const auto one = encode(horned_ball(4), options);
    options.threads = 3;
    const auto three = encode(horned_ball(4), options);
    ASSERT_EQ(one.packets.size(), three.packets.size());
    for (std::size_t i = 0; i < one.packets.size(); ++i) EXPECT_EQ(one.packets[i].payload, three.packets[i].payload);
}

TEST(ChartedFrames, OfAMeshWithTextureCoordinatesAreRefused) {
    auto encoder = Encoder::create(charted_options());
    auto mesh = horned_ball(1).frames[0].mesh;
    mesh.texcoords.resize(mesh.positions.size());
    const auto pushed = encoder->push(mesh, nullptr, 0);
    ASSERT_FALSE(pushed);
    EXPECT_EQ(pushed.error().kind, ErrorKind::bad_input);
    mesh.texcoords.clear();
    EXPECT_TRUE(encoder->push(mesh, nullptr, 0));
}

TEST(ChartedFrames, OfAMeshWithoutTrianglesHaveNoCoordinates) {
    auto encoder = Encoder::create(charted_options());
    auto mesh = horned_ball(1).frames[0].mesh;
    mesh.triangles.clear();
    ASSERT_TRUE(encoder->push(mesh, nullptr, 0));
    EXPECT_TRUE(encoder->reconstruction().texcoords.empty());
}

TEST(ChartedFrames, NeedASizeOfPicturesAndTheTrackedProfile) {
    auto options = charted_options();
    options.texture.width = 0;
    EXPECT_FALSE(Encoder::create(options));
    options.texture.width = 4097;
    EXPECT_FALSE(Encoder::create(options));
    options = default_options(Profile::topology);
    options.texture = {TextureLayout::charts, 512, 512};
    EXPECT_FALSE(Encoder::create(options));
    options.texture.layout = TextureLayout::captured;
    EXPECT_TRUE(Encoder::create(options));
    options.texture.layout = TextureLayout::none;
    EXPECT_FALSE(Encoder::create(options));
}

TEST(ChartedFrames, WithMoreRepeatedVerticesThanTheDecoderAcceptsAreRefused) {
    const auto coded = encode(horned_ball(1), charted_options());
    DecoderOptions options;
    options.max_vertices = static_cast<std::uint32_t>(coded.reconstructions[0].positions.size());
    EXPECT_TRUE(decode_packets(coded.packets, options).errors.empty());
    --options.max_vertices;
    EXPECT_FALSE(decode_packets(coded.packets, options).errors.empty());
}

TEST(ChartedFrames, SequenceHeadersWithWrongSizesAreErrors) {
    SequenceHeader header;
    header.skeleton.joint_names = {"a", "b"};
    header.skeleton.bones = {{0, 1}};
    header.radii = {1};
    header.version = textured_version;
    header.texture = {TextureLayout::charts, 4096, 1};
    EXPECT_EQ(read_sequence_header(write_sequence_header(header))->texture, header.texture);
    for (const StreamTexture& wrong :
         {StreamTexture{TextureLayout::charts, 4097, 1}, StreamTexture{TextureLayout::captured, 0, 1},
          StreamTexture{TextureLayout::none, 1, 1}, StreamTexture{TextureLayout(3), 1, 1}}) {
        header.texture = wrong;
        EXPECT_FALSE(read_sequence_header(write_sequence_header(header)));
    }
    header.texture = {};
    EXPECT_TRUE(read_sequence_header(write_sequence_header(header)));
    auto cut = write_sequence_header(header);
    cut.pop_back();
    EXPECT_FALSE(read_sequence_header(cut));
}

}  // namespace
}  // namespace htvm::internal
