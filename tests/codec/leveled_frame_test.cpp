#include "codec/intra/leveled_frame.h"

#include <gtest/gtest.h>

#include <cmath>

#include "codec/ball.h"
#include "codec/encoder/leveled_intra.h"
#include "codec/intra_test_meshes.h"
#include "codec/levels_by_chance.h"

namespace htvm::internal {
namespace {

using namespace test;

constexpr std::size_t any_number = 1 << 22;

void expect_same(const LeveledFrame& decoded, const LeveledFrame& coded) {
    ASSERT_EQ(decoded.mesh.positions, coded.mesh.positions);
    ASSERT_EQ(decoded.mesh.triangles, coded.mesh.triangles);
    ASSERT_EQ(decoded.mesh.colours, coded.mesh.colours);
    ASSERT_EQ(decoded.mesh.normals, coded.mesh.normals);
    ASSERT_EQ(decoded.detail.levels.size(), coded.detail.levels.size());
    ASSERT_EQ(decoded.detail.rules, coded.detail.rules);
    ASSERT_EQ(decoded.detail.displacements, coded.detail.displacements);
    ASSERT_EQ(decoded.detail.colours, coded.detail.colours);
    const auto a = detailed(decoded.detail, decoded.mesh), b = detailed(coded.detail, coded.mesh);
    ASSERT_EQ(a.positions, b.positions);
    ASSERT_EQ(a.triangles, b.triangles);
    ASSERT_EQ(a.colours, b.colours);
    ASSERT_EQ(a.normals, b.normals);
}

LeveledByChance some_frame(std::uint32_t referred = 1, std::uint32_t rounded = 6, bool normals = false) {
    LeveledByChanceOptions options;
    options.levels.depth = {2, 160};
    options.levels.rules.fill({2, 8});
    options.levels.rounded = rounded;
    options.referred = referred;
    options.normals = normals;
    std::mt19937 random(referred);
    return *leveled_by_chance(ball(1, [](const Vector3d& d) { return 600 + 200 * d[1] * d[1]; }), options, random);
}

ErrorKind refused(const FramePayload& payload, std::size_t most_vertices = any_number) {
    const auto decoded = decode_leveled_frame(view_of(payload), most_vertices);
    EXPECT_FALSE(decoded);
    return decoded ? ErrorKind::bad_input : decoded.error().kind;
}

TEST(LeveledFrame, what_the_encoder_says_of_it_is_what_is_decoded_to_the_bit) {
    const auto captured =
        ball(4, [](const Vector3d& d) { return 2000 + 120 * std::sin(5 * d[0]) * std::cos(4 * d[1] + d[2]); });
    for (const std::uint32_t referred : {1u, 2u, 3u, 8u}) {
        auto coded = encode_leveled_intra(captured, {.step = LatticeUnits(40)});
        ASSERT_TRUE(coded) << coded.error().message;
        const auto finest = coded->levels.surface.finest();
        const auto positions = coded->levels.surface.positions;
        FramePayload payload;
        const auto frame = put_leveled_intra(std::move(*coded), referred, payload);
        const auto decoded = decode_leveled_frame(view_of(payload), any_number);
        ASSERT_TRUE(decoded) << decoded.error().message;
        expect_same(*decoded, frame);
        EXPECT_EQ(frame.detail.empty(), referred >= 3) << "two levels are coded, and one rounds off";
        const auto shown = detailed(decoded->detail, decoded->mesh);
        EXPECT_EQ(shown.positions, positions) << "the mesh with its detail is the surface that was coded";
        EXPECT_EQ(shown.triangles, finest);
    }
}

TEST(LeveledFrame, the_shares_of_its_levels_are_all_of_its_vertices_and_bytes) {
    for (const std::uint32_t referred : {1u, 2u}) {
        const auto some = some_frame(referred);
        const auto payload = view_of(some.payload);
        const auto shares = level_shares(payload, any_number);
        ASSERT_TRUE(shares) << shares.error().message;
        ASSERT_EQ(shares->size(), 4u) << "the base, two levels, and the one that rounds off";
        std::size_t vertices = 0, of_mesh = 0, bytes = 0, colour_bytes = 0;
        for (const auto& share : *shares) {
            vertices += share.vertices;
            of_mesh += share.referred ? share.vertices : 0;
            bytes += share.bytes;
            colour_bytes += share.colour_bytes;
        }
        EXPECT_EQ(of_mesh, some.frame.mesh.positions.size());
        EXPECT_EQ(vertices, detailed(some.frame.detail, some.frame.mesh).positions.size());
        EXPECT_EQ(shares->back().bytes, 0u);
        const std::size_t coded =
            payload.of(Layer::fans).size() + payload.of(Layer::geometry).size() + payload.of(Layer::levels).size();
        EXPECT_LT(bytes, coded) << "the header of the levels is none's";
        EXPECT_GE(bytes + 24, coded);
        const std::size_t colours = payload.of(Layer::colour).size() + payload.of(Layer::level_colours).size();
        EXPECT_LE(colour_bytes, colours);
        EXPECT_GE(colour_bytes + 8, colours);
    }
    FramePayload flat;
    const auto none = level_shares(view_of(flat), any_number);
    ASSERT_TRUE(none);
    EXPECT_TRUE(none->empty());
}

TEST(LeveledFrame, any_levels_of_any_mesh_come_back_to_the_bit) {
    unsigned seed = 1;
    std::size_t with_detail = 0;
    for (const auto& connectivity : intra_test::awkward()) {
        LatticeMesh base;
        base.positions = intra_test::points(connectivity.vertex_count, seed);
        base.triangles = connectivity.triangles;
        LeveledByChanceOptions options;
        options.levels.depth = {seed % 4, 1u << (seed % 7)};
        options.levels.coarser = 1 + seed % 16;
        options.levels.rules.fill({seed % 3, 8 - seed % 9});
        options.levels.rounded = seed % 3 == 0 ? 0 : seed % 256;
        options.referred = seed % 5 == 0 ? 8 : seed % 4;
        options.geometry_step = 1 + static_cast<std::int32_t>(seed % 9);
        options.colour_step = 1 + static_cast<std::int32_t>(seed * 7 % 255);
        options.colours = seed % 4 != 0;
        options.normals = seed % 2 == 0;
        std::mt19937 random(seed++);
        const auto coded = leveled_by_chance(base, options, random);
        if (!coded) continue;
        const auto decoded = decode_leveled_frame(view_of(coded->payload), any_number);
        ASSERT_TRUE(decoded) << decoded.error().message;
        expect_same(*decoded, coded->frame);
        with_detail += !decoded->detail.empty();
    }
    EXPECT_GT(with_detail, 20u);
}

TEST(LeveledFrame, a_layer_that_is_cut_is_refused_or_changes_nothing) {
    const auto whole = some_frame(1, 6, true);
    for (const auto layer : {Layer::levels, Layer::level_colours, Layer::fans, Layer::geometry}) {
        const auto& bytes = whole.payload.of(layer);
        std::size_t refused_ones = 0;
        for (std::size_t size = 0; size < bytes.size(); ++size) {
            auto cut = whole.payload;
            cut.set(layer, {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)});
            const auto decoded = decode_leveled_frame(view_of(cut), any_number);
            refused_ones += !decoded;
            const bool has_sizes = layer == Layer::levels || layer == Layer::level_colours;
            ASSERT_FALSE(has_sizes && decoded) << "runs are as long as they say";
            ASSERT_TRUE(!decoded || decoded->mesh.positions.size() == whole.payload.header.vertices);
        }
        EXPECT_GT(refused_ones, bytes.size() / 2) << static_cast<int>(layer);
        auto longer = whole.payload;
        longer.layers[static_cast<std::size_t>(layer)].push_back(0);
        if (layer == Layer::levels || layer == Layer::level_colours) {
            EXPECT_EQ(refused(longer), ErrorKind::corrupt_stream);
        }
    }
}

TEST(LeveledFrame, counts_that_are_not_those_of_the_mesh_are_refused) {
    const auto whole = some_frame();
    for (const int off : {-1, 1}) {
        auto other = whole.payload;
        other.header.vertices = static_cast<std::uint32_t>(static_cast<int>(other.header.vertices) + off);
        EXPECT_EQ(refused(other), ErrorKind::corrupt_stream);
        other = whole.payload;
        other.header.triangles = static_cast<std::uint32_t>(static_cast<int>(other.header.triangles) + off);
        EXPECT_EQ(refused(other), ErrorKind::corrupt_stream);
    }
    auto larger_base = whole.payload;
    auto layer = larger_base.of(Layer::levels);
    ByteWriter counts;
    counts.u8(1);
    counts.varint(larger_base.header.vertices + std::uint64_t{1});
    counts.bytes(std::span(layer).subspan(2));
    larger_base.set(Layer::levels, counts.take());
    EXPECT_EQ(refused(larger_base), ErrorKind::corrupt_stream);
}

TEST(LeveledFrame, frames_cannot_refer_to_a_ninth_level) {
    auto other = some_frame().payload;
    other.layers[static_cast<std::size_t>(Layer::levels)][0] = 9;
    EXPECT_EQ(refused(other), ErrorKind::corrupt_stream);
}

TEST(LeveledFrame, there_are_no_more_than_32_vertices_of_detail_for_each_that_frames_refer_to) {
    LatticeMesh base = ball(1, [](const Vector3d&) { return 4000; });
    SurfaceLevels levels;
    std::mt19937 random(1);
    for (const std::uint32_t count : {2u, 3u}) {
        levels.depth = {count, 1};  // four times as many triangles a level: 16 or 64 times as many vertices, nearly
        FramePayload payload;
        IntraFrameOptions options;
        options.merge_duplicates = false;
        const auto decoded = encode_intra_frame(base, options, payload);
        const auto coded = levels_by_chance(*decoded, levels, 1, 1 << 20, random);
        payload.set(Layer::levels,
                    write_levels_layer(0, {payload.header.vertices, payload.header.triangles}, coded->bytes));
        payload.header.intra_coder = intra_coder_levels;
        const auto decoded_levels = decode_leveled_frame(view_of(payload), any_number);
        EXPECT_EQ(decoded_levels.has_value(), count == 2);
        EXPECT_TRUE(decoded_levels || decoded_levels.error().kind == ErrorKind::limit);
    }
}

TEST(LeveledFrame, the_detail_counts_against_the_most_vertices) {
    const auto whole = some_frame();
    const auto all = whole.frame.mesh.positions.size() + whole.frame.detail.vertices();
    EXPECT_TRUE(decode_leveled_frame(view_of(whole.payload), all));
    EXPECT_EQ(refused(whole.payload, all - 1), ErrorKind::limit);
}

TEST(LeveledFrame, colours_of_levels_need_colours_and_levels) {
    auto without_colours = some_frame().payload;
    without_colours.present[static_cast<std::size_t>(Layer::colour)] = false;
    EXPECT_EQ(refused(without_colours), ErrorKind::corrupt_stream);
    auto without_detail = some_frame(8).payload;
    EXPECT_FALSE(without_detail.has(Layer::level_colours));
    without_detail.set(Layer::level_colours, {});
    EXPECT_EQ(refused(without_detail), ErrorKind::corrupt_stream);
}

}  // namespace
}  // namespace htvm::internal
