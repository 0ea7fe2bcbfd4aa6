#include "codec/encoder/bones/enhanced_frame.h"

#include <gtest/gtest.h>

#include <random>

#include "codec/random_numbers.h"

namespace htvm::internal {
namespace {

using test::between;

LatticePoint random_point(std::mt19937& random, std::int32_t reach) {
    return {between(random, -reach, reach), between(random, -reach, reach), between(random, -reach, reach)};
}

// Three bones; the last is far away from every vertex, so it has none.
ReferenceMesh random_reference(std::size_t vertices, std::mt19937& random) {
    LatticeMesh mesh;
    for (std::size_t i = 0; i < vertices; ++i) mesh.positions.push_back(random_point(random, 3000));
    const std::vector<std::int32_t> radii = {100, 100, 0};
    return make_reference(std::move(mesh), {{0, 1}, {2, 3}, {4, 4}},
                          {{-2000, -3000, 0}, {-2000, 3000, 0}, {2000, -3000, 0}, {2000, 3000, 0}, {900000, 0, 0}},
                          std::vector<QuantisedRotation>(3), radii, 0, 0, {});
}

struct Case {
    ReferenceMesh reference;
    std::vector<QuantisedTransform> transforms;
    std::vector<LatticePoint> predicted, frame;
    std::vector<BoneIndex> bone_of_vertex;
};

Case random_case(std::size_t references, std::size_t vertices, unsigned seed) {
    std::mt19937 random(seed);
    Case out;
    out.reference = random_reference(references, random);
    for (int i = 0; i < 3; ++i)
        out.transforms.push_back(
            {quantise_rotation({1, between(random, -3, 3) / 10.0, between(random, -3, 3) / 10.0, 0}),
             random_point(random, 200)});
    out.predicted = predict_positions(out.reference, out.transforms, {});
    for (std::size_t k = 0; k < vertices; ++k) {
        out.frame.push_back(random_point(random, 3000));
        out.bone_of_vertex.push_back(static_cast<BoneIndex>(test::below(random, 3)));
    }
    return out;
}

double distance(LatticePoint a, LatticePoint b) { return std::sqrt(static_cast<double>(squared_distance(a, b))); }

std::vector<std::uint32_t> find(const Case& c, ReferenceChoice choice, Threads threads = {}) {
    return find_reference_vertices(c.reference, make_reference_search(c.reference), c.predicted, c.transforms, c.frame,
                                   c.bone_of_vertex, {}, {}, choice, threads);
}

TEST(ReferenceVertices, OfAnyBoneAreTheNearestPredictedVertices) {
    for (const std::size_t references : {1u, 2u, 50u, 800u}) {
        const auto c = random_case(references, 300, static_cast<unsigned>(references));
        const auto found = find(c, ReferenceChoice::any);
        for (std::size_t k = 0; k < c.frame.size(); ++k) {
            double best = distance(c.predicted[0], c.frame[k]);
            for (const auto p : c.predicted) best = std::min(best, distance(p, c.frame[k]));
            ASSERT_NEAR(distance(c.predicted[found[k]], c.frame[k]), best, 1e-2);
        }
    }
}

TEST(ReferenceVertices, OfTheBoneAreTheNearestOfItsSubMeshOrOfAllWhereItIsBare) {
    for (const std::size_t references : {1u, 2u, 50u, 800u}) {
        const auto c = random_case(references, 300, static_cast<unsigned>(references) + 1);
        const auto found = find(c, ReferenceChoice::bone);
        for (std::size_t k = 0; k < c.frame.size(); ++k) {
            const auto bone = c.bone_of_vertex[k];
            const bool bare = c.reference.sub_meshes.of(bone).empty();
            double best = 1e30;
            for (std::size_t r = 0; r < c.predicted.size(); ++r)
                if (bare || c.reference.bone_of_vertex[r] == bone)
                    best = std::min(best, distance(c.predicted[r], c.frame[k]));
            EXPECT_TRUE(bare || c.reference.bone_of_vertex[found[k]] == bone);
            // The search runs in the reference's own space: predicted vertices are rounded there, by at most one unit.
            ASSERT_NEAR(distance(c.predicted[found[k]], c.frame[k]), best, 2.0);
        }
    }
}

TEST(ReferenceVertices, AreTheSameForAnyNumberOfThreads) {
    const auto c = random_case(2000, 5000, 9);
    for (const auto choice : {ReferenceChoice::any, ReferenceChoice::bone})
        EXPECT_EQ(find(c, choice, {}), find(c, choice, ThreadPool(7)));
}

TEST(ReferenceVertices, OfNoVerticesAreNone) {
    auto c = random_case(5, 0, 3);
    EXPECT_TRUE(find(c, ReferenceChoice::any).empty());
    EXPECT_TRUE(find(c, ReferenceChoice::bone).empty());
}

TEST(ResidualOrder, IsByReferenceVertexAndStable) {
    const auto order = order_residuals(std::vector<std::uint32_t>{2, 0, 2, 1, 0}, 4);
    EXPECT_EQ(order.vertex, (std::vector<std::uint32_t>{1, 4, 3, 0, 2}));
    EXPECT_EQ(order.reference, (std::vector<std::uint32_t>{0, 0, 1, 2, 2}));
    EXPECT_TRUE(order_residuals({}, 3).vertex.empty());
}

}  // namespace
}  // namespace htvm::internal
