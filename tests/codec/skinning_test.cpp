#include "codec/reference/skinning.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

#include "codec/random_numbers.h"

namespace htvm::internal {
namespace {

using test::between;

// eq. 2 written down literally, in long double.
long double by_equation_2(LatticePoint v, const BoneCylinder& bone) {
    using Real = long double;
    const Real ux = bone.second.x - bone.first.x, uy = bone.second.y - bone.first.y, uz = bone.second.z - bone.first.z;
    const Real dx = v.x - bone.first.x, dy = v.y - bone.first.y, dz = v.z - bone.first.z;
    const Real length2 = ux * ux + uy * uy + uz * uz, along = ux * dx + uy * dy + uz * dz;
    const Real to_first = std::sqrt(static_cast<Real>(squared_distance(v, bone.first)));
    const Real to_second = std::sqrt(static_cast<Real>(squared_distance(v, bone.second)));
    if (length2 == 0 || along < 0 || along > length2) return std::min(to_first, to_second);
    const Real t = along / length2;
    const Real x = dx - t * ux, y = dy - t * uy, z = dz - t * uz;
    return std::sqrt(x * x + y * y + z * z) - bone.radius;
}

LatticePoint random_point(std::mt19937& random, std::int32_t reach) {
    return {between(random, -reach, reach), between(random, -reach, reach), between(random, -reach, reach)};
}

std::vector<BoneCylinder> random_bones(std::mt19937& random, std::size_t count, std::int32_t reach) {
    std::vector<BoneCylinder> out;
    for (std::size_t i = 0; i < count; ++i) {
        out.push_back({random_point(random, reach), random_point(random, reach), between(random, 0, reach / 4)});
        if (i % 5 == 4) out.back().second = out.back().first;
    }
    return out;
}

const BoneCylinder upright = {{0, 0, 0}, {0, 100, 0}, 10};

TEST(DistanceToBone, BesideTheSegmentIsToTheCylindersSurface) {
    EXPECT_EQ(distance_to_bone({30, 50, 40}, upright), 40.0);
    EXPECT_EQ(distance_to_bone({10, 50, 0}, upright), 0.0);
}

TEST(DistanceToBone, InsideTheCylinderIsNegative) {
    EXPECT_EQ(distance_to_bone({0, 50, 0}, upright), -10.0);
    EXPECT_EQ(distance_to_bone({6, 1, 0}, upright), -4.0);
}

TEST(DistanceToBone, BeyondTheSegmentIsToTheNearerJoint) {
    EXPECT_EQ(distance_to_bone({0, 130, 40}, upright), 50.0);
    EXPECT_EQ(distance_to_bone({3, -4, 0}, upright), 5.0) << "the radius does not count there";
}

TEST(DistanceToBone, AtTheEndsOfTheSegmentTheCylinderCounts) {
    EXPECT_EQ(distance_to_bone({30, 0, 0}, upright), 20.0);
    EXPECT_EQ(distance_to_bone({30, 100, 0}, upright), 20.0);
}

TEST(DistanceToBone, ABoneOfNoLengthHasJointsOnly) {
    const BoneCylinder point = {{5, 5, 5}, {5, 5, 5}, 100};
    EXPECT_EQ(distance_to_bone({5, 5, 5}, point), 0.0);
    EXPECT_EQ(distance_to_bone({8, 5, 9}, point), 5.0);
    EXPECT_EQ(distance_to_axis({8, 5, 9}, point), -1.0) << "nothing projects onto it";
}

TEST(DistanceToAxis, IsNegativeWhereTheVertexDoesNotProject) {
    EXPECT_EQ(distance_to_axis({30, 50, 40}, upright), 50.0);
    EXPECT_EQ(distance_to_axis({0, 50, 0}, upright), 0.0);
    EXPECT_LT(distance_to_axis({30, 101, 40}, upright), 0.0);
    EXPECT_LT(distance_to_axis({30, -1, 40}, upright), 0.0);
}

TEST(DistanceToBone, IsEquation2) {
    std::mt19937 random(1);
    for (const std::int32_t reach : {3, 1000, 1 << 20, lattice_limit})
        for (const auto& bone : random_bones(random, 200, reach))
            for (int i = 0; i < 50; ++i) {
                const auto v = random_point(random, reach);
                const auto expected = by_equation_2(v, bone);
                ASSERT_NEAR(distance_to_bone(v, bone), static_cast<double>(expected), 1e-9 * reach + 1e-12);
            }
}

TEST(Skinning, GivesEachVertexItsNearestBone) {
    std::mt19937 random(2);
    for (const std::int32_t reach : {3, 1000, 1 << 20})
        for (const std::size_t count : {1u, 2u, 14u}) {
            const auto bones = random_bones(random, count, reach);
            std::vector<LatticePoint> vertices;
            for (int i = 0; i < 2000; ++i) vertices.push_back(random_point(random, reach));
            const auto bone_of = skin(vertices, bones, {});
            for (std::size_t k = 0; k < vertices.size(); ++k) {
                long double best = by_equation_2(vertices[k], bones[0]);
                for (const auto& bone : bones) best = std::min(best, by_equation_2(vertices[k], bone));
                ASSERT_NEAR(static_cast<double>(by_equation_2(vertices[k], bones[bone_of[k]])),
                            static_cast<double>(best), 1e-9 * reach);
            }
        }
}

TEST(Skinning, TiesGoToTheLowerBone) {
    const std::vector<BoneCylinder> twins = {{{50, 0, 0}, {50, 100, 0}, 5},
                                             {{0, 0, 0}, {0, 100, 0}, 5},
                                             {{20, 0, 0}, {20, 100, 0}, 5},
                                             {{0, 100, 0}, {0, 0, 0}, 5}};
    const std::vector<LatticePoint> vertices = {{10, 50, 0},  {0, 50, 3},  {35, 50, 0},
                                                {10, 150, 0}, {22, 50, 0}, {35, 50, 0}};
    EXPECT_EQ(skin(vertices, twins, {}), (std::vector<BoneIndex>{1, 1, 0, 1, 2, 0}));
}

TEST(Skinning, IsTheSameForAnyNumberOfThreads) {
    std::mt19937 random(3);
    const auto bones = random_bones(random, 14, 5000);
    std::vector<LatticePoint> vertices;
    for (int i = 0; i < 30000; ++i) vertices.push_back(random_point(random, 6000));
    EXPECT_EQ(skin(vertices, bones, {}), skin(vertices, bones, ThreadPool(7)));
    EXPECT_TRUE(skin({}, bones, ThreadPool(4)).empty());
}

TEST(SubMeshes, HoldEveryVertexOnceByBoneAndAscending) {
    std::mt19937 random(4);
    std::vector<BoneIndex> bone_of(1000);
    for (auto& bone : bone_of)
        bone = static_cast<BoneIndex>(test::below(random, 6) * 2);  // every second bone has no
                                                                    // vertices
    const auto groups = group_by_bone(bone_of, 12);
    std::size_t total = 0;
    for (std::size_t bone = 0; bone < 12; ++bone) {
        const auto vertices = groups.of(bone);
        total += vertices.size();
        EXPECT_TRUE(std::is_sorted(vertices.begin(), vertices.end()));
        for (const auto v : vertices) EXPECT_EQ(bone_of[v], bone);
    }
    EXPECT_EQ(total, bone_of.size());
    EXPECT_TRUE(group_by_bone({}, 3).of(2).empty());
}

TEST(Cylinders, TakeTheirJointsAndRadii) {
    const std::vector<LatticePoint> joints = {{1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
    const std::vector<std::int32_t> radii = {7, 8};
    const auto out = cylinders({{2, 0}, {1, 1}}, joints, radii);
    ASSERT_EQ(out.size(), 2u);
    EXPECT_EQ(out[0].first, joints[2]);
    EXPECT_EQ(out[0].second, joints[0]);
    EXPECT_EQ(out[0].radius, 7);
    EXPECT_EQ(out[1].first, out[1].second);
    EXPECT_EQ(out[1].radius, 8);
}

}  // namespace
}  // namespace htvm::internal
