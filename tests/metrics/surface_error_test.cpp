#include "metrics/surface_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "metrics/mesh_measures.h"
#include "metrics/shapes.h"
#include "metrics/triangle_index.h"

namespace htvm {
namespace {

Point3 on_segment(const Point3& p, const Point3& a, const Point3& b) {
    const double squared = dot(b - a, b - a);
    double s = squared > 0 ? dot(p - a, b - a) / squared : 0;
    s = s < 0 ? 0 : s > 1 ? 1 : s;
    return a + (b - a) * s;
}

// Tries every case of being nearest: the plane by its Gram matrix if the foot lies inside, and all sides.
double brute_force_squared_distance(const Mesh& mesh, const Point3& p) {
    double best = std::numeric_limits<double>::infinity();
    auto consider = [&](const Point3& q) { best = std::min(best, dot(p - q, p - q)); };
    for (const auto& t : mesh.triangles) {
        const Point3 a = to_point(mesh.positions[t[0]]), b = to_point(mesh.positions[t[1]]),
                     c = to_point(mesh.positions[t[2]]);
        consider(on_segment(p, a, b));
        consider(on_segment(p, b, c));
        consider(on_segment(p, c, a));
        const Point3 u = b - a, v = c - a;
        const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), determinant = uu * vv - uv * uv;
        if (determinant <= 1e-9 * uu * vv) continue;
        const double x = (dot(p - a, u) * vv - dot(p - a, v) * uv) / determinant;
        const double y = (dot(p - a, v) * uu - dot(p - a, u) * uv) / determinant;
        if (x >= 0 && y >= 0 && x + y <= 1) consider(a + u * x + v * y);
    }
    return best;
}

TEST(TriangleIndex, FindsTheClosestPointThatBruteForceFinds) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> coordinate(-100, 100);
    for (int round = 0; round < 40; ++round) {
        const Mesh mesh = shapes::soup(random, 1 + random() % 60, 1 + random() % 200);
        const auto index = TriangleIndex::build(mesh, {});
        ASSERT_TRUE(index.has_value());
        for (int q = 0; q < 50; ++q) {
            const Point3 p{{coordinate(random), coordinate(random), coordinate(random)}};
            const auto hint = static_cast<std::uint32_t>(random() % mesh.triangles.size());
            EXPECT_NEAR(std::sqrt(index->closest(p, hint).squared_distance),
                        std::sqrt(brute_force_squared_distance(mesh, p)), 1e-9);
        }
    }
}

TEST(TriangleIndex, IsAccurateToNanometresFarFromTheOrigin) {
    const Mesh mesh = shapes::moved(shapes::plane(100, 10, 0), 100000, 100000, 100000);
    const auto index = TriangleIndex::build(mesh, {});
    ASSERT_TRUE(index.has_value());
    const Point3 p{{100033.3, 100071.7, 100000.0001}};
    EXPECT_NEAR(std::sqrt(index->closest(p).squared_distance), 0.0001, 1e-6 * 0.0001 + 1e-10);
}

TEST(TriangleIndex, VisitsEveryTriangleThatComesNearerThanTheRadius) {
    std::mt19937 random(6);
    std::uniform_real_distribution<double> coordinate(-60, 60);
    for (int round = 0; round < 30; ++round) {
        const Mesh mesh = shapes::soup(random, 3 + random() % 40, 1 + random() % 100);
        const auto index = TriangleIndex::build(mesh, {});
        ASSERT_TRUE(index.has_value());
        const Point3 p{{coordinate(random), coordinate(random), coordinate(random)}};
        std::vector<bool> visited(mesh.triangles.size(), false);
        index->visit_near(p, 20, [&](std::uint32_t t) {
            visited[t] = true;
            return true;
        });
        for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
            Mesh one = mesh;
            one.triangles = {mesh.triangles[t]};
            EXPECT_TRUE(visited[t] || std::sqrt(brute_force_squared_distance(one, p)) >= 20);
        }
    }
}

