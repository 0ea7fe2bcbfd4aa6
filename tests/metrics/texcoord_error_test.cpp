#include "metrics/texcoord_error.h"

#include <gtest/gtest.h>

namespace htvm {
namespace {

// A square of 100 mm, cut into cells, with its place in it as texture coordinates.
Mesh square(int cells) {
    Mesh mesh;
    for (int row = 0; row <= cells; ++row)
        for (int column = 0; column <= cells; ++column) {
            const float s = float(column) / float(cells), t = float(row) / float(cells);
            mesh.positions.push_back({100 * s, 100 * t, 0});
            mesh.texcoords.push_back({s, t});
        }
    const auto at = [&](int row, int column) { return static_cast<std::uint32_t>(row * (cells + 1) + column); };
    for (int row = 0; row < cells; ++row)
        for (int column = 0; column < cells; ++column) {
            mesh.triangles.push_back({at(row, column), at(row, column + 1), at(row + 1, column)});
            mesh.triangles.push_back({at(row, column + 1), at(row + 1, column + 1), at(row + 1, column)});
        }
    return mesh;
}

TEST(TexcoordError, IsNoneWhereTheSurfaceHasTheSameWhateverItsVertices) {
    const auto error = texcoord_error(square(10), square(7));
    ASSERT_TRUE(error);
    EXPECT_NEAR(error->area, 10000, 1);
    EXPECT_NEAR(rms_texcoord(*error), 0, 1e-6);
    EXPECT_EQ(share_elsewhere(*error), 0);
}

TEST(TexcoordError, IsHowFarTheyAreOff) {
    auto moved = square(10);
    for (auto& t : moved.texcoords) t[0] += 0.02f;
    const auto error = texcoord_error(square(10), moved);
    EXPECT_NEAR(rms_texcoord(*error), 0.02, 1e-6);
    EXPECT_EQ(share_elsewhere(*error), 0);
}

TEST(TexcoordError, CountsByItselfWhatLiesElsewhereInTheAtlas) {
    auto relaid = square(10);
    for (std::size_t v = 0; v < relaid.texcoords.size(); ++v)
        if (relaid.positions[v][1] > 49) relaid.texcoords[v][1] += 5;
    const auto error = texcoord_error(square(10), relaid);
    EXPECT_NEAR(share_elsewhere(*error), 0.6, 0.01) << "half of it, and the row of cells between the halves";
    EXPECT_NEAR(rms_texcoord(*error), 0, 1e-6);
}

TEST(TexcoordError, IsNotMeasuredUnlessBothHaveSome) {
    auto bare = square(3);
    bare.texcoords.clear();
    EXPECT_EQ(texcoord_error(bare, square(3))->area, 0);
    EXPECT_EQ(texcoord_error(square(3), bare)->area, 0);
}

}  // namespace
}  // namespace htvm
