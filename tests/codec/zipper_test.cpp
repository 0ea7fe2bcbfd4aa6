#include "codec/bones/zipper.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "codec/random_numbers.h"

namespace htvm::internal {
namespace {

constexpr double pi = 3.14159265358979;

// A tube of `rows` rings with `around` vertices each, radius 1000, from z = low to z = high, open at both ends. turned:
// the fraction of a step by which the vertices are turned.
LatticeMesh tube(int around, int rows, double low, double high, double turned = 0) {
    LatticeMesh mesh;
    for (int row = 0; row <= rows; ++row)
        for (int k = 0; k < around; ++k) {
            const double angle = 2 * pi * (k + turned + 0.5 * (row % 2)) / around;
            mesh.positions.push_back({static_cast<std::int32_t>(std::lround(1000 * std::cos(angle))),
                                      static_cast<std::int32_t>(std::lround(1000 * std::sin(angle))),
                                      static_cast<std::int32_t>(std::lround(low + (high - low) * row / rows))});
        }
    const auto at = [&](int row, int k) { return static_cast<std::uint32_t>(row * around + k % around); };
    for (int row = 0; row < rows; ++row)
        for (int k = 0; k < around; ++k) {
            const int left = row % 2 == 0 ? k : k + 1;  // the vertex above, to the left
            if (row % 2 == 0) {
                mesh.triangles.push_back({at(row, k), at(row, k + 1), at(row + 1, left)});
                mesh.triangles.push_back({at(row, k + 1), at(row + 1, k + 1), at(row + 1, k)});
            } else {
                mesh.triangles.push_back({at(row, k), at(row, k + 1), at(row + 1, left)});
                mesh.triangles.push_back({at(row, k), at(row + 1, k + 1), at(row + 1, k)});
            }
        }
    return mesh;
}

// A tube whose ends are drawn together, so that it is closed.
LatticeMesh capsule(int around, int rows, double low, double high, double turned = 0) {
    LatticeMesh mesh = tube(around, rows, low, high, turned);
    for (const bool top : {false, true}) {
        const auto apex = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.positions.push_back({0, 0, static_cast<std::int32_t>(top ? high + 300 : low - 300)});
        for (int k = 0; k < around; ++k) {
            const auto first = static_cast<std::uint32_t>(top ? rows * around : 0);
            const auto a = first + static_cast<std::uint32_t>(k),
                       b = first + static_cast<std::uint32_t>((k + 1) % around);
            mesh.triangles.push_back(top ? Triangle{a, b, apex} : Triangle{b, a, apex});
        }
    }
    return mesh;
}

// The triangles with a vertex above the height, and their vertices.
LatticeMesh above(const LatticeMesh& mesh, std::int32_t height) {
    LatticeMesh out;
    std::map<std::uint32_t, std::uint32_t> number;
    for (const Triangle& t : mesh.triangles) {
        if (std::none_of(t.begin(), t.end(), [&](std::uint32_t v) { return mesh.positions[v].z > height; })) continue;
        Triangle moved{};
        for (std::size_t i = 0; i < 3; ++i) {
            const auto [at, is_new] = number.emplace(t[i], static_cast<std::uint32_t>(out.positions.size()));
            if (is_new) out.positions.push_back(mesh.positions[t[i]]);
            moved[i] = at->second;
        }
        out.triangles.push_back(moved);
    }
    return out;
}

std::vector<std::uint8_t> still_below(const LatticeMesh& mesh, std::int32_t height) {
    std::vector<std::uint8_t> out;
    for (const LatticePoint p : mesh.positions) out.push_back(p.z <= height);
    return out;
}

struct Edges {
    int open = 0, non_manifold = 0;
};
Edges edges_of(const LatticeMesh& mesh) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<int, int>> sides;
    for (const Triangle& t : mesh.triangles)
        for (std::size_t i = 0; i < 3; ++i) {
            const std::uint32_t a = t[i], b = t[(i + 1) % 3];
            ++(a < b ? sides[{a, b}].first : sides[{b, a}].second);
        }
    Edges out;
    for (const auto& [ends, count] : sides) {
        out.open += count.first + count.second == 1;
        out.non_manifold += count.first > 1 || count.second > 1;
    }
    return out;
}

double area_of(const LatticeMesh& mesh) {
    double area = 0;
    for (const Triangle& t : mesh.triangles) {
        const LatticePoint p = mesh.positions[t[0]], u = mesh.positions[t[1]] - p, v = mesh.positions[t[2]] - p;
        const double x = 1.0 * u.y * v.z - 1.0 * u.z * v.y, y = 1.0 * u.z * v.x - 1.0 * u.x * v.z,
                     z = 1.0 * u.x * v.y - 1.0 * u.y * v.x;
        area += std::sqrt(x * x + y * y + z * z) / 2;
    }
    return area;
}

bool same(const LatticeMesh& a, const LatticeMesh& b) {
    return a.positions == b.positions && a.triangles == b.triangles && a.colours == b.colours;
}

// Sides of about 200; the seam is at half the height.
struct Cut {
    LatticeMesh coded, animated;
    std::vector<std::uint8_t> still;
};
Cut cut_capsule(int coded_around, double displacement) {
    Cut cut;
    cut.animated = capsule(32, 24, 0, 4000);
    cut.still = still_below(cut.animated, 2000);
    cut.coded = above(capsule(coded_around, coded_around * 3 / 4, 0, 4000, 0.3), 2000);
    for (LatticePoint& p : cut.coded.positions) p.z += static_cast<std::int32_t>(displacement);
    return cut;
}

TEST(Zipper, HalvesOfDifferentSamplingBecomeOneClosedSurface) {
    const double whole = area_of(capsule(32, 24, 0, 4000));
    for (const int around : {16, 24, 32, 40, 64})
        for (const double displacement : {0.0, 100.0, 200.0, -100.0, -200.0}) {
            SCOPED_TRACE(std::to_string(around) + " around, displaced by " + std::to_string(displacement));
            const Cut cut = cut_capsule(around, displacement);
            const LatticeMesh joined = zipper(cut.coded, cut.animated, cut.still, {});
            EXPECT_EQ(edges_of(joined).open, 0);
            EXPECT_EQ(edges_of(joined).non_manifold, 0);
            EXPECT_NEAR(area_of(joined), whole + displacement * 2 * pi * 1000, 0.03 * whole);
        }
}

TEST(Zipper, TheSameSamplingOnBothSidesIsClosedToo) {
    Cut cut = cut_capsule(32, 0);
    cut.coded = above(cut.animated, 2000);
    const LatticeMesh joined = zipper(cut.coded, cut.animated, cut.still, {});
    EXPECT_EQ(edges_of(joined).open, 0);
    EXPECT_EQ(edges_of(joined).non_manifold, 0);
    EXPECT_NEAR(area_of(joined), area_of(cut.animated), 0.001 * area_of(cut.animated));
}

TEST(Zipper, ACodedPieceInTheMiddleIsJoinedAtBothEnds) {
    const LatticeMesh animated = capsule(32, 24, 0, 4000);
    std::vector<std::uint8_t> still;
    for (const LatticePoint p : animated.positions) still.push_back(p.z < 1500 || p.z > 2500);
    LatticeMesh coded = above(tube(28, 9, 1300, 2700, 0.2), -1);
    const LatticeMesh joined = zipper(coded, animated, still, {});
    EXPECT_EQ(edges_of(joined).open, 0);
    EXPECT_EQ(edges_of(joined).non_manifold, 0);
}

TEST(Zipper, TheCodedVerticesAndTrianglesComeFirstAndUnchanged) {
    const Cut cut = cut_capsule(24, 100);
    const LatticeMesh joined = zipper(cut.coded, cut.animated, cut.still, {});
    ASSERT_GT(joined.positions.size(), cut.coded.positions.size());
    EXPECT_TRUE(std::equal(cut.coded.positions.begin(), cut.coded.positions.end(), joined.positions.begin()));
    EXPECT_TRUE(std::equal(cut.coded.triangles.begin(), cut.coded.triangles.end(), joined.triangles.begin()));
}

TEST(Zipper, ColoursStayWithTheirVertices) {
    Cut cut = cut_capsule(24, 100);
    cut.coded.colours.assign(cut.coded.positions.size(), Colour{1, 1, 1});
    for (std::size_t v = 0; v < cut.animated.positions.size(); ++v)
        cut.animated.colours.push_back({static_cast<std::uint8_t>(cut.animated.positions[v].z / 20), 2, 2});
    const LatticeMesh joined = zipper(cut.coded, cut.animated, cut.still, {});
    ASSERT_EQ(joined.colours.size(), joined.positions.size());
    for (std::size_t v = 0; v < joined.positions.size(); ++v) {
        if (v < cut.coded.positions.size())
            EXPECT_EQ(joined.colours[v], (Colour{1, 1, 1}));
        else
            EXPECT_EQ(joined.colours[v], (Colour{static_cast<std::uint8_t>(joined.positions[v].z / 20), 2, 2}));
    }
}

TEST(Zipper, NothingCodedGivesTheAnimatedMesh) {
    const Cut cut = cut_capsule(32, 0);
    EXPECT_TRUE(same(zipper({}, cut.animated, cut.still, {}), cut.animated));
}

TEST(Zipper, NothingStillGivesTheCodedMesh) {
    const Cut cut = cut_capsule(24, 0);
    const std::vector<std::uint8_t> none(cut.still.size(), 0);
    EXPECT_TRUE(same(zipper(cut.coded, cut.animated, none, {}), cut.coded));
    EXPECT_TRUE(same(zipper(cut.coded, {}, {}, {}), cut.coded));
    EXPECT_TRUE(same(zipper({}, {}, {}, {}), {}));
}

TEST(Zipper, TheOpenEndsOfACaptureStayOpen) {
    const LatticeMesh animated = tube(32, 24, 0, 4000);
    for (const double displacement : {0.0, 100.0, -100.0}) {
        LatticeMesh coded = above(tube(40, 30, 0, 4000, 0.3), 2000);
        for (LatticePoint& p : coded.positions) p.z += static_cast<std::int32_t>(displacement);
        const LatticeMesh joined = zipper(coded, animated, still_below(animated, 2000), {});
        EXPECT_EQ(edges_of(joined).open, 32 + 40);
        EXPECT_EQ(edges_of(joined).non_manifold, 0);
    }
}

TEST(Zipper, AnEdgeOfThreeTrianglesInTheInputHarmsNothing) {
    Cut cut = cut_capsule(24, 0);
    const Triangle t = cut.coded.triangles[cut.coded.triangles.size() / 2];
    cut.coded.positions.push_back({0, 0, 3000});
    cut.coded.triangles.push_back({t[0], t[1], static_cast<std::uint32_t>(cut.coded.positions.size() - 1)});
    const LatticeMesh joined = zipper(cut.coded, cut.animated, cut.still, {});
    EXPECT_EQ(edges_of(joined).open, 2);
    EXPECT_EQ(edges_of(joined).non_manifold, 1);
}

LatticeMesh soup(std::mt19937& random, std::int32_t size) {
    using namespace test;
    LatticeMesh mesh;
    const std::uint32_t vertices = below(random, 60);
    for (std::uint32_t v = 0; v < vertices; ++v)
        mesh.positions.push_back(
            {between(random, -size, size), between(random, -size, size), between(random, -size, size)});
    if (vertices > 0)
        for (std::uint32_t t = below(random, 120); t > 0; --t)
            mesh.triangles.push_back({below(random, vertices), below(random, vertices), below(random, vertices)});
    return mesh;
}

TEST(Zipper, AnyTriangleSoupGivesAValidMeshForAnyNumberOfThreads) {
    for (unsigned seed = 0; seed < 600; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 random(seed);
        const std::int32_t size = seed % 3 == 0 ? 2 : seed % 3 == 1 ? 1000 : lattice_limit;
        const LatticeMesh coded = soup(random, size), animated = soup(random, size);
        std::vector<std::uint8_t> still;
        for (std::size_t v = 0; v < animated.positions.size(); ++v) still.push_back(test::below(random, 2) != 0);
        const LatticeMesh joined = zipper(coded, animated, still, {});
        for (const Triangle& t : joined.triangles)
            for (const std::uint32_t v : t) ASSERT_LT(v, joined.positions.size());
        EXPECT_TRUE(same(joined, zipper(coded, animated, still, ThreadPool(3))));
    }
}

TEST(Zipper, TheNumberOfThreadsChangesNothing) {
    const Cut cut = cut_capsule(64, 100);
    EXPECT_TRUE(same(zipper(cut.coded, cut.animated, cut.still, {}),
                     zipper(cut.coded, cut.animated, cut.still, ThreadPool(3))));
}

}  // namespace
}  // namespace htvm::internal
