#include "io/polygon.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace htvm {
namespace {

// The fan of a polygon of all the positions, and a triangle before and behind it.
Mesh fan_of(std::vector<Vector3f> positions) {
    Mesh mesh;
    mesh.triangles.push_back({0, 0, 0});
    for (std::uint32_t c = 2; c < positions.size(); ++c) mesh.triangles.push_back({0, c - 1, c});
    mesh.triangles.push_back({1, 1, 1});
    mesh.positions = std::move(positions);
    return mesh;
}

Mesh cut(std::vector<Vector3f> positions) {
    Mesh mesh = fan_of(std::move(positions));
    mend_fans(mesh, std::vector<Fan>{{1, static_cast<std::uint32_t>(mesh.positions.size() - 2)}});
    EXPECT_EQ(mesh.triangles.front(), (Triangle{0, 0, 0}));
    EXPECT_EQ(mesh.triangles.back(), (Triangle{1, 1, 1}));
    return mesh;
}

// Twice the areas, summed: with signs as seen from z and without.
std::array<double, 2> areas_of(const Mesh& mesh) {
    std::array<double, 2> out{};
    for (const auto& [a, b, c] : mesh.triangles) {
        const auto& p = mesh.positions;
        const double area = static_cast<double>(p[b][0] - p[a][0]) * static_cast<double>(p[c][1] - p[a][1]) -
                            static_cast<double>(p[b][1] - p[a][1]) * static_cast<double>(p[c][0] - p[a][0]);
        out[0] += area;
        out[1] += std::abs(area);
    }
    return out;
}

TEST(Polygon, ConvexOnesStayFans) {
    std::vector<Vector3f> circle;
    for (int i = 0; i < 40; ++i) {
        const float angle = 0.157079633f * static_cast<float>(i);
        circle.push_back({1000 + std::cos(angle), std::sin(angle), 1000 + std::cos(angle)});
    }
    EXPECT_EQ(cut(circle).triangles, fan_of(circle).triangles);
    const std::vector<Vector3f> on_a_line = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {0, 1, 0}};
    EXPECT_EQ(cut(on_a_line).triangles, fan_of(on_a_line).triangles);
    const std::vector<Vector3f> bent_quad = {{0, 0, 0}, {1, 0, 0.3f}, {1, 1, 0}, {0, 1, 0.3f}};
    EXPECT_EQ(cut(bent_quad).triangles, fan_of(bent_quad).triangles);
}

TEST(Polygon, AConcaveQuadTakesTheOtherDiagonal) {
    const auto mesh = cut({{0, 0, 0}, {2, 0, 0}, {0.5f, 0.5f, 0}, {0, 2, 0}});
    EXPECT_EQ(areas_of(mesh)[0], areas_of(mesh)[1]) << "the fan at the corner opposite of the dent is whole";
    const auto dented = cut({{2, 0, 0}, {0.5f, 0.5f, 0}, {0, 2, 0}, {0, 0, 0}});
    EXPECT_DOUBLE_EQ(areas_of(dented)[0], 2);
    EXPECT_DOUBLE_EQ(areas_of(dented)[1], 2);
    for (const auto& triangle : {dented.triangles[1], dented.triangles[2]})
        EXPECT_TRUE(std::ranges::count(triangle, 1u) == 1 && std::ranges::count(triangle, 3u) == 1);
}

TEST(Polygon, AnLIsCutWithinItselfWhereverItBegins) {
    const std::vector<Vector3f> l = {{0, 0, 0},       {1.2f, 0, 0},    {1.2f, 0.4f, 0},
                                     {0.4f, 0.4f, 0}, {0.4f, 1.6f, 0}, {0, 1.6f, 0}};
    for (const bool is_turned : {false, true}) {
        for (std::size_t first = 0; first < l.size(); ++first) {
            auto corners = l;
            std::rotate(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(first), corners.end());
            if (is_turned) std::ranges::reverse(corners);
            const auto [with_sign, without] = areas_of(cut(corners));
            EXPECT_NEAR(with_sign, is_turned ? -1.92 : 1.92, 1e-6) << first;
            EXPECT_NEAR(without, 1.92, 1e-6) << first;
        }
    }
}

// Around a circle, at distances from its centre that vary: simple, and seldom convex.
std::vector<Vector3f> random_star(std::size_t corners, std::mt19937& random) {
    std::vector<Vector3f> out;
    for (std::size_t i = 0; i < corners; ++i) {
        const double angle = 6.283185307179586 * static_cast<double>(i) / static_cast<double>(corners);
        const double distance = 1 + static_cast<double>(random() % 1000) / 100;
        out.push_back(
            {static_cast<float>(distance * std::cos(angle)), static_cast<float>(distance * std::sin(angle)), 0});
    }
    return out;
}

TEST(Polygon, SimpleOnesAreCutWithinThemselves) {
    std::mt19937 random(1);
    for (int trial = 0; trial < 300; ++trial) {
        const auto corners = random_star(5 + random() % 60, random);
        const auto fan = areas_of(fan_of(corners));
        const auto [with_sign, without] = areas_of(cut(corners));
        EXPECT_NEAR(with_sign, fan[0], 1e-3) << trial;
        EXPECT_NEAR(without, fan[0], 0.02) << trial;
    }
}

TEST(Polygon, AHoleBetweenTwoEdgesAtOnePlaceStaysAHole) {
    const auto mesh = cut(
        {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {0, 0, 0}, {1, 1, 0}, {1, 3, 0}, {3, 3, 0}, {3, 1, 0}, {1, 1, 0}});
    EXPECT_DOUBLE_EQ(areas_of(mesh)[0], 24);
    EXPECT_DOUBLE_EQ(areas_of(mesh)[1], 24);
}

TEST(Polygon, WhatHasNoCutKeepsItsFan) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const std::vector<std::vector<Vector3f>> odd = {
        {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}},
        {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, 0, 0}, {3, 0, 0}},
        {{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}},
        {{0, 0, 0}, {nan, 0, 0}, {1, 1, 0}, {0, 1, 0}},
        {{3e38f, 0, 0}, {-3e38f, 3e38f, 0}, {3e38f, 3e38f, -3e38f}, {0, 1, 3e38f}},
    };
    for (std::size_t i = 0; i < odd.size(); ++i) {
        const Mesh mesh = cut(odd[i]), fan = fan_of(odd[i]);
        EXPECT_EQ(mesh.triangles.size(), fan.triangles.size()) << i;
        if (i < 4) {
            EXPECT_EQ(mesh.triangles, fan.triangles) << i;
        }
    }
}

TEST(Polygon, AnyCornersGiveAsManyTrianglesInABoundedTime) {
    std::mt19937 random(2);
    for (const std::size_t corners : {4u, 5u, 7u, 30u, 30000u}) {
        for (int trial = 0; trial < (corners < 100 ? 200 : 1); ++trial) {
            std::vector<Vector3f> places;
            for (std::size_t i = 0; i < corners; ++i) {
                const auto any = [&] { return static_cast<float>(random() % 5); };
                places.push_back({any(), any(), any()});
            }
            const auto mesh = cut(places);
            EXPECT_EQ(mesh.triangles.size(), corners);
        }
    }
}

}  // namespace
}  // namespace htvm
