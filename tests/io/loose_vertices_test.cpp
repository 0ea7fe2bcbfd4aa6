#include "io/loose_vertices.h"

#include <gtest/gtest.h>

namespace htvm {
namespace {

TEST(LooseVertices, AreTakenOutWithTheirAttributesAndTheOthersKeepTheirOrder) {
    Mesh mesh;
    mesh.positions = {{9, 9, 9}, {1, 0, 0}, {2, 0, 0}, {9, 9, 9}, {3, 0, 0}, {9, 9, 9}};
    mesh.colours = {{9, 9, 9}, {1, 1, 1}, {2, 2, 2}, {9, 9, 9}, {3, 3, 3}, {9, 9, 9}};
    mesh.texcoords = {{9, 9}, {1, 1}, {2, 2}, {9, 9}, {3, 3}, {9, 9}};
    mesh.triangles = {{4, 1, 2}, {2, 1, 4}};
    EXPECT_EQ(drop_loose_vertices(mesh), (std::vector<std::uint32_t>{1, 2, 4})) << "where they were";
    EXPECT_EQ(mesh.positions, (std::vector<Vector3f>{{1, 0, 0}, {2, 0, 0}, {3, 0, 0}}));
    EXPECT_EQ(mesh.colours, (std::vector<Colour>{{1, 1, 1}, {2, 2, 2}, {3, 3, 3}}));
    EXPECT_EQ(mesh.texcoords, (std::vector<Vector2f>{{1, 1}, {2, 2}, {3, 3}}));
    EXPECT_TRUE(mesh.normals.empty());
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{2, 0, 1}, {1, 0, 2}}));
}

TEST(LooseVertices, AMeshWithoutTrianglesHasNothingElse) {
    Mesh mesh;
    mesh.positions = {{1, 2, 3}};
    drop_loose_vertices(mesh);
    EXPECT_TRUE(mesh.positions.empty());
}

}  // namespace
}  // namespace htvm
