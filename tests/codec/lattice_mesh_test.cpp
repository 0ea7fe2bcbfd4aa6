#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/lattice.h"

namespace htvm::internal {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
const float not_a_number = std::nanf("");

Mesh triangle() {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {100, 0, 0}, {0, 100, 0}};
    mesh.triangles = {{0, 1, 2}};
    return mesh;
}

void expect_bad(const Mesh& mesh, const char* what) {
    const auto out = to_lattice(mesh, Lattice{});
    ASSERT_FALSE(out.has_value());
    EXPECT_EQ(out.error().kind, ErrorKind::bad_input);
    EXPECT_NE(out.error().message.find(what), std::string::npos) << out.error().message;
}

TEST(LatticeMesh, PositionsRoundToTheNearestPoint) {
    Mesh mesh;
    mesh.positions = {{10, 20, 30}, {10.03f, 19.97f, 30.04f}, {9, 21, 30.5f}};
    const auto out = to_lattice(mesh, {.origin = {10, 20, 30}, .bits = 4});
    ASSERT_TRUE(out.has_value());
    EXPECT_EQ(out->positions, (std::vector<LatticePoint>{{0, 0, 0}, {0, 0, 1}, {-16, 16, 8}}));
}

TEST(LatticeMesh, PositionsAreOffByHalfAStepAtMost) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> coordinate(-100, 100);
    for (const int bits : {0, 1, 4, 10, 16}) {
        Mesh mesh;
        for (int i = 0; i < 500; ++i)
            mesh.positions.push_back({coordinate(random), coordinate(random), coordinate(random)});
        const Lattice lattice{.origin = {3, -4, 5}, .bits = bits};
        const auto out = to_lattice(mesh, lattice);
        ASSERT_TRUE(out.has_value());
        for (std::size_t k = 0; k < mesh.positions.size(); ++k) {
            const auto back = to_millimetres(out->positions[k], lattice);
            for (std::size_t axis = 0; axis < 3; ++axis)
                EXPECT_LE(std::abs(back[axis] - mesh.positions[k][axis]), lattice.step() / 2);
        }
    }
}

TEST(LatticeMesh, OfAMeshOnTheLatticeIsExactBothWays) {
    std::mt19937 random(2);
    LatticeMesh mesh;
    for (int i = 0; i < 1000; ++i) {
        const auto c = [&] { return static_cast<std::int32_t>(random() % (1 << 20)) - (1 << 19); };
        mesh.positions.push_back({c(), c(), c()});
        mesh.colours.push_back({static_cast<std::uint8_t>(random()), 0, 255});
        const auto t = [&] { return static_cast<std::int32_t>(random() % (1 << 23)) - (1 << 22); };
        mesh.texcoords.push_back({t(), t()});
    }
    mesh.triangles = {{0, 1, 2}, {7, 7, 999}};
    const Lattice lattice{.origin = {-5, 60, 7}, .bits = 4};
    const auto back = to_lattice(to_mesh(mesh, lattice), lattice);
    ASSERT_TRUE(back.has_value());
    EXPECT_EQ(back->positions, mesh.positions);
    EXPECT_EQ(back->triangles, mesh.triangles);
    EXPECT_EQ(back->colours, mesh.colours);
    EXPECT_EQ(back->texcoords, mesh.texcoords);
}

TEST(LatticeMesh, NormalsComeBackAsUnitVectorsWithinHalfADegree) {
    std::mt19937 random(3);
    std::normal_distribution<float> normal;
    Mesh mesh;
    for (int i = 0; i < 1000; ++i) {
        Vector3f n = {normal(random), normal(random), normal(random)};
        const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (auto& c : n) c /= length;
        mesh.positions.push_back({0, 0, 0});
        mesh.normals.push_back(n);
    }
    const auto back = to_mesh(*to_lattice(mesh, {}), {});
    for (std::size_t k = 0; k < mesh.normals.size(); ++k) {
        const auto &a = mesh.normals[k], &b = back.normals[k];
        EXPECT_NEAR(std::sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]), 1, 1e-6);
        EXPECT_GT(a[0] * b[0] + a[1] * b[1] + a[2] * b[2], std::cos(0.5 * 3.14159265 / 180));
    }
}

TEST(LatticeMesh, AZeroNormalStaysZero) {
    Mesh mesh = triangle();
    mesh.normals = {{0, 0, 0}, {0, 0, 1}, {0, 0, 0.001f}};
    const auto back = to_mesh(*to_lattice(mesh, {}), {});
    EXPECT_EQ(back.normals, (std::vector<Vector3f>{{0, 0, 0}, {0, 0, 1}, {0, 0, 0}}));
}

TEST(LatticeMesh, NothingIsLegal) {
    EXPECT_TRUE(to_lattice(Mesh{}, {})->positions.empty());
    EXPECT_EQ(*lattice_origin(Mesh{}), (std::array<std::int32_t, 3>{0, 0, 0}));
}

TEST(LatticeMesh, OriginIsTheMiddleOfTheBoundingBox) {
    Mesh mesh;
    mesh.positions = {{-10, 0, 5}, {30, 1, 5}, {0, 3, 5}};
    EXPECT_EQ(*lattice_origin(mesh), (std::array<std::int32_t, 3>{10, 2, 5}));
}

TEST(LatticeMesh, EveryWrongNumberIsNamed) {
    for (const float wrong : {not_a_number, infinity, -infinity, 1e30f}) {
        auto mesh = triangle();
        mesh.positions[2][1] = wrong;
        expect_bad(mesh, "vertex 2");
        mesh = triangle();
        mesh.normals = {{0, 0, 1}, {0, wrong, 1}, {0, 0, 1}};
        expect_bad(mesh, "vertex 1 has a normal");
        mesh = triangle();
        mesh.texcoords = {{0, 0}, {0, 0}, {0, wrong}};
        expect_bad(mesh, "vertex 2 has a texture coordinate");
    }
    auto mesh = triangle();
    mesh.triangles.push_back({0, 3, 1});
    expect_bad(mesh, "triangle 1 names vertex 3 of 3");
    mesh = triangle();
    mesh.colours.resize(2);
    expect_bad(mesh, "3 vertices but 2 colours");
    mesh = triangle();
    mesh.normals.resize(4);
    expect_bad(mesh, "3 vertices but 4 normals");
    mesh = triangle();
    mesh.texcoords.resize(1);
    expect_bad(mesh, "3 vertices but 1 texture coordinates");
    mesh = Mesh{};
    mesh.triangles = {{0, 0, 0}};
    expect_bad(mesh, "triangle 0 names vertex 0 of 0");
}

TEST(LatticeMesh, AnOriginThatCannotBeIsRefused) {
    for (const float wrong : {not_a_number, infinity, 1e12f}) {
        Mesh mesh;
        mesh.positions = {{wrong, 0, 0}};
        ASSERT_FALSE(lattice_origin(mesh).has_value());
        EXPECT_EQ(lattice_origin(mesh).error().kind, ErrorKind::bad_input);
    }
}

TEST(LatticeMesh, TheFarthestPointIsHalfTheLatticeAway) {
    const Lattice lattice{.origin = {0, 0, 0}, .bits = 4};
    const double farthest = lattice_limit / 2 / 16.0;
    EXPECT_TRUE(to_lattice(std::array<double, 3>{farthest - 0.01, 0, -farthest + 0.01}, lattice).has_value());
    EXPECT_FALSE(to_lattice(std::array<double, 3>{farthest, 0, 0}, lattice).has_value());
}

}  // namespace
}  // namespace htvm::internal
