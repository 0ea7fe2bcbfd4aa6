#include "surface/surface_index.h"

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

// Points of one kind: spread, on a coarse grid with many equal ones, in a line, or all in one place.
std::vector<Point3f> points(std::size_t count, int kind, std::mt19937& random) {
    std::uniform_real_distribution<float> spread(-1000, 1000);
    std::vector<Point3f> out;
    for (std::size_t i = 0; i < count; ++i) {
        Point3f p = {spread(random), spread(random), spread(random)};
        if (kind == 1)
            for (auto& c : p) c = static_cast<float>(static_cast<int>(c / 250));
        if (kind == 2) p[1] = p[2] = 0;
        if (kind == 3) p = {5, 6, 7};
        out.push_back(p);
    }
    return out;
}

TEST(NearestPoints, AreAsNearAsBruteForceFindsThem) {
    std::mt19937 random(1);
    for (int kind = 0; kind < 4; ++kind)
        for (const std::size_t count : {1u, 2u, 11u, 12u, 13u, 14u, 100u, 700u}) {
            const auto set = points(count, kind, random);
            const NearestPoints tree(set);
            ASSERT_EQ(tree.size(), count);
            auto queries = points(50, kind, random);
            for (const auto& p : points(50, 0, random)) queries.push_back(p);
            for (const auto& query : queries) {
                float best = squared(set[0], query);
                for (const auto& p : set) best = std::min(best, squared(p, query));
                const auto found = tree.nearest(query);
                ASSERT_LT(found.index, count);
                ASSERT_EQ(squared(set[found.index], query), best) << kind << " " << count;
                ASSERT_FLOAT_EQ(found.squared_distance, best);
                ASSERT_EQ(tree.point(found.index), set[found.index]);
            }
        }
}

// Between two vertices, where rounding decides which of them is nearer, and beside gaps, where fans are not regular.
TEST(SurfaceIndex, WalksEndBetweenVerticesThatAreAsNear) {
    std::mt19937 random(7);
    constexpr std::uint32_t side = 4;
    std::uniform_real_distribution<float> near(-2e-5F, 2e-5F);
    for (int sheet = 0; sheet < 300; ++sheet) {
        std::vector<Point3f> positions;
        std::vector<Triangle> triangles;
        for (std::uint32_t v = 0; v < side * side; ++v)
            positions.push_back({128 * (static_cast<float>(v % side) - 1), 128 * (static_cast<float>(v / side) - 1),
                                 static_cast<float>(random() % 20)});
        for (std::uint32_t v = 0; v + side + 1 < side * side; ++v) {
            if (v % side == side - 1) continue;
            if (random() % 5 > 0) triangles.push_back({v, v + 1, v + side});
            if (random() % 5 > 0) triangles.push_back({v + 1, v + side + 1, v + side});
        }
        const SurfaceIndex index(positions, triangles, {.cell = 300, .samples = 5});
        for (int i = 0; i < 300; ++i) {
            const auto& t = triangles[random() % triangles.size()];
            const auto &a = positions[t[0]], &b = positions[t[1 + random() % 2]];
            const Point3f query = {(a[0] + b[0]) / 2 + near(random), (a[1] + b[1]) / 2 + near(random),
                                   (a[2] + b[2]) / 2 + near(random)};
            const auto found = index.nearest_along(query, t[0]);
            EXPECT_LE(found.squared_distance, squared(a, query));
            EXPECT_EQ(found.squared_distance, squared(positions[found.index], query));
        }
    }
}

TEST(NearestPoints, EveryPointFindsItsOwnPlace) {
    std::mt19937 random(2);
    const auto set = points(500, 1, random);
    const NearestPoints tree(set);
    for (const auto& p : set) EXPECT_EQ(tree.nearest(p).squared_distance, 0.0f);
}

TEST(NearestPoints, NoPointsAreLegalToHold) { EXPECT_EQ(NearestPoints({}).size(), 0u); }

TEST(NearestPoints, CanBeMoved) {
    std::mt19937 random(3);
    const auto set = points(200, 0, random);
    std::vector<NearestPoints> trees;
    for (int i = 0; i < 5; ++i) trees.emplace_back(set);
    EXPECT_EQ(trees[0].nearest(set[17]).squared_distance, 0.0f);
}

