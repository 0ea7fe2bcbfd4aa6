#include "metrics/mesh_facts.h"

#include <gtest/gtest.h>

namespace htvm {
namespace {

// A square of 100 mm of two triangles, that lies at x.
void add_square(Mesh& mesh, float x, float side = 100) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const auto& [u, v] : {std::pair{0.0f, 0.0f}, {side, 0.0f}, {side, side}, {0.0f, side}})
        mesh.positions.push_back({x + u, v, 0});
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
}

TEST(MeshFacts, OfASquareAreItsSizes) {
    Mesh mesh;
    add_square(mesh, 0);
    mesh.colours = {{10, 20, 30}, {10, 20, 30}, {10, 20, 30}, {10, 20, 30}};
    const auto facts = facts_of(mesh);
    EXPECT_EQ(facts.pieces, 1u);
    EXPECT_DOUBLE_EQ(facts.border, 400);
    EXPECT_DOUBLE_EQ(facts.area, 10000);
    EXPECT_DOUBLE_EQ(facts.middle[0], 50);
    EXPECT_DOUBLE_EQ(facts.light, 20);
    EXPECT_EQ(facts.high, (std::array<double, 3>{100, 100, 0}));
}

TEST(MeshFacts, SeamsAreNoBorders) {
    Mesh mesh;
    add_square(mesh, 0);
    add_square(mesh, 100);
    const auto facts = facts_of(mesh);
    EXPECT_EQ(facts.pieces, 1u);
    EXPECT_DOUBLE_EQ(facts.border, 600);
}

TEST(MeshFacts, SpecksAreSmallAndStraysAreFar) {
    Mesh mesh;
    add_square(mesh, 0, 200);
    add_square(mesh, 210, 5);
    add_square(mesh, 900);
    const auto facts = facts_of(mesh);
    EXPECT_EQ(facts.pieces, 3u);
    EXPECT_EQ(facts.specks, 1u);
    EXPECT_EQ(facts.strays, 1u);
}

TEST(MeshFacts, CountWhatShowsNothing) {
    Mesh mesh;
    add_square(mesh, 0);
    mesh.positions.push_back({0, 0, 0});
    mesh.positions.push_back({5, 5, 5});
    mesh.triangles.push_back({0, 4, 1});
    const auto facts = facts_of(mesh);
    EXPECT_EQ(facts.unused_vertices, 1u);
    EXPECT_EQ(facts.collapsed_triangles, 1u) << "two corners at one place";
    EXPECT_EQ(facts.light, -1) << "there are no colours";
}

TEST(MeshFacts, OfNothingAreZeros) {
    const auto facts = facts_of({});
    EXPECT_EQ(facts.pieces, 0u);
    EXPECT_EQ(facts.area, 0);
}

}  // namespace
}  // namespace htvm
