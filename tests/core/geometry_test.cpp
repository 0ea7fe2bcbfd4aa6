#include "core/geometry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace htvm::internal {
namespace {

Vector3d at(const TrianglePoint& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    return point_at(p.shares, a, b, c);
}

TEST(ClosestOnTriangle, IsOnTheFaceASideOrACorner) {
    const Vector3d a{0, 0, 0}, b{4, 0, 0}, c{0, 4, 0};
    const auto shares = [&](const Vector3d& p) { return closest_on_triangle(p, a, b, c).shares; };
    EXPECT_EQ(shares({1, 1, 5}), (Vector3d{0.5, 0.25, 0.25}));
    EXPECT_EQ(shares({2, -3, 1}), (Vector3d{0.5, 0.5, 0}));
    EXPECT_EQ(shares({-1, -1, 0}), (Vector3d{1, 0, 0}));
    EXPECT_EQ(shares({9, -1, 0}), (Vector3d{0, 1, 0}));
    EXPECT_EQ(shares({4, 4, 0}), (Vector3d{0, 0.5, 0.5}));
    EXPECT_EQ(closest_on_triangle({1, 1, 5}, a, b, c).squared_distance, 25);
    EXPECT_EQ(closest_on_triangle({2, -3, 1}, a, b, c).squared_distance, 10);
}

TEST(ClosestOnTriangle, OfALineOrAPointIsOnIt) {
    const Vector3d a{0, 0, 0}, b{4, 0, 0}, c{2, 0, 0}, p{3, 5, 0};
    EXPECT_EQ(at(closest_on_triangle(p, a, b, c), a, b, c), (Vector3d{3, 0, 0}));
    EXPECT_EQ(at(closest_on_triangle(p, a, a, b), a, a, b), (Vector3d{3, 0, 0}));
    EXPECT_EQ(at(closest_on_triangle(p, b, b, b), b, b, b), b);
}

TEST(ClosestOnTriangle, IsNearerThanAnySampleOfRandomTriangles) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> spread(-10, 10), part(0, 1);
    for (int i = 0; i < 2000; ++i) {
        const auto point = [&] { return Vector3d{spread(random), spread(random), spread(random)}; };
        const Vector3d a = point(), b = point(), query = point();
        const Vector3d c = i % 3 == 0 ? a * 0.4 + b * 0.6 + point() * 1e-9 : point();  // or a sliver
        const auto found = closest_on_triangle(query, a, b, c);
        EXPECT_NEAR(found.shares[0] + found.shares[1] + found.shares[2], 1, 1e-12);
        for (const double x : found.shares) EXPECT_TRUE(x >= 0 && x <= 1) << x;
        const Vector3d apart = at(found, a, b, c) - query;
        EXPECT_NEAR(dot(apart, apart), found.squared_distance, 1e-6);
        for (int k = 0; k < 30; ++k) {
            const double u = part(random), v = part(random) * (1 - u);
            const Vector3d other = point_at({u, v, 1 - u - v}, a, b, c) - query;
            EXPECT_LE(found.squared_distance, dot(other, other) + 1e-6);
        }
    }
}

// The hub of four triangles is at the origin; one of them folds up, and is twice as large.
const std::vector<LatticePoint> hub = {{0, 0, 0}, {3, 0, 0}, {0, 3, 0}, {-3, 0, 0}, {0, 0, 6}};
const std::vector<Triangle> around_hub = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}};

TEST(VertexNormals, AreTheMeanOfTheTrianglesByArea) {
    const auto normals = vertex_normals(hub, around_hub);  // area vectors 9 z, 9 z, 18 y
    const double half = 18 / std::sqrt(18.0 * 18 + 18 * 18);
    EXPECT_EQ(normals[0], (Vector3d{0, half, half}));
    EXPECT_EQ(normals[1], (Vector3d{0, 0, 1}));
    EXPECT_EQ(normals[4], (Vector3d{0, 1, 0}));
}

TEST(VertexNormals, AreZeroWithoutAnArea) {
    EXPECT_EQ(vertex_normals(hub, {}), (std::vector<Vector3d>(5, Vector3d{})));
    const std::vector<Triangle> line = {{1, 0, 3}};
    EXPECT_EQ(vertex_normals(hub, line)[0], (Vector3d{0, 0, 0}));
}

TEST(VertexNormals, OfFloatsAndOfLatticePointsAreTheSame) {
    std::vector<Vector3f> floats;
    for (const auto p : hub) floats.push_back(to_floats(to_vector(p)));
    EXPECT_EQ(vertex_normals(floats, around_hub), vertex_normals(hub, around_hub));
}

TEST(MeanEdge, IsOfEveryTrianglesThreeSides) {
    const std::vector<LatticePoint> p = {{0, 0, 0}, {3, 0, 0}, {0, 4, 0}, {0, 0, 0}};
    const std::vector<Triangle> triangles = {{0, 1, 2}, {0, 0, 3}};
    EXPECT_EQ(mean_edge(p, triangles), 2);
    EXPECT_EQ(mean_edge(p, triangles, 2), 4);  // only the first
    EXPECT_EQ(mean_edge(p, {}), 0);
}

TEST(TrianglesAround, AreListedByVertex) {
    const auto around = triangles_around(5, around_hub);
    const auto of = [&](std::size_t v) { return std::vector(around.of(v).begin(), around.of(v).end()); };
    EXPECT_EQ(of(0), (std::vector<std::uint32_t>{0, 1, 2}));
    EXPECT_EQ(of(3), (std::vector<std::uint32_t>{1, 2}));
    EXPECT_EQ(of(4), (std::vector<std::uint32_t>{2}));
}

TEST(VerticesAround, AreListedOnceInTheOrderOfTheTriangles) {
    const std::vector<Triangle> triangles = {{0, 2, 1}, {0, 1, 3}, {3, 3, 1}, {2, 1, 0}, {5, 5, 5}};
    const auto around = vertices_around(6, triangles);
    const auto of = [&](std::size_t v) { return std::vector(around.of(v).begin(), around.of(v).end()); };
    EXPECT_EQ(of(0), (std::vector<std::uint32_t>{2, 1, 3}));
    EXPECT_EQ(of(1), (std::vector<std::uint32_t>{0, 2, 3}));
    EXPECT_EQ(of(2), (std::vector<std::uint32_t>{0, 1}));
    EXPECT_EQ(of(3), (std::vector<std::uint32_t>{0, 1}));
    EXPECT_EQ(of(4), (std::vector<std::uint32_t>{}));
    EXPECT_EQ(of(5), (std::vector<std::uint32_t>{}));
    EXPECT_EQ(vertices_around(0, {}).first, (std::vector<std::uint32_t>{0}));
}

}  // namespace
}  // namespace htvm::internal
