#include "metrics/point_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "metrics/mesh_measures.h"

namespace htvm {
namespace {

// Points on a coarse grid, so that many are equally far from a query.
Mesh random_cloud(std::mt19937& random, std::size_t count, std::size_t grid) {
    Mesh mesh;
    for (std::size_t i = 0; i < count; ++i) {
        Vector3f p;
        for (float& c : p) c = static_cast<float>(random() % grid) * 0.5f;
        mesh.positions.push_back(p);
        mesh.colours.push_back({static_cast<std::uint8_t>(random()), static_cast<std::uint8_t>(random()),
                                static_cast<std::uint8_t>(random())});
    }
    return mesh;
}

std::vector<std::uint32_t> nearest_by_brute_force(const Mesh& from, const Mesh& to) {
    std::vector<std::uint32_t> nearest;
    for (const auto& p : from.positions) {
        double best = std::numeric_limits<double>::infinity();
        std::uint32_t index = 0;
        for (std::uint32_t i = 0; i < to.positions.size(); ++i) {
            const Point3 d = to_point(p) - to_point(to.positions[i]);
            if (dot(d, d) < best) best = dot(d, d), index = i;
        }
        nearest.push_back(index);
    }
    return nearest;
}

TEST(NearestVertices, EqualBruteForceWithTiesToTheLowestIndexForAnyThreadCount) {
    std::mt19937 random(1);
    for (int round = 0; round < 60; ++round) {
        const Mesh from = random_cloud(random, 1 + random() % 400, 1 + random() % 30);
        const Mesh to = random_cloud(random, 1 + random() % 400, 1 + random() % 30);
        const auto expected = nearest_by_brute_force(from, to);
        EXPECT_EQ(nearest_vertices(from.positions, to.positions, {}), expected);
        EXPECT_EQ(nearest_vertices(from.positions, to.positions, internal::ThreadPool(5)), expected);
    }
}

TEST(NearestVertices, ManyEqualPointsAnswerTheFirst) {
    const std::vector<Vector3f> same(5000, Vector3f{1, 2, 3});
    const std::vector<Vector3f> query{{0, 0, 0}};
    EXPECT_EQ(nearest_vertices(query, same), std::vector<std::uint32_t>{0});
}

TEST(PointError, EqualsTheSumsOfEquation9ByBruteForce) {
    std::mt19937 random(2);
    for (int round = 0; round < 30; ++round) {
        const Mesh from = random_cloud(random, 1 + random() % 300, 200);
        const Mesh to = random_cloud(random, 1 + random() % 300, 200);
        const auto nearest = nearest_by_brute_force(from, to);
        double distance = 0, colour = 0;
        for (std::size_t v = 0; v < nearest.size(); ++v) {
            for (std::size_t c = 0; c < 3; ++c) {
                distance += std::pow(double{from.positions[v][c]} - to.positions[nearest[v]][c], 2);
                colour += std::pow(double(from.colours[v][c]) - to.colours[nearest[v]][c], 2);
            }
        }
        const PointErrorSums sums = point_error(from, to).forward;
        EXPECT_EQ(sums.vertices, from.positions.size());
        EXPECT_DOUBLE_EQ(sums.squared_distance, distance);
        EXPECT_DOUBLE_EQ(sums.squared_colour, colour);
    }
}

TEST(PointError, OfAMeshWithItselfIsZero) {
    std::mt19937 random(3);
    Mesh mesh = random_cloud(random, 500, 100000);
    const PointError error = point_error(mesh, mesh);
    EXPECT_EQ(m1_geometry(error), 0);
    EXPECT_EQ(m1_colour(error), 0);
}

TEST(PointError, OfASmallShiftIsTheShift) {
    Mesh original, shifted;
    for (int i = 0; i < 100; ++i) {
        original.positions.push_back({static_cast<float>(10 * (i % 10)), static_cast<float>(10 * (i / 10)), 0});
        shifted.positions.push_back(original.positions.back());
        shifted.positions.back()[2] = 2;
    }
    const PointError error = point_error(original, shifted);
    EXPECT_DOUBLE_EQ(rms_distance(error.forward), 2);
    EXPECT_DOUBLE_EQ(rms_distance(error.backward), 2);
    EXPECT_DOUBLE_EQ(error.forward.largest_distance, 2);
}

TEST(PointError, OfARecolouredMeshIsTheLengthOfTheColourDifference) {
    Mesh original;
    original.positions = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}};
    original.colours.assign(3, {10, 20, 30});
    Mesh recoloured = original;
    recoloured.colours.assign(3, {13, 24, 30});
    const PointError error = point_error(original, recoloured);
    EXPECT_EQ(m1_geometry(error), 0);
    EXPECT_DOUBLE_EQ(m1_colour(error), 5);
}

TEST(PointError, ComparesTheColourOfTheVertexNearestInGeometry) {
    Mesh a, b;
    a.positions = {{0, 0, 0}};
    a.colours = {{100, 0, 0}};
    b.positions = {{1, 0, 0}, {2, 0, 0}};
    b.colours = {{0, 0, 0}, {100, 0, 0}};
    EXPECT_DOUBLE_EQ(rms_colour(point_error(a, b).forward), 100);
}

TEST(PointError, OfASequenceWeighsEveryVertexOfEveryFrameAlike) {
    Mesh one, one_moved, three, three_moved;
    one.positions = {{0, 0, 0}};
    one_moved.positions = {{4, 0, 0}};
    three.positions = {{0, 0, 0}, {100, 0, 0}, {200, 0, 0}};
    three_moved.positions = three.positions;
    PointError sums;
    sums += point_error(one, one_moved);
    sums += point_error(three, three_moved);
    EXPECT_DOUBLE_EQ(m1_geometry(sums), 2);  // sqrt(16 / 4)
}

TEST(PointError, TheLargerDirectionCounts) {
    Mesh a, b;
    a.positions = {{0, 0, 0}};
    b.positions = {{0, 0, 0}, {8, 0, 0}};
    const PointError error = point_error(a, b);
    EXPECT_EQ(rms_distance(error.forward), 0);
    EXPECT_DOUBLE_EQ(m1_geometry(error), std::sqrt(32.0));
}

TEST(PointError, ToAMeshWithoutVerticesIsInfiniteAndFromItNothing) {
    Mesh a, nothing;
    a.positions = {{0, 0, 0}};
    const PointError error = point_error(a, nothing);
    EXPECT_TRUE(std::isinf(rms_distance(error.forward)));
    EXPECT_EQ(error.backward.vertices, 0u);
    EXPECT_TRUE(std::isinf(m1_geometry(error)));
    EXPECT_EQ(m1_geometry(point_error(nothing, nothing)), 0);
}

TEST(PointError, ColourIsLeftOutWhereOneMeshHasNone) {
    Mesh a, b;
    a.positions = b.positions = {{0, 0, 0}};
    a.colours = {{1, 2, 3}};
    EXPECT_EQ(point_error(a, b).forward.colour_vertices, 0u);
}

TEST(CheckMeasurable, RefusesNotANumberAndIndicesOutOfRange) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}};
    EXPECT_TRUE(check_measurable(mesh, "original").has_value());
    Mesh bad = mesh;
    bad.positions[1][2] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_FALSE(check_measurable(bad, "original").has_value());
    bad = mesh;
    bad.triangles[0][2] = 3;
    EXPECT_FALSE(check_measurable(bad, "original").has_value());
    bad = mesh;
    bad.colours.resize(2);
    EXPECT_FALSE(check_measurable(bad, "original").has_value());
}

}  // namespace
}  // namespace htvm
