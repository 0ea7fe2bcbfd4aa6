#include "codec/intra/surface_levels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "codec/ball.h"
#include "codec/encoder/leveled_intra.h"
#include "codec/intra/intra_frame.h"
#include "codec/intra/surface_levels_walk.h"
#include "codec/intra_test_meshes.h"
#include "entropy/range_coder.h"
#include "surface/surface_index.h"

namespace htvm::internal {
namespace {

using test::ball;

// A run of these levels on a base, whose displacements are random ones.
struct RandomRun {
    std::vector<std::uint8_t> bytes;
    LeveledSurface surface;
};
RandomRun random_run(const LatticeMesh& base, const SurfaceLevels& levels, unsigned seed, std::int32_t most) {
    std::mt19937 random(seed);
    const auto subdivision = subdivide(base, levels.depth, 1 << 20);
    RangeEncoder encoder;
    WritingCoder<RangeEncoder> coder{encoder};
    code_levels_header(coder, levels);
    DisplacementModels models;
    RandomRun out;
    std::vector<std::int32_t> values;
    out.surface.triangles = base.triangles;
    for (std::uint32_t k = 0; k <= levels.depth.levels; ++k) {
        const auto* level = k > 0 ? &(*subdivision)[k - 1] : nullptr;
        const auto expected =
            level ? expected_level(*level, out.surface.positions, out.surface.triangles, levels.rules[k - 1])
                  : expected_base(base);
        code_displacements(coder, models, level, k, expected, step_at(levels, k), out.surface.positions, values,
                           [&](std::size_t, const DisplacementContext&) {
                               return random() % 3 == 0 ? static_cast<std::int32_t>(random() % (2u * most + 1)) - most
                                                        : 0;
                           });
        if (level) out.surface.triangles = level->triangles;
    }
    out.bytes = encoder.finish();
    return out;
}

SurfaceLevels some_levels(std::uint32_t levels, std::uint32_t longest) {
    SurfaceLevels out;
    out.depth = {levels, longest};
    out.rules.fill({2, 8});
    return out;
}

TEST(SurfaceLevels, any_displacements_on_any_mesh_come_back_to_the_bit) {
    unsigned seed = 1;
    for (const auto& connectivity : intra_test::awkward()) {
        LatticeMesh base;
        base.positions = intra_test::points(connectivity.vertex_count, seed);
        base.triangles = connectivity.triangles;
        auto levels = some_levels(seed % 4, 1u << (seed % 20));
        levels.coarser = 1 + seed % 16;
        if (!subdivide(base, levels.depth, 20000)) continue;
        const auto run = random_run(base, levels, seed, seed % 7 == 0 ? most_displacement : 30);
        const auto decoded = decode_surface_levels(run.bytes, base, 20000);
        ASSERT_TRUE(decoded) << decoded.error().message;
        ASSERT_EQ(decoded->positions, run.surface.positions);
        ASSERT_EQ(decoded->triangles, run.surface.triangles);
        for (const auto p : decoded->positions) ASSERT_TRUE(on_lattice(p));
        ++seed;
    }
}

TEST(SurfaceLevels, a_run_that_is_cut_is_refused_or_gives_points_on_the_lattice) {
    const auto base = ball(2, [](const Vector3d&) { return 1000; });
    const auto run = random_run(base, some_levels(2, 100), 5, 20);
    std::size_t refused = 0;
    for (std::size_t size = 0; size < run.bytes.size(); size += 7) {
        const auto decoded = decode_surface_levels(std::span(run.bytes).first(size), base, 1 << 16);
        refused += !decoded;
        if (!decoded) continue;
        for (const auto p : decoded->positions) ASSERT_TRUE(on_lattice(p));
    }
    EXPECT_GT(refused, run.bytes.size() / 8);
}

TEST(SurfaceLevels, more_vertices_than_allowed_are_refused) {
    const auto base = ball(2, [](const Vector3d&) { return 1000; });
    const auto run = random_run(base, some_levels(3, 20), 1, 3);
    ASSERT_TRUE(decode_surface_levels(run.bytes, base, run.surface.positions.size()));
    const auto refused = decode_surface_levels(run.bytes, base, run.surface.positions.size() - 1);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().kind, ErrorKind::limit);
}

TEST(SurfaceLevels, steps_shrink_towards_the_base_and_never_vanish) {
    SurfaceLevels levels;
    levels.depth.levels = 3;
    levels.step = 256;
    levels.coarser = 8;
    EXPECT_EQ(step_at(levels, 3), 256u);
    EXPECT_EQ(step_at(levels, 2), 128u);
    EXPECT_EQ(step_at(levels, 0), 32u);
    levels.step = 1;
    levels.coarser = 1;
    EXPECT_EQ(step_at(levels, 0), 1u);
}

TEST(SurfaceLevels, a_displaced_vertex_is_rounded_to_the_nearest_and_stays_on_the_lattice) {
    EXPECT_EQ(displaced_vertex({0.5, -0.5, 10.49}, {0, 0, 0}, 7, 16), (LatticePoint{1, 0, 10}));
    EXPECT_EQ(displaced_vertex({0, 0, 0}, {0, -1, 0}, 3, 8), (LatticePoint{0, -1, 0}));
    EXPECT_EQ(displaced_vertex({0, 0, 0}, {1, 0, 0}, most_displacement, 1 << 20), (LatticePoint{lattice_limit, 0, 0}));
}

// ---- The encoder ----------------------------------------------------------------------------------------------------

// A captured bumpy ball and its index.
LatticeMesh bumpy() {
    return ball(5, [](const Vector3d& d) { return 2000 + 120 * std::sin(5 * d[0]) * std::cos(4 * d[1] + d[2]); });
}

double rms_between(const std::vector<LatticePoint>& from, const std::vector<LatticePoint>& to,
                   const std::vector<Triangle>& triangles) {
    const SurfaceIndex index(points_of(to), triangles);
    double sum = 0;
    for (const auto p : from) sum += static_cast<double>(index.closest(point_of(p)).squared_distance);
    return std::sqrt(sum / static_cast<double>(from.size()));
}

TEST(LeveledIntra, the_decoder_has_what_the_encoder_says) {
    const auto captured = bumpy();
    const auto coded = encode_leveled_intra(captured, {.step = LatticeUnits(20)});
    ASSERT_TRUE(coded) << coded.error().message;
    const auto base = decode_intra_frame(view_of(coded->base), nullptr);
    ASSERT_TRUE(base);
    EXPECT_EQ(base->positions, coded->decoded_base.positions);
    const auto decoded = decode_surface_levels(coded->levels.run, *base, 1 << 20);
    ASSERT_TRUE(decoded);
    EXPECT_EQ(decoded->positions, coded->levels.surface.positions);
    EXPECT_EQ(decoded->triangles, coded->levels.surface.triangles);
}

TEST(LeveledIntra, a_finer_step_comes_nearer_for_more_bytes) {
    const auto captured = bumpy();
    double error = 1e9;
    std::size_t bytes = 0;
    for (const double step : {64.0, 32.0, 16.0}) {
        const auto coded = encode_leveled_intra(captured, {.step = LatticeUnits(step)});
        ASSERT_TRUE(coded);
        const auto& surface = coded->levels.surface;
        const double now = rms_between(captured.positions, surface.positions, surface.triangles);
        EXPECT_LT(now, 0.5 * step);
        EXPECT_LT(now, error);
        EXPECT_GT(coded->levels.run.size(), bytes);
        error = now;
        bytes = coded->levels.run.size();
    }
}

TEST(LeveledIntra, it_takes_fewer_bytes_than_an_intra_frame_that_is_as_near) {
    const auto captured = bumpy();
    FramePayload payload;
    const auto intra = encode_intra_frame(captured, {.geometry_step = 16}, payload);
    ASSERT_TRUE(intra);
    const auto coded = encode_leveled_intra(captured, {.step = LatticeUnits(12)});
    ASSERT_TRUE(coded);
    const auto& surface = coded->levels.surface;
    EXPECT_LT(rms_between(captured.positions, surface.positions, surface.triangles),
              1.2 * rms_between(captured.positions, intra->positions, intra->triangles));
    EXPECT_LT(write_frame_payload(coded->base).size() + coded->levels.run.size(),
              write_frame_payload(payload).size() / 2);
}

TEST(LeveledIntra, seams_are_closed_and_a_mesh_without_triangles_is_refused) {
    const auto whole = bumpy();
    LatticeMesh cut = whole;  // each triangle has vertices of its own
    cut.positions.clear();
    cut.triangles.clear();
    for (const auto& t : whole.triangles) {
        const auto first = static_cast<std::uint32_t>(cut.positions.size());
        for (const auto v : t) cut.positions.push_back(whole.positions[v]);
        cut.triangles.push_back({first, first + 1, first + 2});
    }
    const auto coded = encode_leveled_intra(cut, {.step = LatticeUnits(30)});
    ASSERT_TRUE(coded);
    const auto& surface = coded->levels.surface;
    for (const auto sides : find_edges(surface.positions.size(), surface.triangles).sides) ASSERT_EQ(sides, 2u);
    LatticeMesh points;
    points.positions = whole.positions;
    const auto refused = encode_leveled_intra(points, {});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
}

TEST(LeveledIntra, a_border_stays_where_it_is) {
    LatticeMesh sheet;
    constexpr std::uint32_t cells = 40;
    sheet.triangles = intra_test::grid(cells).triangles;
    for (std::uint32_t y = 0; y <= cells; ++y)
        for (std::uint32_t x = 0; x <= cells; ++x)
            sheet.positions.push_back(
                {static_cast<std::int32_t>(x) * 50, static_cast<std::int32_t>(y) * 50,
                 static_cast<std::int32_t>(std::lround(80 * std::sin(0.15 * x) * std::cos(0.1 * y)))});
    const auto coded = encode_leveled_intra(sheet, {.step = LatticeUnits(5)});
    ASSERT_TRUE(coded);
    const auto& surface = coded->levels.surface;
    EXPECT_LT(rms_between(sheet.positions, surface.positions, surface.triangles), 15);
    EXPECT_LT(rms_between(surface.positions, sheet.positions, sheet.triangles), 15);
}

TEST(LeveledIntra, what_is_in_no_order_is_coded_without_harm) {
    unsigned seed = 1;
    for (const auto& connectivity : intra_test::awkward()) {
        LatticeMesh mesh;
        mesh.positions = intra_test::points(connectivity.vertex_count, 5 * seed + 1);
        mesh.triangles = connectivity.triangles;
        if (seed++ % 8 != 0) continue;
        const auto coded = encode_leveled_intra(mesh, {.step = LatticeUnits(4)});
        if (!coded) continue;
        const auto decoded = decode_surface_levels(coded->levels.run, coded->decoded_base, 1 << 22);
        ASSERT_TRUE(decoded);
        ASSERT_EQ(decoded->positions, coded->levels.surface.positions);
    }
}

}  // namespace
}  // namespace htvm::internal
