#include "codec/intra/surface_levels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "codec/ball.h"
#include "codec/encoder/leveled_intra.h"
#include "codec/intra/intra_frame.h"
#include "codec/intra/surface_levels_walk.h"
#include "codec/intra_test_meshes.h"
#include "codec/levels_by_chance.h"
#include "surface/surface_index.h"

namespace htvm::internal {
namespace {

using test::ball;
using test::LevelsByChance;

LevelsByChance random_payload(const LatticeMesh& base, const SurfaceLevels& levels, unsigned seed, std::int32_t most) {
    std::mt19937 random(seed);
    return *test::levels_by_chance(base, levels, most, 1 << 20, random);
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
        const auto payload = random_payload(base, levels, seed, seed % 7 == 0 ? most_displacement : 30);
        const auto decoded = decode_surface_levels(payload.bytes, base, 20000);
        ASSERT_TRUE(decoded) << decoded.error().message;
        ASSERT_EQ(decoded->positions, payload.surface.positions);
        ASSERT_EQ(decoded->finest(), payload.surface.finest());
        for (const auto p : decoded->positions) ASSERT_TRUE(on_lattice(p));
        ++seed;
    }
}

// What is there of the first levels only.
std::span<const std::uint8_t> down_to(const std::vector<std::uint8_t>& payload, std::uint32_t level) {
    return std::span(payload).first(read_levels_header(payload)->ends[level]);
}

TEST(SurfaceLevels, fewer_levels_are_the_first_ones_of_the_whole_and_need_their_bytes_alone) {
    for (const std::uint32_t count : {0u, 1u, 3u, 5u}) {
        const auto base = ball(1, [](const Vector3d& d) { return 1000 + 300 * d[1] * d[1]; });
        const auto levels = some_levels(count, 90);
        const auto whole = random_payload(base, levels, count, 25);
        const auto subdivision = subdivide(base, levels.depth, 1 << 20);
        for (std::uint32_t k = 0; k <= count; ++k) {
            const auto first = decode_surface_levels(down_to(whole.bytes, k), base, 1 << 20, k);
            ASSERT_TRUE(first) << first.error().message;
            const auto vertices =
                k == 0 ? base.positions.size() : (*subdivision)[k - 1].first + (*subdivision)[k - 1].stencils.size();
            ASSERT_EQ(first->positions, std::vector(whole.surface.positions.begin(),
                                                    whole.surface.positions.begin() + std::ptrdiff_t(vertices)));
            ASSERT_EQ(first->finest(), k == 0 ? base.triangles : (*subdivision)[k - 1].triangles);
            auto garbled = whole.bytes;
            for (std::size_t i = read_levels_header(whole.bytes)->ends[k]; i < garbled.size(); ++i) garbled[i] ^= 0x5A;
            const auto same = decode_surface_levels(garbled, base, 1 << 20, k);
            ASSERT_TRUE(same);
            ASSERT_EQ(same->positions, first->positions);
        }
    }
}

TEST(SurfaceLevels, levels_that_are_not_asked_for_do_not_count_against_the_limit) {
    const auto base = ball(2, [](const Vector3d&) { return 1000; });
    const auto payload = random_payload(base, some_levels(3, 20), 1, 3);
    EXPECT_TRUE(decode_surface_levels(payload.bytes, base, base.positions.size(), 0));
    EXPECT_FALSE(decode_surface_levels(payload.bytes, base, base.positions.size(), 1));
}

TEST(SurfaceLevels, the_header_says_where_each_run_ends) {
    const auto base = ball(2, [](const Vector3d&) { return 1000; });
    auto levels = some_levels(2, 100);
    levels.step = 1 << 20;
    levels.depth.longest_edge = 1 << 20;
    levels.coarser = 16;
    levels.rules[1] = {15, 15};
    const auto header = read_levels_header(random_payload(base, levels, 5, 20).bytes);
    ASSERT_TRUE(header);
    EXPECT_EQ(header->levels.step, levels.step);
    EXPECT_EQ(header->levels.depth.longest_edge, levels.depth.longest_edge);
    EXPECT_EQ(header->levels.coarser, levels.coarser);
    EXPECT_EQ(header->levels.rules[1], levels.rules[1]);
    EXPECT_GT(header->ends[0], header->first_run);
    EXPECT_EQ(header->ends[1], header->ends[0]) << "no edge is as long, so nothing is coded";
}

TEST(SurfaceLevels, a_payload_that_is_cut_is_refused_wherever_it_is_cut) {
    const auto base = ball(2, [](const Vector3d&) { return 1000; });
    const auto payload = random_payload(base, some_levels(2, 100), 5, 20);
    for (std::size_t size = 0; size < payload.bytes.size(); ++size) {
        const auto decoded = decode_surface_levels(std::span(payload.bytes).first(size), base, 1 << 16);
        ASSERT_FALSE(decoded);
        EXPECT_EQ(decoded.error().kind, ErrorKind::corrupt_stream);
    }
    auto longer = payload.bytes;
    longer.push_back(0);
    EXPECT_FALSE(decode_surface_levels(longer, base, 1 << 16)) << "bytes behind the last run";
}

TEST(SurfaceLevels, a_run_that_says_to_be_shorter_than_it_is_is_refused_or_gives_points_on_the_lattice) {
    const auto base = ball(2, [](const Vector3d&) { return 1000; });
    const auto whole = random_payload(base, some_levels(0, 100), 5, 20).bytes;
    const std::span run = std::span(whole).subspan(read_levels_header(whole)->first_run);
    std::size_t refused = 0;
    for (std::size_t size = 0; size < run.size(); size += 3) {
        const std::vector<std::vector<std::uint8_t>> shorter{{run.begin(), run.begin() + std::ptrdiff_t(size)}};
        const auto decoded = decode_surface_levels(write_surface_levels(some_levels(0, 100), shorter), base, 1 << 16);
        refused += !decoded;
        if (!decoded) continue;
        for (const auto p : decoded->positions) ASSERT_TRUE(on_lattice(p));
    }
    EXPECT_GT(refused, run.size() / 4);
}

TEST(SurfaceLevels, numbers_out_of_range_are_refused) {
    const auto base = ball(0, [](const Vector3d&) { return 1000; });
    const auto refused = [&](const std::vector<std::uint8_t>& payload) {
        const auto decoded = decode_surface_levels(payload, base, 1 << 16);
        return !decoded && decoded.error().kind == ErrorKind::corrupt_stream;
    };
    EXPECT_TRUE(refused({9, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0})) << "levels";
    EXPECT_TRUE(refused({0, 0x80, 0x80, 0x40, 0, 0})) << "longest edge";
    EXPECT_TRUE(refused({0, 0, 0x80, 0x80, 0x40, 0})) << "step";
    EXPECT_TRUE(refused({0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 1})) << "a run's size";
}

TEST(SurfaceLevels, more_vertices_than_allowed_are_refused) {
    const auto base = ball(2, [](const Vector3d&) { return 1000; });
    const auto payload = random_payload(base, some_levels(3, 20), 1, 3);
    ASSERT_TRUE(decode_surface_levels(payload.bytes, base, payload.surface.positions.size()));
    const auto refused = decode_surface_levels(payload.bytes, base, payload.surface.positions.size() - 1);
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
    EXPECT_EQ(displaced_vertex({0.5, -0.5, 10.49}, {0, 0, 0}, displacement_of(7, 16)), (LatticePoint{1, 0, 10}));
    EXPECT_EQ(displaced_vertex({0, 0, 0}, {0, -1, 0}, displacement_of(3, 8)), (LatticePoint{0, -1, 0}));
    EXPECT_EQ(displaced_vertex({0, 0, 0}, {1, 0, 0}, displacement_of(most_displacement, 1 << 20)),
              (LatticePoint{lattice_limit, 0, 0}));
}

// The ends of the edges of a surface that the tangent planes' rule moves off their middle by so much or more.
std::set<std::array<std::uint32_t, 2>> bent(const LeveledSurface& surface, double least) {
    const auto normals = vertex_normals(surface.positions, surface.finest());
    const auto edges = find_edges(surface.positions.size(), surface.finest());
    std::set<std::array<std::uint32_t, 2>> out;
    for (const auto& ends : edges.ends) {
        EdgeStencil stencil;
        stencil.a = ends[0];
        stencil.b = ends[1];
        const auto off = tangents_offset(surface.positions, normals, stencil);
        if (dot(off, off) >= least * least) out.insert(ends);
    }
    return out;
}

TEST(SurfaceLevels, the_level_that_rounds_off_splits_exactly_the_edges_that_are_bent_enough) {
    const auto base = ball(2, [](const Vector3d& d) { return 1000 + 500 * d[1] * d[1]; });
    std::size_t splits = 0, edges = 0;
    for (const std::uint32_t rounded : {1u, 16u, 40u, 255u}) {
        auto levels = some_levels(1, 400);
        const auto coded = random_payload(base, levels, 3, 2);
        levels.rounded = rounded;
        const auto same = random_payload(base, levels, 3, 2);
        const auto without = decode_surface_levels(coded.bytes, base, 1 << 20);
        const auto with = decode_surface_levels(same.bytes, base, 1 << 20);
        ASSERT_TRUE(without && with);
        ASSERT_EQ(with->subdivision.size(), 2u);
        const auto& level = with->subdivision.back();
        std::set<std::array<std::uint32_t, 2>> split;
        for (const auto& s : level.stencils) split.insert({s.a, s.b});
        EXPECT_EQ(split, bent(*without, displacement_of(static_cast<std::int32_t>(rounded), levels.step) / 32));
        splits += split.size();
        edges += find_edges(without->positions.size(), without->finest()).size();
        // It displaces nothing, and leaves what was there.
        ASSERT_TRUE(std::equal(without->positions.begin(), without->positions.end(), with->positions.begin()));
        for (std::size_t v = level.first; v < with->positions.size(); ++v) ASSERT_EQ(with->displacements[v], 0);
        EXPECT_EQ(decode_surface_levels(same.bytes, base, 1 << 20, 1)->positions, without->positions)
            << "it is not among the coded levels";
    }
    EXPECT_GT(splits, 0u);
    EXPECT_LT(splits, edges);
}

TEST(SurfaceLevels, nothing_is_rounded_off_where_the_surface_is_flat) {
    LatticeMesh sheet;
    sheet.triangles = intra_test::grid(3).triangles;
    for (int v = 0; v < 16; ++v) sheet.positions.push_back({v % 4 * 100, v / 4 * 100, 7});
    auto levels = some_levels(0, 100);
    levels.rounded = 1;
    const auto decoded = decode_surface_levels(random_payload(sheet, levels, 1, 0).bytes, sheet, 1 << 20);
    ASSERT_TRUE(decoded);
    EXPECT_EQ(decoded->positions, sheet.positions);
    EXPECT_EQ(decoded->finest(), sheet.triangles);
}

TEST(SurfaceLevels, sizes_of_runs_cannot_add_up_to_more_than_there_is_memory_for) {
    const auto base = ball(0, [](const Vector3d&) { return 1000; });
    std::vector<std::uint8_t> payload{8, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};  // eight levels and their rules
    for (int k = 0; k < 9; ++k) payload.insert(payload.end(), {0x80, 0x80, 0x80, 0x80, 0x04});  // 2^30 each
    const auto decoded = decode_surface_levels(payload, base, 1 << 16);
    ASSERT_FALSE(decoded);
    EXPECT_EQ(decoded.error().kind, ErrorKind::corrupt_stream);
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
    const auto decoded = decode_surface_levels(coded->levels.payload, *base, 1 << 20);
    ASSERT_TRUE(decoded);
    EXPECT_EQ(decoded->positions, coded->levels.surface.positions);
    EXPECT_EQ(decoded->finest(), coded->levels.surface.finest());
}

TEST(LeveledIntra, a_finer_step_comes_nearer_for_more_bytes) {
    const auto captured = bumpy();
    double error = 1e9;
    std::size_t bytes = 0;
    for (const double step : {64.0, 32.0, 16.0}) {
        const auto coded = encode_leveled_intra(captured, {.step = LatticeUnits(step)});
        ASSERT_TRUE(coded);
        const auto& surface = coded->levels.surface;
        const double now = rms_between(captured.positions, surface.positions, surface.finest());
        EXPECT_LT(now, 0.5 * step);
        EXPECT_LT(now, error);
        EXPECT_GT(coded->levels.payload.size(), bytes);
        error = now;
        bytes = coded->levels.payload.size();
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
    EXPECT_LT(rms_between(captured.positions, surface.positions, surface.finest()),
              1.2 * rms_between(captured.positions, intra->positions, intra->triangles));
    EXPECT_LT(write_frame_payload(coded->base).size() + coded->levels.payload.size(),
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
    for (const auto sides : find_edges(surface.positions.size(), surface.finest()).sides) ASSERT_EQ(sides, 2u);
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
    EXPECT_LT(rms_between(sheet.positions, surface.positions, surface.finest()), 15);
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
        const auto decoded = decode_surface_levels(coded->levels.payload, coded->decoded_base, 1 << 22);
        ASSERT_TRUE(decoded);
        ASSERT_EQ(decoded->positions, coded->levels.surface.positions);
    }
}

}  // namespace
}  // namespace htvm::internal
