#include "metrics/topology.h"

#include <gtest/gtest.h>

#include <random>

#include "metrics/shapes.h"

namespace htvm {
namespace {

Topology of(const Mesh& mesh, const TopologyMeasureOptions& options = {}) {
    const auto found = topology(mesh, options, internal::ThreadPool(2));
    EXPECT_TRUE(found.has_value());
    return found.value_or(Topology{});
}

// Two planes side by side, `gap` mm apart.
Mesh two_planes(float gap) {
    Mesh left = shapes::plane(100, 10, 0);
    shapes::append(left, shapes::moved(shapes::plane(100, 10, 0), 100 + gap, 0, 0));
    return left;
}

TEST(Topology, OfASphereIsClosedAndOfGenusZero) {
    const Topology t = of(shapes::sphere(100, 3));
    EXPECT_EQ(t.euler, 2);
    EXPECT_EQ(t.components, 1u);
    EXPECT_EQ(t.boundary_edges, 0u);
    EXPECT_EQ(t.non_manifold_edges, 0u);
    EXPECT_EQ(t.triangles, 512u);
    EXPECT_EQ(t.vertices, 258u);
    EXPECT_EQ(t.edges, 768u);
    EXPECT_EQ(t.cracks + t.flaps + t.isolated_vertices + t.degenerate_triangles, 0u);
}

TEST(Topology, OfAPlaneHasItsRimAsBoundary) {
    const Topology t = of(shapes::plane(100, 10, 0));
    EXPECT_EQ(t.euler, 1);
    EXPECT_EQ(t.boundary_edges, 40u);
    EXPECT_EQ(t.open_edges, 40u);
    EXPECT_EQ(t.cracks, 0u);
    EXPECT_EQ(t.flaps, 0u);
}

TEST(Topology, CountsIsolatedDegenerateDuplicateAndNonManifoldParts) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}, {0, -10, 0}, {0, 0, 10}, {99, 99, 99}, {20, 0, 0}};
    mesh.triangles = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}, {2, 1, 0}, {0, 0, 1}, {0, 1, 6}};
    const Topology t = of(mesh);
    EXPECT_EQ(t.isolated_vertices, 1u);
    EXPECT_EQ(t.degenerate_triangles, 2u);
    EXPECT_EQ(t.duplicate_triangles, 1u);
    EXPECT_EQ(t.non_manifold_edges, 1u);
    EXPECT_EQ(t.components, 1u);
}

TEST(Topology, CoincidentVerticesSeparateByIndexButAreNoCrack) {
    const Topology t = of(two_planes(0));
    EXPECT_EQ(t.components, 2u);
    EXPECT_EQ(t.boundary_edges, 80u);
    EXPECT_EQ(t.open_edges, 60u);
    EXPECT_EQ(t.cracks, 0u);
}

TEST(Topology, ANarrowGapIsOneCrackOfItsLength) {
    const Topology t = of(two_planes(2));
    EXPECT_EQ(t.cracks, 1u);
    EXPECT_EQ(t.crack_edges, 20u);
    EXPECT_NEAR(t.crack_length, 100, 1e-6);
    EXPECT_EQ(of(two_planes(2), {.crack_width = 1.5}).cracks, 0u);
    EXPECT_EQ(of(two_planes(8)).cracks, 0u);
}

TEST(Topology, AVertexThatSitsInTheMiddleOfAnotherTrianglesSideIsACrack) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {10, 0, 0}, {5, 8, 0}, {5, 0, 0}, {5, -8, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 4, 3}, {3, 4, 1}};
    const Topology t = of(mesh);
    EXPECT_EQ(t.crack_edges, 3u);
    EXPECT_EQ(t.cracks, 1u);
}

TEST(Topology, AMissingTriangleIsAHoleAndNoCrack) {
    Mesh mesh = shapes::sphere(100, 3);
    mesh.triangles.erase(mesh.triangles.begin() + 100);
    const Topology t = of(mesh);
    EXPECT_EQ(t.boundary_edges, 3u);
    EXPECT_EQ(t.euler, 1);
    EXPECT_EQ(t.cracks, 0u);
}

TEST(Topology, ASecondLayerThatFacesTheSameWayIsAFlap) {
    Mesh mesh = shapes::plane(100, 10, 0);
    Mesh patch = shapes::moved(shapes::plane(20, 2, 0), 33, 33, 1);
    shapes::append(mesh, patch);
    const Topology t = of(mesh);
    EXPECT_EQ(t.flaps, 1u);
    EXPECT_GE(t.flap_triangles, 12u);
    EXPECT_LE(t.flap_triangles, 24u);
}

TEST(Topology, TheBackOfAThinSheetIsNoFlap) {
    Mesh mesh = shapes::plane(100, 10, 0);
    Mesh back = shapes::plane(100, 10, -1);
    for (auto& t : back.triangles) std::swap(t[1], t[2]);
    shapes::append(mesh, back);
    EXPECT_EQ(of(mesh).flaps, 0u);
}

TEST(Topology, GoesThroughAnything) {
    std::mt19937 random(21);
    for (int round = 0; round < 40; ++round) {
        const Mesh mesh = shapes::soup(random, random() % 50, random() % 120);
        const Topology t = of(mesh);
        EXPECT_EQ(t.triangles, mesh.triangles.size());
        EXPECT_LE(t.crack_edges, t.open_edges);
    }
    EXPECT_EQ(of(Mesh{}).components, 0u);
    Mesh heap;  // two thousand layers at one place
    for (int i = 0; i < 2000; ++i) {
        const auto v = static_cast<std::uint32_t>(heap.positions.size());
        const float z = 1e-4f * static_cast<float>(i);
        heap.positions.insert(heap.positions.end(), {{0, 0, z}, {10, 0, z}, {0, 10, z}});
        heap.triangles.push_back({v, v + 1, v + 2});
    }
    EXPECT_EQ(of(heap).flap_triangles, 2000u);
}

}  // namespace
}  // namespace htvm