TEST(SurfaceError, OfParallelPlanesIsTheirDistance) {
    const auto error = surface_error(shapes::plane(1000, 10, 0), shapes::plane(1000, 7, 5));
    ASSERT_TRUE(error.has_value());
    for (const auto& d : {error->forward, error->backward}) {
        EXPECT_DOUBLE_EQ(d.rms, 5);
        EXPECT_DOUBLE_EQ(d.mean, 5);
        EXPECT_DOUBLE_EQ(d.largest, 5);
    }
}

TEST(SurfaceError, OfConcentricSpheresIsTheDifferenceOfTheirRadiiWithinOnePercent) {
    SurfaceErrorOptions options;
    options.samples = 40000;  // seen from near the centre every triangle is about equally far, which is the slowest
                              // case
    const auto error = surface_error(shapes::sphere(100, 6), shapes::sphere(104, 5), options);
    ASSERT_TRUE(error.has_value());
    EXPECT_NEAR(error->forward.rms, 4, 0.04);
    EXPECT_NEAR(error->backward.rms, 4, 0.04);
    EXPECT_NEAR(error->forward.mean, 4, 0.04);
    EXPECT_NEAR(error->forward.largest, 4, 0.06);
}

TEST(SurfaceError, SlidingAlongThePlaneCostsNothingInside) {
    const auto error = surface_distances(shapes::moved(shapes::plane(100, 9, 0), 3, 3, 0), shapes::plane(200, 4, 0));
    ASSERT_TRUE(error.has_value());
    EXPECT_NEAR(error->rms, 0, 1e-6);
}

// A roof over the square: heights are uniform in 0..h over its area, so the RMS over the faces is h / sqrt 3 and the
// mean h / 2. The distance to the flat square below is the height.
TEST(SurfaceError, OverTheFacesOfARoofIsItsHeightOverRootThreeWithinOnePercent) {
    Mesh roof;
    roof.positions = {{0, 0, 0}, {50, 0, 20}, {100, 0, 0}, {0, 100, 0}, {50, 100, 20}, {100, 100, 0}};
    roof.triangles = {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}};
    SurfaceErrorOptions options;
    options.samples = 200000;
    options.vertices = options.edges = false;
    const auto d = surface_distances(roof, shapes::plane(100, 1, 0), options);
    ASSERT_TRUE(d.has_value());
    EXPECT_NEAR(d->rms, 20 / std::sqrt(3.0), 0.01 * 20 / std::sqrt(3.0));
    EXPECT_NEAR(d->mean, 10, 0.1);
    EXPECT_NEAR(d->largest, 20, 0.1);
    EXPECT_EQ(d->samples, 200000u);
}

// METRO's composition on the roof, computed by hand: vertices, edges and faces with METRO's shares.
TEST(SurfaceError, WeighsVerticesEdgesAndFacesAsMetroDoes) {
    Mesh roof;
    roof.positions = {{0, 0, 0}, {50, 0, 20}, {100, 0, 0}, {0, 100, 0}, {50, 100, 20}, {100, 100, 0}};
    roof.triangles = {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}};
    SurfaceErrorOptions options;
    options.samples = 1000000;
    const auto d = surface_distances(roof, shapes::plane(100, 1, 0), options);
    ASSERT_TRUE(d.has_value());
    const double slope = std::sqrt(50.0 * 50 + 20 * 20), across = std::sqrt(slope * slope + 100 * 100.0);
    const double per_length = std::sqrt((1000000 - 6) / (2 * slope * 100));
    const double level = 200 * per_length;                        // the eaves: height 0
    const double ridge = 100 * per_length;                        // height 20
    const double sloped = (4 * slope + 2 * across) * per_length;  // heights uniform in 0..20
    const double faces = 1000000 - 12 - level - ridge - sloped;
    const double squared = 2 * 400 + ridge * 400 + (sloped + faces) * 400 / 3;
    EXPECT_NEAR(d->rms, std::sqrt(squared / (1000000 - 6)), 0.005 * d->rms);
    EXPECT_NEAR(static_cast<double>(d->samples), 1000000 - 6, 12);
}

TEST(SurfaceError, OfAMeshWithItselfIsZero) {
    std::mt19937 random(7);
    const Mesh mesh = shapes::soup(random, 200, 400);
    const auto error = surface_error(mesh, mesh);
    ASSERT_TRUE(error.has_value());
    EXPECT_NEAR(m2(*error), 0, 1e-6);
}

