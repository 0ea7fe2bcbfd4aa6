// Where a captured surface ends.
#include "surface/open_border.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace htvm::internal {
namespace {

struct Surface {
    std::vector<Vector3f> positions;
    std::vector<Triangle> triangles;
};

constexpr std::uint32_t side = 9;

Surface grid() {
    Surface out;
    for (std::uint32_t y = 0; y < side; ++y)
        for (std::uint32_t x = 0; x < side; ++x)
            out.positions.push_back({static_cast<float>(x), static_cast<float>(y), 0});
    for (std::uint32_t y = 0; y + 1 < side; ++y)
        for (std::uint32_t x = 0; x + 1 < side; ++x) {
            const std::uint32_t v = y * side + x;
            out.triangles.push_back({v, v + 1, v + side});
            out.triangles.push_back({v + 1, v + side + 1, v + side});
        }
    return out;
}

Surface tetrahedron() {
    return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
}

// The same surface, of which each triangle has vertices of its own.
Surface in_pieces(const Surface& surface) {
    Surface out;
    for (const auto& t : surface.triangles) {
        const auto first = static_cast<std::uint32_t>(out.positions.size());
        for (const auto v : t) out.positions.push_back(surface.positions[v]);
        out.triangles.push_back({first, first + 1, first + 2});
    }
    return out;
}

bool all_far(const std::vector<std::uint8_t>& edges) {
    return std::ranges::all_of(edges, [](auto e) { return e == far_from_border; });
}

TEST(OpenBorder, EdgesToItAreCountedUpToThree) {
    const auto surface = grid();
    const auto edges = edges_from_border(surface.positions, surface.triangles);
    for (std::uint32_t y = 0; y < side; ++y)
        for (std::uint32_t x = 0; x < side; ++x)
            EXPECT_EQ(edges[y * side + x], std::min({x, y, side - 1 - x, side - 1 - y, std::uint32_t{far_from_border}}))
                << x << ", " << y;
}

TEST(OpenBorder, AClosedSurfaceHasNone) {
    const auto surface = tetrahedron();
    EXPECT_TRUE(all_far(edges_from_border(surface.positions, surface.triangles)));
    EXPECT_EQ(share_on_border(surface.positions, surface.triangles), 0);
}

TEST(OpenBorder, SeamsAreNone) {
    auto surface = in_pieces(tetrahedron());
    for (std::size_t v = 0; v < surface.positions.size(); v += 2)
        for (auto& c : surface.positions[v]) c = c == 0 ? -0.0F : c;  // the same place
    EXPECT_TRUE(all_far(edges_from_border(surface.positions, surface.triangles)));
    EXPECT_EQ(share_on_border(surface.positions, surface.triangles), 0);
}

TEST(OpenBorder, IsAroundAMissingTriangle) {
    auto surface = grid();
    const std::uint32_t v = 4 * side + 4;
    std::erase(surface.triangles, Triangle{v, v + 1, v + side});
    const auto edges = edges_from_border(surface.positions, surface.triangles);
    for (const auto u : {v, v + 1, v + side}) EXPECT_EQ(edges[u], 0);
    EXPECT_EQ(edges[v - side], 1);
}

TEST(OpenBorder, IsNotWhereTrianglesFaceAgainstEachOtherNorWhereTheyAreThereTwice) {
    const auto surface = grid();
    auto turned = surface, doubled = surface;
    const std::uint32_t v = 4 * side + 4;
    std::ranges::replace(turned.triangles, Triangle{v, v + 1, v + side}, Triangle{v, v + side, v + 1});
    for (const auto& t : surface.triangles) doubled.triangles.push_back({t[0], t[2], t[1]});
    EXPECT_EQ(edges_from_border(turned.positions, turned.triangles),
              edges_from_border(surface.positions, surface.triangles));
    EXPECT_TRUE(all_far(edges_from_border(doubled.positions, doubled.triangles)));
}

TEST(OpenBorder, TheShareOnItIsOfTheVerticesThatTrianglesName) {
    auto surface = grid();
    surface.positions.insert(surface.positions.end(), 100, {50, 50, 50});
    EXPECT_DOUBLE_EQ(share_on_border(surface.positions, surface.triangles), 32.0 / 81);
    EXPECT_EQ(share_on_border(surface.positions, {}), 0);
    EXPECT_EQ(edges_from_border(surface.positions, surface.triangles).back(), far_from_border);
}

// So many closed pieces of one size, one beside the other, after a large one.
Surface pieces(std::size_t number, float size) {
    Surface out;
    for (std::size_t i = 0; i <= number; ++i) {
        const auto first = static_cast<std::uint32_t>(out.positions.size());
        const auto one = tetrahedron();
        for (auto p : one.positions) {
            for (auto& c : p) c *= i == 0 ? 1000 : size;
            p[0] += 2000 * static_cast<float>(i);
            out.positions.push_back(p);
        }
        for (const auto& t : one.triangles) out.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
    return out;
}

bool comes_and_goes(const Surface& surface) { return internal::comes_and_goes(surface.positions, surface.triangles); }

TEST(OpenBorder, SurfaceComesAndGoesWhereItHasBordersOrIsInPieces) {
    EXPECT_TRUE(comes_and_goes(grid()));
    EXPECT_FALSE(comes_and_goes(tetrahedron()));
    EXPECT_FALSE(comes_and_goes(pieces(3, 500))) << "a person, another one, a chair, a ball";
    EXPECT_TRUE(comes_and_goes(pieces(4, 500))) << "a person in closed pieces";
    EXPECT_FALSE(comes_and_goes(pieces(20, 20))) << "specks do not count";
    EXPECT_FALSE(comes_and_goes(Surface{}));
}

TEST(OpenBorder, OfAMeshThatNamesVerticesThatDoNotExistNothingIsTold) {
    auto surface = grid();
    EXPECT_TRUE(comes_and_goes(surface));
    surface.triangles.push_back({0, 1, side * side});
    EXPECT_FALSE(comes_and_goes(surface));
}

}  // namespace
}  // namespace htvm::internal
