// Tracked streams whose references have levels: what frames refer to is the mesh of one of the first; what is shown has
// the detail of all.
#include <gtest/gtest.h>

#include <algorithm>

#include "codec/test_sequences.h"
#include "htvm/decoder.hpp"
#include "surface/surface_distance.h"

namespace htvm::internal {
namespace {

using namespace test;

EncoderOptions tracked(ReferenceLevels levels) {
    EncoderOptions options = default_options(Profile::tracked);
    options.tracked.levels = levels;
    return options;
}

// A person of so many vertices in motion, with colours. noise: of the surface, mm^2.
TestSequence walking(int frames, int vertices, double noise = 0) {
    SynthOptions options;
    options.vertices = vertices;
    options.surface_noise_power = noise;
    TestSequence out{"walking", {}, {}};
    for (int t = 0; t < frames; ++t) out.frames.push_back({synth_frame(options, 50 + t).mesh, {}});
    return out;
}

const CodedSequence& walking_in_levels() {
    static const auto coded = encode(walking(4, 12000, 2.25), tracked(ReferenceLevels::automatic));
    return coded;
}

std::vector<DecodedFrame> decoded(const CodedSequence& coded, std::uint32_t detail_levels) {
    DecoderOptions options;
    options.detail_levels = detail_levels;
    Decoder decoder(options);
    std::vector<DecodedFrame> out;
    for (const auto& packet : coded.packets) {
        auto frame = decoder.decode_copy(packet);
        EXPECT_TRUE(frame) << frame.error().message;
        if (frame && *frame) out.push_back(std::move(**frame));
    }
    return out;
}

double error_of(const CodedSequence& coded, const TestSequence& sequence) {
    double worst = 0;
    for (std::size_t t = 0; t < coded.reconstructions.size(); ++t) {
        const auto& shown = coded.reconstructions[t];
        const auto& captured = sequence.frames[t].mesh;
        worst = std::max(
            worst, surface_errors({captured.positions, captured.triangles, {}}, {shown.positions, shown.triangles, {}})
                       .geometry_rms);
    }
    return worst;
}

TEST(LeveledStreams, TakeFewerBitsForTheSameSurface) {
    auto sequence = walking(2, 12000);
    for (auto& frame : sequence.frames) frame.mesh.colours.clear();
    const auto levels = encode(sequence, tracked(ReferenceLevels::automatic));
    const auto alike = encode(sequence, tracked(ReferenceLevels::off));
    EXPECT_GT(levels.infos[0].bytes[Layer::levels], 0u);
    EXPECT_EQ(alike.infos[0].bytes[Layer::levels], 0u);
    EXPECT_LT(5 * levels.infos[0].bytes.total(), 4 * alike.infos[0].bytes.total());
    EXPECT_LT(error_of(levels, sequence), 1.05 * error_of(alike, sequence));
}

TEST(LeveledStreams, AreShownAsTheEncoderHasThem) {
    const auto& coded = walking_in_levels();
    const auto frames = decoded(coded, DecoderOptions{}.detail_levels);
    ASSERT_EQ(frames.size(), coded.reconstructions.size());
    for (std::size_t t = 0; t < frames.size(); ++t) {
        EXPECT_EQ(frames[t].mesh.positions, coded.reconstructions[t].positions) << "frame " << t;
        EXPECT_EQ(frames[t].mesh.triangles, coded.reconstructions[t].triangles) << "frame " << t;
        EXPECT_EQ(frames[t].mesh.colours, coded.reconstructions[t].colours) << "frame " << t;
    }
}

TEST(LeveledStreams, HaveTheFirstVerticesOfAllLevelsWhereFewerAreShown) {
    const auto all = decoded(walking_in_levels(), DecoderOptions{}.detail_levels);
    std::size_t more = 0;
    for (const std::uint32_t levels : {0u, 1u}) {
        const auto fewer = decoded(walking_in_levels(), levels);
        ASSERT_EQ(fewer.size(), all.size());
        for (std::size_t t = 0; t < all.size(); ++t) {
            const auto& few = fewer[t].mesh.positions;
            const auto& many = all[t].mesh.positions;
            ASSERT_LT(few.size(), many.size());
            ASSERT_GT(few.size(), more);
            EXPECT_TRUE(std::equal(few.begin(), few.end(), many.begin())) << "frame " << t;
        }
        more = fewer.front().mesh.positions.size();
    }
}

TEST(LeveledStreams, HaveAnotherTopologyFromTheFrameOnWhereOtherLevelsAreShown) {
    const auto& coded = walking_in_levels();
    Decoder decoder;
    std::vector<std::uint32_t> topologies;
    std::vector<std::size_t> vertices;
    for (const auto& packet : coded.packets) {
        const auto frame = decoder.decode_copy(packet);
        ASSERT_TRUE(frame);
        if (!*frame) continue;
        topologies.push_back((*frame)->topology);
        vertices.push_back((*frame)->mesh.positions.size());
        if (topologies.size() == 2) decoder.set_detail_levels(0);
    }
    ASSERT_EQ(topologies.size(), 4u);
    EXPECT_EQ(topologies[0], topologies[1]);
    EXPECT_NE(topologies[1], topologies[2]);
    EXPECT_EQ(topologies[2], topologies[3]);
    EXPECT_LT(vertices[2], vertices[1]);
}

TEST(LeveledStreams, KeepTheDetailOfWhatAPatchLeaves) {
    // Without noise it is soon seen that the elbow's folds are not followed.
    const auto coded = encode(walking(3, 12000), tracked(ReferenceLevels::automatic));
    const auto patched = std::find_if(coded.infos.begin(), coded.infos.end(),
                                      [](const FrameInfo& info) { return info.type == FrameType::patched; });
    ASSERT_NE(patched, coded.infos.end());
    ASSERT_GT(coded.infos[0].bytes[Layer::levels], 0u);
    const auto all = decoded(coded, DecoderOptions{}.detail_levels), none = decoded(coded, 0);
    const auto at = static_cast<std::size_t>(patched - coded.infos.begin());
    EXPECT_GT(all[at].mesh.positions.size(), none[at].mesh.positions.size());
    for (std::size_t t = 0; t < all.size(); ++t)
        EXPECT_EQ(all[t].mesh.positions, coded.reconstructions[t].positions) << "frame " << t;
}

// ---- With charts ----------------------------------------------------------------------------------------------------

const CodedSequence& patched_with_charts() {
    static const auto coded = [] {
        auto options = tracked(ReferenceLevels::on);
        options.texture = {TextureLayout::charts, 512, 512};
        return encode(walking(3, 12000), options);
    }();
    return coded;
}

// What all triangles take of the picture.
double picture_area(const Mesh& mesh) {
    double sum = 0;
    for (const auto& [a, b, c] : mesh.triangles) {
        const auto &p = mesh.texcoords[a], &q = mesh.texcoords[b], &r = mesh.texcoords[c];
        sum += (q[0] - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (q[1] - p[1]);
    }
    return sum / 2;
}

TEST(LeveledStreams, WithChartsAreShownAsTheEncoderHasThem) {
    const auto& coded = patched_with_charts();
    ASSERT_GT(coded.infos[0].bytes[Layer::levels], 0u);
    ASSERT_GT(coded.infos[0].bytes[Layer::charts], 0u);
    EXPECT_TRUE(std::any_of(coded.infos.begin(), coded.infos.end(),
                            [](const FrameInfo& info) { return info.type == FrameType::patched; }));
    const auto frames = decoded(coded, DecoderOptions{}.detail_levels);
    ASSERT_EQ(frames.size(), coded.reconstructions.size());
    for (std::size_t t = 0; t < frames.size(); ++t) {
        const auto &mesh = frames[t].mesh, &shown = coded.reconstructions[t];
        ASSERT_EQ(mesh.texcoords.size(), mesh.positions.size());
        EXPECT_EQ(mesh.positions, shown.positions) << "frame " << t;
        EXPECT_EQ(mesh.triangles, shown.triangles) << "frame " << t;
        EXPECT_EQ(mesh.texcoords, shown.texcoords) << "frame " << t;
    }
}

TEST(LeveledStreams, CoverTheSamePartOfThePictureWithAnyLevels) {
    const auto all = decoded(patched_with_charts(), DecoderOptions{}.detail_levels);
    for (const std::uint32_t levels : {0u, 1u}) {
        const auto fewer = decoded(patched_with_charts(), levels);
        ASSERT_EQ(fewer.size(), all.size());
        for (std::size_t t = 0; t < all.size(); ++t) {
            EXPECT_LT(fewer[t].mesh.triangles.size(), all[t].mesh.triangles.size());
            ASSERT_EQ(fewer[t].mesh.texcoords.size(), fewer[t].mesh.positions.size());
            EXPECT_GT(picture_area(all[t].mesh), 0.1);
            EXPECT_NEAR(picture_area(fewer[t].mesh), picture_area(all[t].mesh), 1e-4) << "frame " << t;
        }
    }
}

TEST(LeveledStreams, ThatShowOtherLevelsFromAFrameOnHaveTheirTextureCoordinates) {
    const auto all = decoded(patched_with_charts(), DecoderOptions{}.detail_levels),
               none = decoded(patched_with_charts(), 0);
    Decoder decoder;
    std::size_t t = 0;
    for (const auto& packet : patched_with_charts().packets) {
        const auto frame = decoder.decode_copy(packet);
        ASSERT_TRUE(frame);
        if (!*frame) continue;
        const auto& expected = (t == 1 ? none : all)[t];
        EXPECT_EQ((*frame)->mesh.texcoords, expected.mesh.texcoords) << "frame " << t;
        EXPECT_EQ((*frame)->mesh.triangles, expected.mesh.triangles) << "frame " << t;
        decoder.set_detail_levels(++t == 1 ? 0 : DecoderOptions{}.detail_levels);
    }
    EXPECT_EQ(t, 3u);
}

TEST(LeveledStreams, LeaveCapturesAloneThatKeepTheirVertices) {
    auto options = tracked(ReferenceLevels::on);
    options.tracked.simplify = 0;
    const auto coded = encode(walking(1, 3000), options);
    EXPECT_EQ(coded.infos[0].bytes[Layer::levels], 0u);
}

TEST(LeveledStreams, AreNotMadeAtEffortsForLiveFramesUnlessTheyAreAskedFor) {
    auto options = tracked(ReferenceLevels::automatic);
    options.tracked.effort = 2;
    EXPECT_EQ(encode(walking(1, 12000), options).infos[0].bytes[Layer::levels], 0u);
    options.tracked.levels = ReferenceLevels::on;
    EXPECT_GT(encode(walking(1, 12000), options).infos[0].bytes[Layer::levels], 0u);
}

}  // namespace
}  // namespace htvm::internal
