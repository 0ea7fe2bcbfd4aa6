#include "surface/simplification.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <random>
#include <set>

namespace htvm::internal {
namespace {

using Eigen::Vector3d;

struct Input {
    std::vector<Vector3d> positions;
    std::vector<Triangle> triangles;
    std::vector<Colour> colours;
};

// A square of side `cells` in the plane z = 0.
Input plane(std::uint32_t cells) {
    Input out;
    for (std::uint32_t y = 0; y <= cells; ++y)
        for (std::uint32_t x = 0; x <= cells; ++x) out.positions.emplace_back(x, y, 0);
    for (std::uint32_t y = 0; y < cells; ++y)
        for (std::uint32_t x = 0; x < cells; ++x) {
            const std::uint32_t a = y * (cells + 1) + x, b = a + 1, c = a + cells + 1, d = c + 1;
            out.triangles.push_back({a, b, d});
            out.triangles.push_back({a, d, c});
        }
    return out;
}

// A closed sphere of the given number of rings around the origin.
Input sphere(double radius, std::uint32_t rings, double shift = 0) {
    Input out;
    const std::uint32_t around = 2 * rings;
    out.positions.emplace_back(shift, 0, radius);
    for (std::uint32_t ring = 1; ring < rings; ++ring)
        for (std::uint32_t i = 0; i < around; ++i) {
            const double polar = std::numbers::pi * ring / rings, angle = 2 * std::numbers::pi * i / around;
            out.positions.emplace_back(shift + radius * std::sin(polar) * std::cos(angle),
                                       radius * std::sin(polar) * std::sin(angle), radius * std::cos(polar));
        }
    out.positions.emplace_back(shift, 0, -radius);
    const auto last = static_cast<std::uint32_t>(out.positions.size() - 1);
    const auto at = [&](std::uint32_t ring, std::uint32_t i) { return 1 + (ring - 1) * around + i % around; };
    for (std::uint32_t i = 0; i < around; ++i) {
        out.triangles.push_back({0, at(1, i), at(1, i + 1)});
        for (std::uint32_t ring = 1; ring + 1 < rings; ++ring) {
            out.triangles.push_back({at(ring, i), at(ring + 1, i), at(ring + 1, i + 1)});
            out.triangles.push_back({at(ring, i), at(ring + 1, i + 1), at(ring, i + 1)});
        }
        out.triangles.push_back({at(rings - 1, i), last, at(rings - 1, i + 1)});
    }
    return out;
}

SimplifiedMesh simplified(const Input& input, double surface_error, double colour_error = 12, double longest = 0) {
    SimplificationOptions options;
    options.surface_error = surface_error;
    options.colour_error = colour_error;
    options.longest_edge = longest;
    return simplify(input.positions, input.triangles, input.colours, options);
}

double area(const std::vector<Vector3d>& positions, const std::vector<Triangle>& triangles) {
    double sum = 0;
    for (const auto& [a, b, c] : triangles)
        sum += (positions[b] - positions[a]).cross(positions[c] - positions[a]).norm() / 2;
    return sum;
}

std::size_t edges(const std::vector<Triangle>& triangles) {
    std::set<std::pair<std::uint32_t, std::uint32_t>> out;
    for (const auto& t : triangles)
        for (std::size_t i = 0; i < 3; ++i) out.insert(std::minmax(t[i], t[(i + 1) % 3]));
    return out.size();
}

void expect_sound(const SimplifiedMesh& mesh) {
    for (const auto& t : mesh.triangles) {
        EXPECT_NE(t[0], t[1]);
        EXPECT_NE(t[1], t[2]);
        EXPECT_NE(t[0], t[2]);
        for (const auto v : t) ASSERT_LT(v, mesh.positions.size());
    }
    for (const auto& p : mesh.positions) EXPECT_TRUE(p.allFinite());
}

TEST(Simplification, collapses_nothing_without_an_error_to_spend) {
    const auto input = plane(4);
    const auto out = simplified(input, 0);
    EXPECT_EQ(out.positions, input.positions);
    EXPECT_EQ(out.triangles, input.triangles);
    EXPECT_TRUE(out.colours.empty());
}

TEST(Simplification, where_it_must_be_finer_more_is_kept) {
    const auto input = sphere(100, 24);
    std::vector<float> finer(input.positions.size());
    for (std::size_t v = 0; v < finer.size(); ++v) finer[v] = input.positions[v].z() > 0 ? 4 : 1;
    SimplificationOptions options;
    options.surface_error = 3;
    options.finer = finer;
    const auto out = simplify(input.positions, input.triangles, {}, options);
    expect_sound(out);
    std::size_t above = 0, below = 0;
    for (const auto& p : out.positions) ++(p.z() > 0 ? above : below);
    EXPECT_GT(above, 2 * below);
}

TEST(Simplification, a_flat_square_keeps_its_outline_and_little_else) {
    const auto out = simplified(plane(20), 0.01);
    expect_sound(out);
    EXPECT_LT(out.positions.size(), 40u);
    EXPECT_NEAR(area(out.positions, out.triangles), 400, 4);
    for (const auto& p : out.positions) EXPECT_NEAR(p.z(), 0, 1e-9);
}

TEST(Simplification, a_vertex_at_the_border_keeps_its_last_triangle_or_goes_with_it) {
    for (const std::uint32_t cells : {2u, 3u, 9u, 32u, 64u, 100u}) {
        auto input = plane(cells);
        const double middle = cells / 2.0;
        for (auto& p : input.positions) p.z() = -((p - Vector3d(middle, middle, 0)).squaredNorm()) / 160;
        for (const double error : {0.1, 0.3, 1.0})
            for (const bool keep_tips : {true, false}) {
                SimplificationOptions options;
                options.surface_error = error;
                options.keep_tips = keep_tips;
                const auto out = simplify(input.positions, input.triangles, {}, options);
                expect_sound(out);
                std::set<std::uint32_t> used;
                for (const auto& t : out.triangles) used.insert(t.begin(), t.end());
                EXPECT_EQ(used.size(), out.positions.size());
            }
    }
}

TEST(Simplification, a_sphere_stays_closed_and_round_with_fewer_vertices_the_larger_the_error) {
    const auto input = sphere(100, 30);
    std::size_t before = input.positions.size();
    for (const double error : {0.3, 1.0, 3.0}) {
        const auto out = simplified(input, error);
        expect_sound(out);
        EXPECT_LT(out.positions.size(), before);
        before = out.positions.size();
        EXPECT_EQ(out.positions.size() - edges(out.triangles) + out.triangles.size(), 2u);  // Euler
        for (const auto& p : out.positions) EXPECT_NEAR(p.norm(), 100, 3 * error);
    }
}

TEST(Simplification, spheres_that_do_not_touch_stay_apart) {
    auto input = sphere(50, 16);
    const auto other = sphere(50, 16, 101);
    const auto first = static_cast<std::uint32_t>(input.positions.size());
    input.positions.insert(input.positions.end(), other.positions.begin(), other.positions.end());
    for (const auto& t : other.triangles) input.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    const auto out = simplified(input, 2);
    expect_sound(out);
    EXPECT_EQ(out.positions.size() - edges(out.triangles) + out.triangles.size(), 4u);
}

TEST(Simplification, no_edge_grows_longer_than_asked) {
    const auto out = simplified(plane(20), 1, 12, 4);
    expect_sound(out);
    EXPECT_LT(out.positions.size(), 250u);
    for (const auto& t : out.triangles)
        for (std::size_t i = 0; i < 3; ++i)
            EXPECT_LE((out.positions[t[i]] - out.positions[t[(i + 1) % 3]]).norm(), 4 + 1e-9);
}

TEST(Simplification, colours_are_means_and_a_border_between_two_stays_sharp) {
    auto input = plane(20);
    for (const auto& p : input.positions)
        input.colours.push_back(p.x() < 10 ? Colour{200, 10, 10} : Colour{10, 10, 200});
    const auto out = simplified(input, 1, 10);
    expect_sound(out);
    ASSERT_EQ(out.colours.size(), out.positions.size());
    EXPECT_LT(out.positions.size(), 200u);
    for (std::size_t v = 0; v < out.positions.size(); ++v) {
        const bool left = out.colours[v][0] > 100;
        EXPECT_NEAR(out.colours[v][0], left ? 200 : 10, 20);
        EXPECT_NEAR(out.colours[v][2], left ? 10 : 200, 20);
        EXPECT_TRUE(left ? out.positions[v].x() < 10.5 : out.positions[v].x() > 8.5);
    }
}

TEST(Simplification, takes_the_empty_the_isolated_and_the_degenerate) {
    EXPECT_TRUE(simplified({}, 1).positions.empty());
    Input input = plane(3);
    input.positions.emplace_back(50, 50, 50);
    input.triangles.push_back({0, 0, 1});
    const auto out = simplified(input, 1);
    expect_sound(out);
    EXPECT_EQ(out.positions.back(), Vector3d(50, 50, 50));
}

// Large meshes are cut into regions, which are simplified side by side.
SimplifiedMesh same_for_any_number_of_threads(const Input& input) {
    SimplificationOptions options;
    options.surface_error = 0.5;
    auto alone = simplify(input.positions, input.triangles, input.colours, options);
    expect_sound(alone);
    EXPECT_LT(alone.positions.size(), input.positions.size() / 2);
    for (const unsigned threads : {2u, 3u, 8u}) {
        const ThreadPool pool(threads);
        options.threads = pool;
        const auto beside = simplify(input.positions, input.triangles, input.colours, options);
        EXPECT_EQ(beside.positions, alone.positions);
        EXPECT_EQ(beside.triangles, alone.triangles);
        EXPECT_EQ(beside.colours, alone.colours);
    }
    return alone;
}

TEST(Simplification, of_large_meshes_is_sound_and_the_same_for_any_number_of_threads) {
    std::mt19937 random(3);
    auto ball = sphere(100, 80);
    for (std::size_t v = 0; v < ball.positions.size(); ++v) {
        ball.positions[v] *= 1 + static_cast<double>(random() % 8) / 4000;
        const auto level = static_cast<std::uint8_t>(v % 3 * 10);
        ball.colours.push_back({level, 100, level});
    }
    const auto round = same_for_any_number_of_threads(ball);
    EXPECT_EQ(round.positions.size() - edges(round.triangles) + round.triangles.size(), 2u);

    const auto flat = same_for_any_number_of_threads(plane(120));
    EXPECT_LT(flat.positions.size(), 200u);
    EXPECT_NEAR(area(flat.positions, flat.triangles), 120 * 120, 0.05 * 120 * 120);

    const auto many_regions = same_for_any_number_of_threads(sphere(400, 250));
    EXPECT_EQ(many_regions.positions.size() - edges(many_regions.triangles) + many_regions.triangles.size(), 2u);

    auto soup = plane(100);
    for (int t = 0; t < 2000; ++t)
        for (auto& corner : soup.triangles[random() % soup.triangles.size()])
            if (random() % 2 > 0) corner = static_cast<std::uint32_t>(random() % soup.positions.size());
    same_for_any_number_of_threads(soup);
}

TEST(Simplification, random_soups_stay_sound) {
    std::mt19937 random(7);
    for (int trial = 0; trial < 50; ++trial) {
        Input input;
        const auto below = [&](std::uint32_t bound) { return static_cast<std::uint32_t>(random() % bound); };
        const std::uint32_t vertices = 3 + below(30);
        for (std::uint32_t v = 0; v < vertices; ++v) input.positions.emplace_back(below(9), below(9), below(9));
        for (std::uint32_t t = 0; t < 60; ++t)
            input.triangles.push_back({below(vertices), below(vertices), below(vertices)});
        const auto out = simplified(input, 2);
        expect_sound(out);
        EXPECT_LE(out.positions.size(), input.positions.size());
        EXPECT_EQ(out.triangles, simplified(input, 2).triangles);
    }
}

// One vertex in the middle of a disc, shared by all its triangles.
Input hub(std::uint32_t triangles) {
    Input out;
    out.positions.emplace_back(0, 0, 0);
    for (std::uint32_t i = 0; i < triangles; ++i) {
        const double turn = 2 * std::acos(-1.0) * i / triangles;
        out.positions.emplace_back(1000 * std::cos(turn), 1000 * std::sin(turn), 0);
        out.triangles.push_back({0, 1 + i, 1 + (i + 1) % triangles});
    }
    return out;
}

TEST(Simplification, of_a_hub_takes_work_in_proportion_to_its_triangles) {
    const auto small = simplified(hub(20000), 1), large = simplified(hub(200000), 1);
    EXPECT_LT(small.positions.size(), 300u);
    EXPECT_LT(large.positions.size(), 300u);
    EXPECT_LT(small.looked_at, 200u * 20000);
    EXPECT_LT(large.looked_at, 12 * small.looked_at);
}

}  // namespace
}  // namespace htvm::internal
