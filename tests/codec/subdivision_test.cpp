#include "codec/reference/subdivision.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "codec/ball.h"
#include "codec/intra_test_meshes.h"

namespace htvm::internal {
namespace {

using test::ball;

LatticeMesh mesh_of(const intra_test::Connectivity& connectivity, unsigned seed) {
    LatticeMesh out;
    out.positions = intra_test::points(connectivity.vertex_count, seed);
    out.triangles = connectivity.triangles;
    return out;
}

LatticeMesh square(std::uint32_t cells, std::int32_t cell) {
    LatticeMesh out;
    out.triangles = intra_test::grid(cells).triangles;
    for (std::uint32_t y = 0; y <= cells; ++y)
        for (std::uint32_t x = 0; x <= cells; ++x)
            out.positions.push_back({static_cast<std::int32_t>(x) * cell, static_cast<std::int32_t>(y) * cell, 0});
    return out;
}

// Where each vertex lies on the flat base.
std::vector<Vector3d> flat_places(const LatticeMesh& base, const std::vector<SubdivisionLevel>& levels) {
    std::vector<Vector3d> out;
    for (const auto p : base.positions) out.push_back(to_vector(p));
    for (const auto& level : levels)
        for (const auto& s : level.stencils) out.push_back((out[s.a] + out[s.b]) * 0.5);
    return out;
}

double area(std::span<const Vector3d> places, std::span<const Triangle> triangles) {
    double sum = 0;
    for (const auto& t : triangles) sum += length(area_vector(places[t[0]], places[t[1]], places[t[2]])) / 2;
    return sum;
}

// How often each directed side is there.
std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides_of(std::span<const Triangle> triangles) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> out;
    for (const auto& t : triangles)
        for (std::size_t i = 0; i < 3; ++i) ++out[{t[i], t[(i + 1) % 3]}];
    return out;
}

bool is_closed(std::span<const Triangle> triangles) {
    const auto sides = sides_of(triangles);
    for (const auto& [side, count] : sides) {
        const auto back = sides.find({side.second, side.first});
        if (count != 1 || back == sides.end()) return false;
    }
    return true;
}

TEST(Subdivision, edges_are_numbered_as_triangles_name_them) {
    const std::vector<Triangle> triangles{{2, 0, 1}, {1, 3, 2}, {4, 4, 0}};
    const auto edges = find_edges(5, triangles);
    EXPECT_EQ(edges.ends, (std::vector<std::array<std::uint32_t, 2>>{{0, 2}, {0, 1}, {1, 2}, {1, 3}, {2, 3}}));
    EXPECT_EQ(edges.sides, (std::vector<std::uint32_t>{1, 1, 2, 1, 1}));
    EXPECT_EQ(edges.triangles[2], (std::array<std::uint32_t, 2>{0, 1}));
    EXPECT_EQ(edges.of_triangle[2], (std::array<std::uint32_t, 3>{no_element, no_element, no_element}));
}

TEST(Subdivision, each_level_splits_the_edges_of_the_one_above_in_their_order) {
    const auto base = ball(2, [](const Vector3d& d) { return 400 + 300 * d[0] * d[0] * d[0]; });
    const auto levels = subdivide(base, {.levels = 4, .longest_edge = 45}, 1 << 20);
    ASSERT_TRUE(levels);
    std::span<const Triangle> above = base.triangles;
    for (const auto& level : *levels) {
        const auto edges = find_edges(level.first, above);
        std::vector<std::uint32_t> split;
        for (std::uint32_t e = 0; e < edges.size() && split.size() < level.stencils.size(); ++e) {
            const auto& next = level.stencils[split.size()];
            if (edges.ends[e] == std::array{next.a, next.b}) split.push_back(e);
        }
        ASSERT_EQ(split.size(), level.stencils.size());
        const auto stencils = edge_stencils(level.first, above, edges, split);
        for (std::size_t i = 0; i < stencils.size(); ++i) {
            ASSERT_EQ(stencils[i].across, level.stencils[i].across);
            ASSERT_EQ(stencils[i].wings, level.stencils[i].wings);
        }
        above = level.triangles;
    }
}

TEST(Subdivision, what_is_closed_stays_closed_at_every_depth) {
    const auto base = ball(2, [](const Vector3d& d) { return 400 + 300 * d[0] * d[0] * d[0]; });
    for (const std::uint32_t longest : {20u, 45u, 70u, 100u, 150u}) {
        const auto levels = subdivide(base, {.levels = 3, .longest_edge = longest}, 1 << 20);
        ASSERT_TRUE(levels);
        for (const auto& level : *levels) EXPECT_TRUE(is_closed(level.triangles)) << longest;
    }
}

TEST(Subdivision, long_edges_are_split_first_and_none_is_left_much_longer_than_asked_for) {
    const auto base = ball(2, [](const Vector3d& d) { return 400 + 300 * d[0] * d[0] * d[0]; });
    const std::uint32_t longest = 40;
    const auto levels = subdivide(base, {.levels = 6, .longest_edge = longest}, 1 << 20);
    ASSERT_TRUE(levels);
    const auto places = flat_places(base, *levels);
    for (const auto& t : levels->back().triangles)
        for (std::size_t i = 0; i < 3; ++i) EXPECT_LE(length(places[t[(i + 1) % 3]] - places[t[i]]), 1.5 * longest);
    const auto& last = levels->back();
    for (const auto& s : last.stencils) EXPECT_GT(length(places[s.b] - places[s.a]), longest);
}

TEST(Subdivision, a_border_keeps_its_place_and_no_crack_opens) {
    const auto base = square(7, 100);
    const auto levels = subdivide(base, {.levels = 2, .longest_edge = 60}, 1 << 20);
    ASSERT_TRUE(levels);
    const auto places = flat_places(base, *levels);
    const auto& triangles = levels->back().triangles;
    EXPECT_DOUBLE_EQ(area(places, triangles), 700.0 * 700);
    const auto sides = sides_of(triangles);
    double border = 0;
    for (const auto& [side, count] : sides) {
        EXPECT_EQ(count, 1);
        if (!sides.contains({side.second, side.first})) border += length(places[side.second] - places[side.first]);
    }
    EXPECT_DOUBLE_EQ(border, 4 * 700);
}

TEST(Subdivision, any_mesh_keeps_its_area_and_names_vertices_that_exist) {
    unsigned seed = 1;
    for (const auto& connectivity : intra_test::awkward()) {
        const auto base = mesh_of(connectivity, seed++);
        const auto levels = subdivide(base, {.levels = 3, .longest_edge = 8}, 1 << 16);
        if (!levels) continue;
        const auto places = flat_places(base, *levels);
        for (const auto& level : *levels) {
            ASSERT_EQ(level.beside.size(), level.stencils.size());
            for (const auto& t : level.triangles)
                for (const auto v : t) ASSERT_LT(v, level.first + level.stencils.size());
            for (std::size_t i = 0; i < level.stencils.size(); ++i)
                for (const auto v : level.beside[i]) ASSERT_TRUE(v == no_element || v < level.first + i);
        }
        const double before = area(places, base.triangles), after = area(places, levels->back().triangles);
        ASSERT_NEAR(after, before, 1e-9 * before);
    }
}

TEST(Subdivision, more_vertices_or_triangles_than_allowed_are_refused) {
    const auto base = ball(2, [](const Vector3d&) { return 1000; });
    EXPECT_FALSE(subdivide(base, {.levels = 8, .longest_edge = 1}, 5000));
    LatticeMesh stacked;  // many triangles on three vertices
    stacked.positions = {{0, 0, 0}, {4096, 0, 0}, {0, 4096, 0}};
    stacked.triangles.assign(1000, {0, 1, 2});
    EXPECT_FALSE(subdivide(stacked, {.levels = 8, .longest_edge = 1}, 2000));
}

TEST(Subdivision, butterfly_continues_a_plane_and_tangents_a_circle) {
    const auto base = square(4, 64);
    const auto levels = subdivide(base, {.levels = 1, .longest_edge = 1}, 1 << 20);
    ASSERT_TRUE(levels);
    const auto normals = vertex_normals(base.positions, base.triangles);
    for (const auto& s : levels->front().stencils) {
        const bool inside = s.wings[0][0] != no_element && s.wings[0][1] != no_element && s.wings[1][0] != no_element &&
                            s.wings[1][1] != no_element;
        const auto offset = butterfly_offset(base.positions, s);
        EXPECT_EQ(offset[2], 0);
        EXPECT_TRUE(!inside || offset == (std::array<std::int64_t, 3>{0, 0, 0}));
        EXPECT_EQ(tangents_offset(base.positions, normals, s), (Vector3d{0, 0, 0}));
    }
    // Two ends an eighth of a circle apart, with its normals.
    const double radius = 1 << 16, angle = std::acos(-1.0) / 8;
    const auto at = [&](double a) { return Vector3d{std::cos(a), std::sin(a), 0}; };
    std::vector<LatticePoint> ends;
    for (const double a : {-angle, angle})
        ends.push_back({static_cast<std::int32_t>(std::lround(radius * std::cos(a))),
                        static_cast<std::int32_t>(std::lround(radius * std::sin(a))), 0});
    EdgeStencil stencil;
    stencil.a = 0;
    stencil.b = 1;
    stencil.across = {no_element, no_element};
    stencil.along = {no_element, no_element};
    const auto expected = expected_vertex(ends, std::vector<Vector3d>{at(-angle), at(angle)}, stencil, {0, 8});
    EXPECT_NEAR(length(expected), radius, 0.01 * radius);
    EXPECT_GT(length(expected), 1.06 * radius * std::cos(angle));
}

TEST(Subdivision, at_a_border_the_four_point_rule_follows_it) {
    LatticeMesh strip;  // a border that bends
    strip.positions = {{0, 0, 0}, {64, 0, 16}, {128, 0, 16}, {192, 0, 0}, {96, 64, 16}};
    strip.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}};
    const auto edges = find_edges(strip.positions.size(), strip.triangles);
    std::vector<std::uint32_t> middle;
    for (std::uint32_t e = 0; e < edges.size(); ++e)
        if (edges.ends[e] == std::array<std::uint32_t, 2>{1, 2}) middle.push_back(e);
    const auto stencils = edge_stencils(strip.positions.size(), strip.triangles, edges, middle);
    ASSERT_EQ(stencils.size(), 1u);
    EXPECT_EQ(stencils[0].along, (std::array<std::uint32_t, 2>{0, 3}));
    EXPECT_EQ(butterfly_offset(strip.positions, stencils[0]), (std::array<std::int64_t, 3>{0, 0, 32}));
}

}  // namespace
}  // namespace htvm::internal
