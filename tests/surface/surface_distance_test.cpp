#include "surface/surface_distance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "metrics/shapes.h"

namespace htvm::internal {
namespace {

SurfaceView view(const Mesh& mesh) { return {mesh.positions, mesh.triangles, mesh.colours}; }

Mesh painted(Mesh mesh, Colour colour) {
    mesh.colours.assign(mesh.positions.size(), colour);
    return mesh;
}

constexpr double infinity = std::numeric_limits<double>::infinity();

TEST(SurfaceErrors, ParallelPlanesAreTheirDistanceApart) {
    const auto errors = surface_errors(view(shapes::plane(100, 10, 0)), view(shapes::plane(100, 13, 3)));
    EXPECT_NEAR(errors.geometry_rms, 3, 1e-5);
    EXPECT_EQ(errors.colour_rms, 0);
}

TEST(SurfaceErrors, ConcentricSpheresAreTheDifferenceOfTheirRadiiApart) {
    const auto errors = surface_errors(view(shapes::sphere(100, 5)), view(shapes::sphere(102, 5)));
    EXPECT_NEAR(errors.geometry_rms, 2, 0.03);
}

TEST(SurfaceErrors, AreTheLargerDirections) {
    Mesh two = shapes::plane(100, 10, 0);
    shapes::append(two, shapes::plane(100, 10, 8));
    EXPECT_NEAR(surface_errors(view(two), view(shapes::plane(100, 10, 0))).geometry_rms, std::sqrt(32), 1e-4);
}

TEST(SurfaceErrors, ColourIsTheLengthOfTheDifference) {
    const Mesh a = painted(shapes::plane(100, 10, 0), {100, 100, 100});
    const Mesh b = painted(shapes::plane(100, 13, 0), {103, 100, 104});
    EXPECT_NEAR(surface_errors(view(a), view(b)).colour_rms, 5, 1e-4);
    EXPECT_EQ(surface_errors(view(a), view(shapes::plane(100, 13, 0))).colour_rms, 0);
}

TEST(SurfaceErrors, ColoursAreInterpolatedAtTheClosestPoint) {
    Mesh fine = shapes::plane(100, 20, 0), coarse = shapes::plane(100, 2, 0);
    for (auto* mesh : {&fine, &coarse})
        for (const auto& p : mesh->positions)
            mesh->colours.push_back({static_cast<std::uint8_t>(2 * p[0]), 0, static_cast<std::uint8_t>(p[1])});
    EXPECT_NEAR(surface_errors(view(fine), view(coarse)).colour_rms, 0, 1e-3);
}

TEST(SurfaceErrors, OfEmptyMeshes) {
    const Mesh none, plane = shapes::plane(10, 2, 0);
    EXPECT_EQ(surface_errors(view(none), view(none)).geometry_rms, 0);
    EXPECT_EQ(surface_errors(view(none), view(plane)).geometry_rms, infinity);
    EXPECT_EQ(surface_errors(view(plane), view(none)).geometry_rms, infinity);
}

TEST(SurfaceErrors, MeshesWithoutTrianglesAreTheirVertices) {
    Mesh a, b;
    a.positions = {{0, 0, 0}, {10, 0, 0}};
    b.positions = {{0, 0, 1}, {10, 0, 7}};
    EXPECT_FLOAT_EQ(static_cast<float>(surface_errors(view(a), view(b)).geometry_rms), 5);
    b = shapes::plane(10, 2, 4);
    EXPECT_NEAR(one_sided_errors(view(a), view(b), {b.positions, b.triangles}).squared_distance, 16, 1e-4);
    a.triangles = {{0, 1, 1}};  // without area
    EXPECT_NEAR(one_sided_errors(view(a), view(b), {b.positions, b.triangles}).squared_distance, 16, 1e-4);
}

TEST(SurfaceErrors, AreTheSameForAnyNumberOfThreads) {
    std::mt19937 random(3);
    const Mesh a = shapes::soup(random, 3000, 5000), b = shapes::soup(random, 3000, 5000);
    const auto one = surface_errors(view(a), view(b), {});
    const auto three = surface_errors(view(a), view(b), {.threads = ThreadPool(3)});
    EXPECT_EQ(one.geometry_rms, three.geometry_rms);
    EXPECT_EQ(one.colour_rms, three.colour_rms);
    EXPECT_TRUE(std::isfinite(one.geometry_rms));
}

TEST(SurfaceErrors, EveryNthSampleSaysAboutTheSame) {
    const Mesh a = shapes::sphere(100, 5), b = shapes::moved(shapes::sphere(100, 5), 1, 0, 0);
    const double all = surface_errors(view(a), view(b)).geometry_rms;
    EXPECT_NEAR(surface_errors(view(a), view(b), {.every = 5}).geometry_rms, all, 0.05 * all);
}

}  // namespace
}  // namespace htvm::internal
