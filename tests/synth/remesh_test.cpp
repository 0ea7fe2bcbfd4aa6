// Edge collapse, flips and relaxation on closed surfaces.
#include "synth/remesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/thread.h"

namespace htvm::synth {
namespace {

using Eigen::Vector3d;

struct Soup {
    std::vector<Vector3d> positions;
    std::vector<Triangle> triangles;
};

Soup octahedron() {
    return {{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
            {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
}

// A torus of rows x columns quads, each cut in two.
Soup torus(std::uint32_t rows, std::uint32_t columns) {
    Soup soup;
    for (std::uint32_t r = 0; r < rows; ++r)
        for (std::uint32_t c = 0; c < columns; ++c) {
            const double u = 2 * std::numbers::pi * r / rows, v = 2 * std::numbers::pi * c / columns;
            soup.positions.emplace_back((3 + std::cos(v)) * std::cos(u), (3 + std::cos(v)) * std::sin(u), std::sin(v));
            const std::uint32_t a = r * columns + c, b = r * columns + (c + 1) % columns;
            const std::uint32_t d = (r + 1) % rows * columns + c, e = (r + 1) % rows * columns + (c + 1) % columns;
            soup.triangles.push_back({a, d, b});
            soup.triangles.push_back({b, d, e});
        }
    return soup;
}

HalfEdgeMesh build(const Soup& soup, std::size_t fewest = 0) {
    return build_half_edges(soup.positions, soup.triangles, fewest);
}

// Twins, fans and valences are consistent.
void expect_consistent(const HalfEdgeMesh& mesh) {
    for (std::uint32_t e = 0; e < mesh.origin.size(); ++e) {
        if (mesh.origin[e] == dead_half_edge) continue;
        const std::uint32_t next = e % 3 == 2 ? e - 2 : e + 1;
        ASSERT_EQ(mesh.twin[mesh.twin[e]], e);
        ASSERT_EQ(mesh.origin[mesh.twin[e]], mesh.origin[next]);
    }
    for (std::uint32_t v = 0; v < mesh.positions.size(); ++v) {
        if (mesh.outgoing[v] == dead_half_edge) continue;
        std::uint32_t e = mesh.outgoing[v], valence = 0;
        do {
            ASSERT_EQ(mesh.origin[e], v);
            e = mesh.twin[e % 3 == 0 ? e + 2 : e - 1];
            ++valence;
        } while (e != mesh.outgoing[v]);
        ASSERT_EQ(valence, mesh.valence[v]);
    }
}

int euler_characteristic(const HalfEdgeMesh& mesh) {
    const auto half_edges = static_cast<int>(mesh.origin.size());
    return static_cast<int>(mesh.positions.size()) - half_edges / 2 + half_edges / 3;
}

TEST(HalfEdges, AClosedSurfaceIsBuiltAndGivenBack) {
    const Soup soup = octahedron();
    const HalfEdgeMesh mesh = build(soup);
    expect_consistent(mesh);
    EXPECT_EQ(triangles_of(mesh), soup.triangles);
}

TEST(HalfEdges, OpenOrNonManifoldOrInconsistentTrianglesGiveAnEmptyMesh) {
    Soup open = octahedron(), doubled = octahedron(), turned = octahedron();
    open.triangles.pop_back();
    doubled.triangles.push_back(doubled.triangles.front());
    std::swap(turned.triangles[0][0], turned.triangles[0][1]);
    for (const auto& soup : {open, doubled, turned}) EXPECT_TRUE(build(soup).origin.empty());
    EXPECT_TRUE(build({}).origin.empty());
}

TEST(HalfEdges, TwoSurfacesThatTouchInAVertexAreNotAManifold) {
    Soup soup = octahedron();
    Soup other = octahedron();  // shares vertex 0
    for (auto t : other.triangles) {
        for (auto& v : t) v = v == 0 ? 0 : v + 5;
        soup.triangles.push_back(t);
    }
    for (std::size_t v = 1; v < 6; ++v) soup.positions.push_back(other.positions[v] + Vector3d(2, 0, 0));
    EXPECT_TRUE(build(soup).origin.empty());
}

TEST(HalfEdges, SmallComponentsAreDropped) {
    Soup soup = torus(8, 8);
    const auto first = static_cast<std::uint32_t>(soup.positions.size());
    const std::size_t large = soup.triangles.size();
    const Soup speck = octahedron();
    soup.positions.insert(soup.positions.end(), speck.positions.begin(), speck.positions.end());
    for (const auto& t : speck.triangles) soup.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    HalfEdgeMesh mesh = build(soup, 20);
    EXPECT_EQ(mesh.origin.size(), 3 * large);
    compact(mesh);
    EXPECT_EQ(mesh.positions.size(), 64u);
    EXPECT_EQ(build(soup, 8).origin.size(), 3 * (large + 8));
}

TEST(Collapse, ReachesTheCountAskedForAndKeepsTheTopology) {
    HalfEdgeMesh mesh = build(torus(40, 20));
    collapse_to(mesh, 300);
    expect_consistent(mesh);
    compact(mesh);
    expect_consistent(mesh);
    EXPECT_EQ(mesh.positions.size(), 300u);
    EXPECT_EQ(euler_characteristic(mesh), 0);
}

TEST(Collapse, StopsBeforeTheSurfaceWouldCloseUp) {
    HalfEdgeMesh mesh = build(torus(40, 20));
    collapse_to(mesh, 1);
    expect_consistent(mesh);
    compact(mesh);
    EXPECT_EQ(euler_characteristic(mesh), 0);
    EXPECT_GE(mesh.positions.size(), 7u);  // a torus needs at least that many vertices

    HalfEdgeMesh smallest = build(octahedron());
    collapse_to(smallest, 0);
    compact(smallest);
    expect_consistent(smallest);
    EXPECT_EQ(euler_characteristic(smallest), 2);
}

TEST(Flips, MakeAThinDiagonalShortAndKeepTheSurfaceClosed) {
    Soup soup = torus(60, 6);  // long thin quads
    for (std::size_t v = 0; v < soup.positions.size(); v += 3) soup.positions[v] += Vector3d(0.11, -0.07, 0.05);
    HalfEdgeMesh mesh = build(soup);
    flip_to_delaunay(mesh);
    expect_consistent(mesh);
    EXPECT_NE(triangles_of(mesh), soup.triangles);
    EXPECT_EQ(euler_characteristic(mesh), 0);
}

TEST(Relax, LeavesARegularSurfaceWhereItIsAndDoesNotDependOnThreads) {
    HalfEdgeMesh regular = build(octahedron());
    relax(regular, 0.5, {});
    for (std::size_t v = 0; v < 6; ++v) EXPECT_LT((regular.positions[v] - octahedron().positions[v]).norm(), 1e-12);

    Soup soup = torus(60, 30);
    for (std::size_t v = 0; v < soup.positions.size(); v += 3) soup.positions[v] += Vector3d(0.05, -0.04, 0.03);
    HalfEdgeMesh one = build(soup), many = build(soup);
    internal::ThreadPool pool(4);
    relax(one, 0.5, {});
    relax(many, 0.5, pool.threads());
    EXPECT_EQ(one.positions, many.positions);
}

}  // namespace
}  // namespace htvm::synth