TEST(SurfaceError, IsTheSameForAnyThreadCountAndChangesWithTheSeed) {
    std::mt19937 random(8);
    const Mesh a = shapes::soup(random, 300, 500), b = shapes::soup(random, 300, 500);
    SurfaceErrorOptions options;
    options.edges = false;  // on so few triangles they would take all samples
    const auto one = surface_distances(a, b, options);
    const internal::ThreadPool pool(7);
    options.threads = pool;
    const auto seven = surface_distances(a, b, options);
    options.seed = 2;
    const auto other = surface_distances(a, b, options);
    ASSERT_TRUE(one && seven && other);
    EXPECT_EQ(one->rms, seven->rms);
    EXPECT_EQ(one->mean, seven->mean);
    EXPECT_EQ(one->largest, seven->largest);
    EXPECT_NE(one->rms, other->rms);
    EXPECT_NEAR(one->rms, other->rms, 0.2 * one->rms);
}

TEST(SurfaceError, CountsTheFartherDirectionAndTheHausdorffDistance) {
    Mesh small = shapes::plane(10, 2, 0), large = shapes::plane(10, 2, 0);
    shapes::append(large, shapes::moved(shapes::plane(10, 2, 0), 0, 0, 30));
    const auto error = surface_error(small, large);
    ASSERT_TRUE(error.has_value());
    EXPECT_NEAR(error->forward.rms, 0, 1e-9);
    EXPECT_NEAR(error->backward.largest, 30, 1e-9);
    EXPECT_NEAR(m2(*error), std::sqrt(450.0), 1);
}

TEST(SurfaceError, MeasuresToAndFromVerticesWhereThereAreNoTriangles) {
    Mesh points;
    points.positions = {{50, 50, 3}, {20, 20, -4}};
    const Mesh flat = shapes::plane(100, 4, 0);
    const auto from_points = surface_distances(points, flat);
    ASSERT_TRUE(from_points.has_value());
    EXPECT_EQ(from_points->samples, 2u);
    EXPECT_DOUBLE_EQ(from_points->rms, std::sqrt((9 + 16) / 2.0));
    Mesh one_point;
    one_point.positions = {{0, 0, 0}};
    const auto to_point_only = surface_distances(flat, one_point);
    ASSERT_TRUE(to_point_only.has_value());
    EXPECT_DOUBLE_EQ(to_point_only->largest, std::sqrt(20000.0));
}

TEST(SurfaceError, FromNothingIsZeroAndToNothingInfinite) {
    const Mesh flat = shapes::plane(10, 1, 0);
    const auto error = surface_error(flat, Mesh{});
    ASSERT_TRUE(error.has_value());
    EXPECT_TRUE(std::isinf(error->forward.rms));
    EXPECT_EQ(error->backward.samples, 0u);
    EXPECT_TRUE(surface_error(Mesh{}, Mesh{}).has_value());
}

TEST(SurfaceError, SurvivesTrianglesWithoutArea) {
    Mesh line;
    line.positions = {{0, 0, 0}, {10, 0, 0}, {20, 0, 0}, {5, 5, 5}};
    line.triangles = {{0, 1, 2}, {0, 0, 0}, {1, 1, 2}};
    const auto error = surface_error(line, shapes::plane(20, 1, 2));
    ASSERT_TRUE(error.has_value());
    EXPECT_DOUBLE_EQ(error->forward.rms, 2);
    EXPECT_GT(error->backward.rms, 2);
}

TEST(SurfaceError, OfASequenceIsTheMeanOverItsFrames) {
    SurfaceErrorSums sums;
    sums += *surface_error(shapes::plane(10, 5, 0), shapes::plane(10, 5, 1));
    sums += *surface_error(shapes::plane(10, 1, 0), shapes::plane(10, 1, 4));
    EXPECT_DOUBLE_EQ(m2(sums), 2.5);
    EXPECT_DOUBLE_EQ(sequence_forward(sums).largest, 4);
    EXPECT_DOUBLE_EQ(sums.worst_frame_rms, 4);
    EXPECT_EQ(m2(SurfaceErrorSums{}), 0);
}

}  // namespace
}  // namespace htvm