TEST(OrientedPoints, AgreeWithASearchThroughAllWhateverTheGuess) {
    std::uint32_t state = 7;
    auto next = [&] { return state = state * 1664525 + 1013904223, static_cast<float>(state >> 8) / (1 << 24); };
    std::vector<Point3f> points, normals;
    for (int i = 0; i < 400; ++i) {
        points.push_back({next() * 100, next() * 100, next() * 20});
        normals.push_back(to_floats(normalised({next() - 0.5, next() - 0.5, next() - 0.5})));
    }
    const OrientedPoints search(points, normals, 9);
    for (int trial = 0; trial < 300; ++trial) {
        const Point3f query = {next() * 140 - 20, next() * 140 - 20, next() * 60 - 20};
        const Point3f normal = to_floats(normalised({next() - 0.5, next() - 0.5, next() - 0.5}));
        const float reach = 5 + next() * 60;
        OrientedMatch best{0, reach * reach, false};
        for (std::uint32_t i = 0; i < points.size(); ++i) {
            const float d = squared(points[i], query);
            if (dot(to_vector(normals[i]), to_vector(normal)) >= 0.3 && d < best.squared_distance) best = {i, d, true};
        }
        const auto guess = static_cast<std::uint32_t>(next() * 400);
        for (const std::uint32_t first : {OrientedPoints::no_point, guess, 4000u}) {
            const auto found = search.nearest(query, normal, reach, 0.3f, first);
            EXPECT_EQ(found.found, best.found);
            if (best.found) {
                EXPECT_EQ(found.index, best.index);
            }
        }
    }
}

TEST(OrientedPoints, PassOverWhatIsNotFinite) {
    const std::vector<Point3f> points = {{NAN, 0, 0}, {INFINITY, 0, 0}, {3, 0, 0}}, normals(3);
    const OrientedPoints search(points, normals, 1);
    EXPECT_EQ(search.nearest({0, 0, 0}, {0, 0, 1}, 10, 0.5f).index, 2u);
    EXPECT_FALSE(search.nearest({NAN, 0, 0}, {0, 0, 1}, 10, 0.5f).found);
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

TEST(SurfaceIndex, FindsWhatAllTrianglesHoldNearest) {
    std::vector<Point3f> positions;
    std::vector<Triangle> triangles;
    wave(20, positions, triangles);
    const SurfaceIndex search(positions, triangles);
    std::mt19937 random(1);
    std::uniform_real_distribution<float> place(5, 195), shift(-5, 5);
    for (int i = 0; i < 300; ++i) {
        const float x = place(random), y = place(random);
        const Point3f query{x, y, 15 * std::sin((x + 2 * y) * 0.04f) + shift(random)};
        float best = 1e30f;
        for (const auto& [a, b, c] : triangles) {
            const auto nearest = closest_on_triangle(to_vector(query), to_vector(positions[a]), to_vector(positions[b]),
                                                     to_vector(positions[c]));
            best = std::min(best, static_cast<float>(nearest.squared_distance));
        }
        const auto found = search.closest(query);
        ASSERT_LT(found.triangle, triangles.size());
        EXPECT_NEAR(found.squared_distance, best, 1e-3f * (1 + best));
        EXPECT_NEAR(squared(found.point, query), found.squared_distance, 1e-3f * (1 + best));
    }
}

TEST(SurfaceIndex, ALargeTriangleAmongSmallOnesIsFoundFromItsMiddle) {
    std::vector<Point3f> positions;
    std::vector<Triangle> triangles;
    wave(20, positions, triangles);
    const auto first = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), {{0, 0, 40}, {200, 0, 40}, {100, 200, 40}});
    triangles.push_back({first, first + 1, first + 2});
    const auto found = SurfaceIndex(positions, triangles).closest({100, 80, 41});
    EXPECT_EQ(found.triangle, triangles.size() - 1);
    EXPECT_FLOAT_EQ(found.squared_distance, 1);
}

TEST(SurfaceIndex, PiecesThatTouchAreSearchedAcrossTheirSeam) {
    // The query's nearest vertex belongs to both pieces, but its triangle only to the second.
    const std::vector<Point3f> positions = {{0, 0, 0}, {0, 9, 0}, {-9, 0, 0}, {0, 0, 0}, {0, 9, 0}, {9, 0, 0}};
    const std::vector<Triangle> triangles = {{0, 1, 2}, {3, 5, 4}};
    const SurfaceIndex search(positions, triangles);
    EXPECT_EQ(search.closest({1, 1, 1}).triangle, 1u);
    EXPECT_EQ(search.closest({-1, 1, 1}).triangle, 0u);
}

