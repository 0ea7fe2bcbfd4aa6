#include "surface/surface_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace htvm::internal {
namespace {

float squared(const Point3f& a, const Point3f& b) {
    const float x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

Point3f at(const std::array<float, 3>& w, const Point3f& a, const Point3f& b, const Point3f& c) {
    Point3f p{};
    for (std::size_t i = 0; i < 3; ++i) p[i] = w[0] * a[i] + w[1] * b[i] + w[2] * c[i];
    return p;
}

// A wavy height field of n x n squares, 10 a side.
void wave(std::uint32_t n, std::vector<Point3f>& positions, std::vector<Triangle>& triangles) {
    for (std::uint32_t y = 0; y <= n; ++y)
        for (std::uint32_t x = 0; x <= n; ++x)
            positions.push_back({float(x) * 10, float(y) * 10, 15 * std::sin(float(x + 2 * y) * 0.4f)});
    for (std::uint32_t y = 0; y < n; ++y)
        for (std::uint32_t x = 0; x < n; ++x) {
            const std::uint32_t v = y * (n + 1) + x;
            triangles.push_back({v, v + 1, v + n + 2});
            triangles.push_back({v, v + n + 2, v + n + 1});
        }
}

TEST(ClosestBarycentric, IsOnTheFaceASideOrACorner) {
    const Point3f a{0, 0, 0}, b{4, 0, 0}, c{0, 4, 0};
    using Weights = std::array<float, 3>;
    EXPECT_EQ(closest_barycentric({1, 1, 5}, a, b, c), (Weights{0.5f, 0.25f, 0.25f}));
    EXPECT_EQ(closest_barycentric({2, -3, 1}, a, b, c), (Weights{0.5f, 0.5f, 0}));
    EXPECT_EQ(closest_barycentric({-1, -1, 0}, a, b, c), (Weights{1, 0, 0}));
    EXPECT_EQ(closest_barycentric({9, -1, 0}, a, b, c), (Weights{0, 1, 0}));
    EXPECT_EQ(closest_barycentric({4, 4, 0}, a, b, c), (Weights{0, 0.5f, 0.5f}));
}

TEST(ClosestBarycentric, OfALineOrAPointIsFinite) {
    const Point3f a{0, 0, 0}, b{4, 0, 0}, c{2, 0, 0};
    EXPECT_EQ(at(closest_barycentric({3, 5, 0}, a, b, c), a, b, c), (Point3f{3, 0, 0}));
    EXPECT_EQ(at(closest_barycentric({3, 5, 0}, a, a, b), a, a, b), (Point3f{3, 0, 0}));
    EXPECT_EQ(at(closest_barycentric({3, 5, 0}, b, b, b), b, b, b), b);
}

TEST(ClosestBarycentric, IsNearerThanAnySampleOfRandomTriangles) {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> spread(-10, 10), part(0, 1);
    for (int i = 0; i < 2000; ++i) {
        const auto point = [&] { return Point3f{spread(random), spread(random), spread(random)}; };
        const Point3f a = point(), b = point(), query = point();
        Point3f c = point();
        if (i % 3 == 0) c = at({0.4f, 0.6f, 1e-6f}, a, b, c);  // a sliver
        const auto w = closest_barycentric(query, a, b, c);
        EXPECT_NEAR(w[0] + w[1] + w[2], 1, 1e-5);
        for (const float x : w) EXPECT_TRUE(x >= 0 && x <= 1) << x;
        const float found = squared(at(w, a, b, c), query);
        for (int k = 0; k < 30; ++k) {
            const float u = part(random), v = part(random) * (1 - u);
            EXPECT_LE(found, squared(at({u, v, 1 - u - v}, a, b, c), query) + 1e-3f);
        }
    }
}

TEST(SurfaceSearch, FindsWhatAllTrianglesHoldNearest) {
    std::vector<Point3f> positions;
    std::vector<Triangle> triangles;
    wave(20, positions, triangles);
    const SurfaceSearch search(positions, triangles);
    std::mt19937 random(1);
    std::uniform_real_distribution<float> place(5, 195), shift(-5, 5);
    for (int i = 0; i < 300; ++i) {
        const float x = place(random), y = place(random);
        const Point3f query{x, y, 15 * std::sin((x + 2 * y) * 0.04f) + shift(random)};
        float best = 1e30f;
        for (const auto& [a, b, c] : triangles) {
            const auto w = closest_barycentric(query, positions[a], positions[b], positions[c]);
            best = std::min(best, squared(at(w, positions[a], positions[b], positions[c]), query));
        }
        const auto found = search.closest(query);
        ASSERT_LT(found.triangle, triangles.size());
        EXPECT_NEAR(found.squared_distance, best, 1e-3f * (1 + best));
        EXPECT_NEAR(squared(found.point, query), found.squared_distance, 1e-3f * (1 + best));
    }
}

TEST(SurfaceSearch, ALargeTriangleAmongSmallOnesIsFoundFromItsMiddle) {
    std::vector<Point3f> positions;
    std::vector<Triangle> triangles;
    wave(20, positions, triangles);
    const auto first = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), {{0, 0, 40}, {200, 0, 40}, {100, 200, 40}});
    triangles.push_back({first, first + 1, first + 2});
    const auto found = SurfaceSearch(positions, triangles).closest({100, 80, 41});
    EXPECT_EQ(found.triangle, triangles.size() - 1);
    EXPECT_FLOAT_EQ(found.squared_distance, 1);
}

