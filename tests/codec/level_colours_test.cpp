#include "codec/intra/level_colours.h"

#include <gtest/gtest.h>

#include "codec/intra_test_meshes.h"
#include "codec/levels_by_chance.h"

namespace htvm::internal {
namespace {

using namespace test;

// The detail of a mesh of which every edge is split twice.
SurfaceDetail detail_of(const LatticeMesh& mesh) {
    SurfaceDetail out;
    auto levels = subdivide(mesh, {2, 1}, 1 << 16);
    if (!levels) return out;
    out.levels = std::move(*levels);
    out.rules.resize(2);
    for (const auto& level : out.levels) out.displacements.resize(out.displacements.size() + level.stencils.size());
    return out;
}

LatticeMesh mesh_of(const intra_test::Connectivity& connectivity, unsigned seed) {
    LatticeMesh out;
    out.positions = intra_test::points(connectivity.vertex_count, seed);
    out.triangles = connectivity.triangles;
    out.colours = intra_test::colours(connectivity.vertex_count, seed);
    return out;
}

TEST(LevelColours, any_differences_on_any_mesh_come_back) {
    unsigned seed = 1;
    for (const auto& connectivity : intra_test::awkward()) {
        const auto mesh = mesh_of(connectivity, seed);
        const auto bare = detail_of(mesh);
        const std::size_t coded = std::min<std::size_t>(seed % 3, bare.levels.size());
        const auto step = static_cast<std::int32_t>(1 + seed * 11 % 255);
        std::mt19937 random(seed++);
        auto detail = bare, decoded = bare;
        const auto layer =
            level_colours_by_chance(mesh.colours, step, coded, seed % 9 == 0 ? 1 << 29 : 5, detail, random);
        ASSERT_TRUE(decode_level_colours(layer, mesh.colours, step, coded, decoded));
        ASSERT_EQ(decoded.colours, detail.colours);
        std::size_t vertices = 0;
        for (std::size_t k = 0; k < coded; ++k) vertices += bare.levels[k].stencils.size();
        ASSERT_EQ(decoded.colours.size(), vertices);
    }
}

TEST(LevelColours, a_layer_that_is_cut_or_goes_on_is_refused) {
    const auto mesh = mesh_of(intra_test::grid(5), 3);
    const auto bare = detail_of(mesh);
    auto detail = bare;
    std::mt19937 random(1);
    const auto layer = level_colours_by_chance(mesh.colours, 8, 2, 5, detail, random);
    for (std::size_t size = 0; size < layer.size(); ++size) {
        auto decoded = bare;
        const auto ok = decode_level_colours(std::span(layer).first(size), mesh.colours, 8, 2, decoded);
        ASSERT_FALSE(ok);
        EXPECT_EQ(ok.error().kind, ErrorKind::corrupt_stream);
    }
    auto longer = layer;
    longer.push_back(0);
    auto decoded = bare;
    EXPECT_FALSE(decode_level_colours(longer, mesh.colours, 8, 2, decoded));
}

TEST(LevelColours, red_and_blue_follow_green_and_nothing_goes_beyond_all_levels) {
    EXPECT_EQ(levels_of({2, 1, -3}, 10), (std::array<std::int32_t, 3>{30, 20, -10}));
    EXPECT_EQ(levels_of({1 << 29, 1 << 29, -(1 << 29)}, 255), (std::array<std::int32_t, 3>{255, 255, 0}));
    EXPECT_EQ(off_mean({0, 100, 250}, {1, 101, 255}, {0, -30, 30}), (Colour{1, 71, 255}));
}

TEST(LevelColours, a_step_out_of_range_is_refused) {
    const auto mesh = mesh_of(intra_test::grid(2), 3);
    for (const std::int32_t step : {0, 256}) {
        auto detail = detail_of(mesh);
        EXPECT_FALSE(decode_level_colours({}, mesh.colours, step, 0, detail));
    }
}

}  // namespace
}  // namespace htvm::internal