TEST(SurfaceIndex, VerticesWithoutTrianglesAreNoSurfaceUnlessThereAreNone) {
    const std::vector<Point3f> positions = {{5, 5, 5}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::vector<Triangle> triangle = {{1, 2, 3}};
    EXPECT_GT(SurfaceIndex(positions, triangle).closest({5, 5, 5}).squared_distance, 30);
    const auto found = SurfaceIndex(positions, {}).closest({5, 5, 6});
    EXPECT_EQ(found.triangle, 0u);
    EXPECT_EQ(found.squared_distance, 1);
    EXPECT_EQ(found.point, (Point3f{5, 5, 5}));
}

TEST(SurfaceIndex, OfNothingIsEmpty) {
    EXPECT_TRUE(SurfaceIndex({}, {}).empty());
    const std::vector<Point3f> one = {{1, 2, 3}};
    EXPECT_FALSE(SurfaceIndex(one, {}).empty());
}

TEST(SurfaceIndex, AnyTrianglesAreSearchedWithoutNaN) {
    std::mt19937 random(9);
    for (int round = 0; round < 200; ++round) {
        std::vector<Point3f> positions(1 + random() % 12);
        for (auto& p : positions)
            for (auto& c : p) c = static_cast<float>(random() % 3) * (round % 2 == 0 ? 1.0f : 1e6f);
        std::vector<Triangle> triangles(random() % 12);
        for (auto& t : triangles)
            for (auto& v : t) v = static_cast<std::uint32_t>(random() % positions.size());
        const SurfaceIndex search(positions, triangles);
        for (const auto& p : positions) {
            const auto found = search.closest({p[0] + 0.5f, p[1], p[2]});
            EXPECT_GE(found.squared_distance, 0);
            EXPECT_TRUE(std::isfinite(found.point[0] + found.point[1] + found.point[2]));
        }
    }
}

TEST(SurfaceIndex, FacingFindsTheSideOfASheetThatTheNormalAsksFor) {
    // Two sheets one above the other, facing away from each other; the query lies nearer to the lower one.
    const std::vector<Point3f> positions = {{0, 0, 0}, {0, 8, 0}, {8, 0, 0}, {0, 0, 4}, {8, 0, 4}, {0, 8, 4}};
    const std::vector<Triangle> triangles = {{0, 1, 2}, {3, 4, 5}};
    const SurfaceIndex index(positions, triangles, {.cell = 10, .samples = 6});
    std::uint32_t guess = OrientedPoints::no_point;
    const auto up = index.closest_facing({2, 2, 1}, {0, 0, 1}, {.reach = 20}, guess);
    EXPECT_EQ(up.triangle, 1u);
    EXPECT_EQ(up.point, (Point3f{2, 2, 4}));
    EXPECT_EQ(up.shares, (std::array<float, 3>{0.5f, 0.25f, 0.25f}));
    EXPECT_EQ(up.squared_distance, 9);
    EXPECT_EQ(index.closest_facing({2, 2, 1}, {0, 0, -1}, {.reach = 20}, guess).triangle, 0u);
    EXPECT_FALSE(index.closest_facing({2, 2, 1}, {1, 0, 0}, {.reach = 20}, guess).found());
    EXPECT_FALSE(index.closest_facing({2, 2, 40}, {0, 0, 1}, {.reach = 20}, guess).found());
    EXPECT_EQ(index.closest({2, 2, 1}).triangle, 0u);
}

TEST(SurfaceIndex, FacingKeepsTheTwoSidesOfASeamApart) {
    // A ridge whose two sides have vertices of their own.
    const std::vector<Point3f> positions = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {0, 0, 0}, {4, 0, 0}, {0, 0, -4}};
    const std::vector<Triangle> triangles = {{0, 1, 2}, {3, 5, 4}};
    const SurfaceIndex index(positions, triangles, {.cell = 10, .samples = 4});
    EXPECT_EQ(index.normals[0], (Point3f{0, 0, 1}));
    EXPECT_EQ(index.normals[3], (Point3f{0, -1, 0}));
    std::uint32_t guess = OrientedPoints::no_point;
    EXPECT_EQ(index.closest_facing({1, -1, 1}, {0, 0, 1}, {.reach = 20}, guess).triangle, 0u);
    EXPECT_EQ(index.closest_facing({1, -1, 1}, {0, -1, 0}, {.reach = 20}, guess).triangle, 1u);
}

}  // namespace
}  // namespace htvm::internal