TEST(SurfaceSearch, PiecesThatTouchAreSearchedAcrossTheirSeam) {
    // The query's nearest vertex belongs to both pieces, its triangle only to the second.
    const std::vector<Point3f> positions = {{0, 0, 0}, {0, 9, 0}, {-9, 0, 0}, {0, 0, 0}, {0, 9, 0}, {9, 0, 0}};
    const std::vector<Triangle> triangles = {{0, 1, 2}, {3, 5, 4}};
    const SurfaceSearch search(positions, triangles);
    EXPECT_EQ(search.closest({1, 1, 1}).triangle, 1u);
    EXPECT_EQ(search.closest({-1, 1, 1}).triangle, 0u);
}

TEST(SurfaceSearch, VerticesWithoutTrianglesAreNoSurfaceUnlessThereAreNone) {
    const std::vector<Point3f> positions = {{5, 5, 5}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::vector<Triangle> triangle = {{1, 2, 3}};
    EXPECT_GT(SurfaceSearch(positions, triangle).closest({5, 5, 5}).squared_distance, 30);
    const auto found = SurfaceSearch(positions, {}).closest({5, 5, 6});
    EXPECT_EQ(found.triangle, 0u);
    EXPECT_EQ(found.squared_distance, 1);
    EXPECT_EQ(found.point, (Point3f{5, 5, 5}));
}

TEST(SurfaceSearch, OfNothingIsEmpty) {
    EXPECT_TRUE(SurfaceSearch({}, {}).empty());
    const std::vector<Point3f> one = {{1, 2, 3}};
    EXPECT_FALSE(SurfaceSearch(one, {}).empty());
}

TEST(SurfaceSearch, AnyTrianglesAreSearchedWithoutNaN) {
    std::mt19937 random(9);
    for (int round = 0; round < 200; ++round) {
        std::vector<Point3f> positions(1 + random() % 12);
        for (auto& p : positions)
            for (auto& c : p) c = static_cast<float>(random() % 3) * (round % 2 == 0 ? 1.0f : 1e6f);
        std::vector<Triangle> triangles(random() % 12);
        for (auto& t : triangles)
            for (auto& v : t) v = static_cast<std::uint32_t>(random() % positions.size());
        const SurfaceSearch search(positions, triangles);
        for (const auto& p : positions) {
            const auto found = search.closest({p[0] + 0.5f, p[1], p[2]});
            EXPECT_GE(found.squared_distance, 0);
            EXPECT_TRUE(std::isfinite(found.point[0] + found.point[1] + found.point[2]));
        }
    }
}

}  // namespace
}  // namespace htvm::internal
