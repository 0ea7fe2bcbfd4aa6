#include "codec/reference/deformation_nodes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

namespace htvm::internal {
namespace {

// A strip of vertices `step` apart along x, two rows; vertex 2 i and 2 i + 1 are column i.
struct Strip {
    std::vector<LatticePoint> positions;
    std::vector<Triangle> triangles;
};

Strip strip(std::uint32_t columns, std::int32_t step, LatticePoint origin = {}) {
    Strip out;
    for (std::uint32_t i = 0; i < columns; ++i) {
        const auto x = static_cast<std::int32_t>(i) * step;
        out.positions.push_back(origin + LatticePoint{x, 0, 0});
        out.positions.push_back(origin + LatticePoint{x, step, 0});
        if (i == 0) continue;
        const std::uint32_t a = 2 * (i - 1);
        out.triangles.push_back({a, a + 2, a + 1});
        out.triangles.push_back({a + 1, a + 2, a + 3});
    }
    return out;
}

void append(Strip& mesh, const Strip& other) {
    const auto base = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
    for (const auto& t : other.triangles) mesh.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
}

DeformationNodes nodes_of(const Strip& mesh, std::int32_t spacing, std::int32_t reach = 0,
                          std::size_t most = most_deformation_nodes) {
    return choose_deformation_nodes(mesh.positions, mesh.triangles, {spacing, reach, most});
}

// What must hold for every result, whatever the mesh.
void expect_sound(const Strip& mesh, const DeformationNodes& nodes) {
    const std::size_t count = nodes.vertex.size();
    ASSERT_EQ(nodes.handle_of_vertex.size(), mesh.positions.size());
    ASSERT_EQ(nodes.weights.size(), mesh.positions.size());
    EXPECT_LE(count, most_deformation_nodes);
    for (const auto& weights : nodes.weights) {
        int sum = 0;
        for (std::size_t k = 0; k < handles_per_vertex; ++k) {
            sum += weights.weight[k];
            EXPECT_LT(weights.handle[k], count);
            if (weights.weight[k] == 0) {
                EXPECT_EQ(weights.handle[k], 0);
            }
            if (k > 0) {
                EXPECT_LE(weights.weight[k], weights.weight[k - 1]);
                EXPECT_TRUE(weights.weight[k] == 0 || weights.weight[k] < weights.weight[k - 1] ||
                            weights.handle[k] > weights.handle[k - 1]);
            }
        }
        EXPECT_EQ(sum, 1 << weight_bits);
    }
    for (std::size_t v = 0; v < nodes.weights.size(); ++v) {
        const auto& w = nodes.weights[v];  // the nearest node has the largest weight, or the same as the first
        const auto k = static_cast<std::size_t>(std::find(w.handle.begin(), w.handle.end(), nodes.handle_of_vertex[v]) -
                                                w.handle.begin());
        ASSERT_LT(k, handles_per_vertex);
        EXPECT_EQ(w.weight[k], w.weight[0]);
    }
    for (std::size_t n = 0; n < count; ++n) EXPECT_EQ(nodes.handle_of_vertex[nodes.vertex[n]], n);
    // All nodes are connected.
    std::vector<std::size_t> group(count);
    for (std::size_t n = 0; n < count; ++n) group[n] = n;
    for (std::size_t round = 0; round < count; ++round)
        for (const auto& pair : nodes.neighbours) {
            ASSERT_LT(pair.first, pair.second);
            ASSERT_LT(pair.second, count);
            group[pair.first] = group[pair.second] = std::min(group[pair.first], group[pair.second]);
        }
    EXPECT_TRUE(std::all_of(group.begin(), group.end(), [](std::size_t g) { return g == 0; }));
    EXPECT_TRUE(std::is_sorted(nodes.neighbours.begin(), nodes.neighbours.end()));
    EXPECT_EQ(std::adjacent_find(nodes.neighbours.begin(), nodes.neighbours.end()), nodes.neighbours.end());
}

TEST(DeformationNodes, AnEmptyMeshHasNone) {
    const auto nodes = nodes_of({}, 100);
    EXPECT_TRUE(nodes.vertex.empty());
    EXPECT_TRUE(nodes.handle_of_vertex.empty());
    EXPECT_TRUE(nodes.weights.empty());
    EXPECT_TRUE(nodes.neighbours.empty());
}

TEST(DeformationNodes, OneVertexIsOneNode) {
    const Strip mesh{{{5, 6, 7}}, {}};
    const auto nodes = nodes_of(mesh, 100);
    EXPECT_EQ(nodes.vertex, std::vector<std::uint32_t>{0});
    EXPECT_EQ(nodes.weights[0].weight[0], 1 << weight_bits);
    EXPECT_TRUE(nodes.neighbours.empty());
}

TEST(DeformationNodes, EachIsTheFirstVertexThatTheOthersDoNotReach) {
    // Columns 0, 10, 20, ...: a node at column 0 reaches 2 columns along its row.
    const auto mesh = strip(8, 10);
    const auto nodes = nodes_of(mesh, 25);
    // From vertex 0, column 2 of the other row is 10 + 20 or sqrt(200) + 10 = 24 away: reached, since it is rounded
    // down.
    EXPECT_EQ(nodes.vertex, (std::vector<std::uint32_t>{0, 5, 10, 15}));
    expect_sound(mesh, nodes);
}

TEST(DeformationNodes, ATieGoesToTheLowerNode) {
    // Three in a row, 10 apart: the middle one is equally far from both ends.
    const Strip mesh{{{0, 0, 0}, {20, 0, 0}, {10, 0, 0}}, {{0, 2, 0}, {2, 1, 1}}};
    const auto nodes = nodes_of(mesh, 10);
    EXPECT_EQ(nodes.vertex, (std::vector<std::uint32_t>{0, 1}));
    EXPECT_EQ(nodes.handle_of_vertex, (std::vector<std::uint16_t>{0, 1, 0}));
    EXPECT_EQ(nodes.neighbours, (std::vector<NodePair>{{0, 1}}));
    EXPECT_EQ(nodes.weights[2].weight[0], nodes.weights[2].weight[1]);
}

TEST(DeformationNodes, PiecesApartEachHaveOneAndAreTiedByTheShortestPair) {
    auto mesh = strip(2, 10);
    append(mesh, strip(2, 10, {1000, 0, 0}));
    append(mesh, strip(2, 10, {1500, 0, 0}));
    const auto nodes = nodes_of(mesh, 50, 20);
    EXPECT_EQ(nodes.vertex, (std::vector<std::uint32_t>{0, 4, 8}));
    EXPECT_EQ(nodes.neighbours, (std::vector<NodePair>{{0, 1}, {1, 2}}));
    expect_sound(mesh, nodes);
}

TEST(DeformationNodes, DistancesRunAcrossACutWhereVerticesCoincide) {
    auto mesh = strip(3, 10);
    append(mesh, strip(3, 10, {20, 0, 0}));  // begins where the first one ends
    const auto nodes = nodes_of(mesh, 100, 0);
    EXPECT_EQ(nodes.vertex.size(), 1u);
    // Both copies of the vertices at the cut have the same weights, so that it stays closed.
    const auto finer = nodes_of(mesh, 15, 0);
    EXPECT_EQ(finer.weights[4], finer.weights[6]);
    EXPECT_EQ(finer.weights[5], finer.weights[7]);
    expect_sound(mesh, finer);
}

TEST(DeformationNodes, PiecesWithinReachOfEachOtherShareNodes) {
    auto mesh = strip(3, 10);
    append(mesh, strip(3, 10, {25, 0, 3}));
    EXPECT_EQ(nodes_of(mesh, 100, 4).vertex.size(), 2u);
    EXPECT_EQ(nodes_of(mesh, 100, 6).vertex.size(), 1u);  // sqrt(5 * 5 + 3 * 3) is below 6
}

TEST(DeformationNodes, TooManyTakeAWiderSpacing) {
    const auto mesh = strip(200, 10);
    const auto nodes = nodes_of(mesh, 10, 0, 10);
    EXPECT_LE(nodes.vertex.size(), 10u);
    EXPECT_GE(nodes.vertex.size(), 4u);
    expect_sound(mesh, nodes);
}

TEST(DeformationNodes, ThousandsOfPiecesShareAsManyAsThereMayBe) {
    Strip mesh;
    std::mt19937 random(1);
    std::uniform_int_distribution<std::int32_t> place(-lattice_limit, lattice_limit);
    for (int i = 0; i < 3000; ++i) append(mesh, strip(2, 3, {place(random) / 2, place(random) / 2, place(random) / 2}));
    const auto nodes = nodes_of(mesh, 100, 50);
    EXPECT_EQ(nodes.vertex.size(), most_deformation_nodes);
    ASSERT_EQ(nodes.handle_of_vertex.size(), mesh.positions.size());
    // A vertex that no node reaches follows the one nearest in space.
    const std::size_t v = mesh.positions.size() - 1;
    std::int64_t best = std::numeric_limits<std::int64_t>::max();
    for (const auto n : nodes.vertex) best = std::min(best, squared_distance(mesh.positions[v], mesh.positions[n]));
    EXPECT_EQ(squared_distance(mesh.positions[v], mesh.positions[nodes.vertex[nodes.handle_of_vertex[v]]]), best);
}

TEST(DeformationNodes, AnyTrianglesWillDo) {
    std::mt19937 random(2);
    for (int trial = 0; trial < 40; ++trial) {
        Strip mesh;
        const auto vertices = static_cast<std::uint32_t>(1 + random() % 60);
        for (std::uint32_t v = 0; v < vertices; ++v)
            mesh.positions.push_back({static_cast<std::int32_t>(random() % 50),
                                      static_cast<std::int32_t>(random() % 50),
                                      static_cast<std::int32_t>(random() % 50)});
        const std::size_t triangles = random() % 80;
        for (std::size_t t = 0; t < triangles; ++t)
            mesh.triangles.push_back({static_cast<std::uint32_t>(random() % vertices),
                                      static_cast<std::uint32_t>(random() % vertices),
                                      static_cast<std::uint32_t>(random() % vertices)});
        expect_sound(mesh, nodes_of(mesh, 1 + static_cast<std::int32_t>(random() % 40),
                                    static_cast<std::int32_t>(random() % 10)));
    }
}

// On a line, distances are differences.
void expect_nearest_on_a_line(std::int32_t least_step, std::int32_t most_step, std::int32_t spacing) {
    std::mt19937 random(3);
    Strip mesh;
    std::int32_t x = 0;
    for (std::uint32_t v = 0; v < 300; ++v) {
        x += least_step + static_cast<std::int32_t>(random() % static_cast<unsigned>(most_step - least_step + 1));
        mesh.positions.push_back({x, 0, 0});
        if (v > 0) mesh.triangles.push_back({v - 1, v, v});
    }
    const auto nodes = nodes_of(mesh, spacing);
    expect_sound(mesh, nodes);
    ASSERT_GT(nodes.vertex.size(), near_nodes);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        std::vector<NearNode> all;
        for (std::size_t n = 0; n < nodes.vertex.size(); ++n)
            all.push_back(
                {static_cast<std::uint32_t>(std::abs(mesh.positions[v].x - mesh.positions[nodes.vertex[n]].x)),
                 static_cast<std::uint16_t>(n)});
        std::sort(all.begin(), all.end());
        ASSERT_EQ(nodes.near[v].count, near_nodes);
        for (std::size_t k = 0; k < near_nodes; ++k) EXPECT_EQ(nodes.near[v].near[k], all[k]) << v;
        EXPECT_EQ(nodes.handle_of_vertex[v], all[0].node);
        EXPECT_LE(all[0].distance, static_cast<std::uint32_t>(spacing));
    }
}

TEST(DeformationNodes, TheNearestNodesAreTheNearestAlongTheMesh) {
    expect_nearest_on_a_line(1, 20, 60);
    expect_nearest_on_a_line(7, 7, 14);  // ties everywhere
}
TEST(DeformationNodes, TheNearestNodesAreSoWhereManyVerticesLieAtOnePlace) { expect_nearest_on_a_line(0, 2, 9); }
TEST(DeformationNodes, TheNearestNodesAreSoWhereStepsAreTooUnevenForABucketEach) {
    expect_nearest_on_a_line(0, 30'000, 60'000);
}

// The columns from `begin` to before `end` of a strip taken out, and put back behind the others.
struct PatchedStrip {
    Strip mesh;
    std::vector<std::uint32_t> stays;
};
PatchedStrip patched(const Strip& before, std::uint32_t begin, std::uint32_t end) {
    PatchedStrip out;
    std::vector<std::uint32_t> order;
    const auto count = static_cast<std::uint32_t>(before.positions.size());
    const auto goes = [&](std::uint32_t v) { return v / 2 >= begin && v / 2 < end; };
    for (std::uint32_t v = 0; v < count; ++v)
        if (!goes(v)) out.stays.push_back(v);
    order = out.stays;
    for (std::uint32_t v = 0; v < count; ++v)
        if (goes(v)) order.push_back(v);
    std::vector<std::uint32_t> number(count);
    for (std::uint32_t i = 0; i < count; ++i) {
        number[order[i]] = i;
        out.mesh.positions.push_back(before.positions[order[i]]);
    }
    for (const auto& t : before.triangles) out.mesh.triangles.push_back({number[t[0]], number[t[1]], number[t[2]]});
    return out;
}

TEST(DeformationNodes, APatchChangesThemNearItAlone) {
    const auto before = strip(60, 10);
    const auto nodes = nodes_of(before, 25);
    const auto after = patched(before, 20, 26);
    const auto kept = keep_nodes(nodes, after.stays);
    const auto renewed = choose_deformation_nodes(after.mesh.positions, after.mesh.triangles, {.spacing = 25}, kept);
    expect_sound(after.mesh, renewed);
    EXPECT_EQ(renewed.spacing, 25);
    // Nodes that stay come first, in their order; none is new but in the hole.
    ASSERT_LT(kept.vertex.size(), nodes.vertex.size());
    ASSERT_LE(kept.vertex.size(), renewed.vertex.size());
    EXPECT_TRUE(std::equal(kept.vertex.begin(), kept.vertex.end(), renewed.vertex.begin()));
    for (std::size_t n = kept.vertex.size(); n < renewed.vertex.size(); ++n)
        EXPECT_GE(renewed.vertex[n], after.stays.size());
    // Five nodes lie within ten columns; away from the hole all is as it was.
    for (std::uint32_t v = 0; v < after.stays.size(); ++v) {
        const auto column = after.stays[v] / 2;
        if (column >= 5 && column < 40) continue;
        ASSERT_EQ(renewed.near[v].count, near_nodes);
        for (std::size_t k = 0; k < near_nodes; ++k) {
            EXPECT_EQ(renewed.near[v].near[k].distance, nodes.near[after.stays[v]].near[k].distance);
            EXPECT_EQ(after.stays[renewed.vertex[renewed.near[v].near[k].node]],
                      nodes.vertex[nodes.near[after.stays[v]].near[k].node]);
        }
    }
}

TEST(DeformationNodes, APatchThatChangesNothingKeepsThemAll) {
    const auto mesh = strip(40, 10);
    const auto nodes = nodes_of(mesh, 30);
    std::vector<std::uint32_t> all(mesh.positions.size());
    for (std::uint32_t v = 0; v < all.size(); ++v) all[v] = v;
    const auto again = choose_deformation_nodes(mesh.positions, mesh.triangles, {}, keep_nodes(nodes, all));
    EXPECT_EQ(again.vertex, nodes.vertex);
    EXPECT_EQ(again.near, nodes.near);
    EXPECT_EQ(again.weights, nodes.weights);
    EXPECT_EQ(again.neighbours, nodes.neighbours);
    EXPECT_EQ(again.searched, 0u);
}

TEST(DeformationNodes, WhatAPatchBringsMayFollowTheNodesAroundIt) {
    // One column of many: those beside it reach over it.
    const auto before = strip(21, 10);
    const auto after = patched(before, 1, 2);
    const auto kept = keep_nodes(nodes_of(before, 50), after.stays);
    const auto renewed = choose_deformation_nodes(after.mesh.positions, after.mesh.triangles, {}, kept);
    EXPECT_EQ(renewed.vertex, kept.vertex);
    expect_sound(after.mesh, renewed);
}

TEST(DeformationNodes, WhereNoneStaysOrTooManyWouldBeNeededAllAreChosenAnew) {
    const auto before = strip(30, 10);
    const auto nodes = nodes_of(before, 25);
    const auto without_nodes = [&] {
        std::vector<std::uint32_t> out;
        for (std::uint32_t v = 0; v < before.positions.size(); ++v)
            if (std::find(nodes.vertex.begin(), nodes.vertex.end(), v) == nodes.vertex.end()) out.push_back(v);
        return out;
    }();
    EXPECT_TRUE(keep_nodes(nodes, without_nodes).vertex.empty());
    const auto after = patched(before, 10, 20);
    const auto kept = keep_nodes(nodes, after.stays);
    ASSERT_FALSE(kept.vertex.empty());
    const DeformationNodeOptions few{.spacing = 200, .most_nodes = kept.vertex.size()};
    const auto anew = choose_deformation_nodes(after.mesh.positions, after.mesh.triangles, few);
    EXPECT_EQ(choose_deformation_nodes(after.mesh.positions, after.mesh.triangles, few, kept).vertex, anew.vertex);
    expect_sound(after.mesh, anew);
}

TEST(DeformationNodes, AnyPatchesWillDo) {
    std::mt19937 random(4);
    for (int trial = 0; trial < 40; ++trial) {
        auto mesh = strip(20 + static_cast<std::uint32_t>(random() % 40), 10);
        auto nodes = nodes_of(mesh, 20 + static_cast<std::int32_t>(random() % 40), 15);
        for (int patches = 0; patches < 4; ++patches) {
            const auto columns = static_cast<std::uint32_t>(mesh.positions.size() / 2);
            const auto begin = static_cast<std::uint32_t>(random() % columns);
            auto after = patched(mesh, begin, begin + static_cast<std::uint32_t>(random() % 12));
            for (std::size_t v = after.stays.size(); v < after.mesh.positions.size(); ++v)
                after.mesh.positions[v].z += static_cast<std::int32_t>(random() % 9);
            if (random() % 2 == 0) append(after.mesh, strip(3, 10, {0, 0, 12}));
            const auto kept = keep_nodes(nodes, after.stays);
            nodes = choose_deformation_nodes(after.mesh.positions, after.mesh.triangles, {.spacing = 30}, kept);
            expect_sound(after.mesh, nodes);
            mesh = std::move(after.mesh);
        }
    }
}

TEST(DeformationNodes, ExtremePlacesAndSpacingsAreLegal) {
    constexpr std::int32_t far = lattice_limit;
    const Strip mesh{{{-far, -far, -far}, {far, far, far}, {far, -far, far}}, {{0, 1, 2}}};
    for (const std::int32_t spacing : {1, far, std::numeric_limits<std::int32_t>::max()})
        expect_sound(mesh, nodes_of(mesh, spacing, far));
}

}  // namespace
}  // namespace htvm::internal
