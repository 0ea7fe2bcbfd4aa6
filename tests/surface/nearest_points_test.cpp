#include "surface/nearest_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace htvm::internal {
namespace {

float squared(const Point3f& a, const Point3f& b) {
    const float x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

// Points of one kind: spread, on a coarse grid with many equal ones, in a line, all in one place.
std::vector<Point3f> points(std::size_t count, int kind, std::mt19937& random) {
    std::uniform_real_distribution<float> spread(-1000, 1000);
    std::vector<Point3f> out;
    for (std::size_t i = 0; i < count; ++i) {
        Point3f p = {spread(random), spread(random), spread(random)};
        if (kind == 1)
            for (auto& c : p) c = static_cast<float>(static_cast<int>(c / 250));
        if (kind == 2) p[1] = p[2] = 0;
        if (kind == 3) p = {5, 6, 7};
        out.push_back(p);
    }
    return out;
}

TEST(NearestPoints, AreAsNearAsBruteForceFindsThem) {
    std::mt19937 random(1);
    for (int kind = 0; kind < 4; ++kind)
        for (const std::size_t count : {1u, 2u, 11u, 12u, 13u, 14u, 100u, 700u}) {
            const auto set = points(count, kind, random);
            const NearestPoints tree(set);
            ASSERT_EQ(tree.size(), count);
            auto queries = points(50, kind, random);
            for (const auto& p : points(50, 0, random)) queries.push_back(p);
            for (const auto& query : queries) {
                float best = squared(set[0], query);
                for (const auto& p : set) best = std::min(best, squared(p, query));
                const auto found = tree.nearest(query);
                ASSERT_LT(found.index, count);
                ASSERT_EQ(squared(set[found.index], query), best) << kind << " " << count;
                ASSERT_FLOAT_EQ(found.squared_distance, best);
                ASSERT_EQ(tree.point(found.index), set[found.index]);
            }
        }
}

TEST(NearestPoints, EveryPointFindsItsOwnPlace) {
    std::mt19937 random(2);
    const auto set = points(500, 1, random);
    const NearestPoints tree(set);
    for (const auto& p : set) EXPECT_EQ(tree.nearest(p).squared_distance, 0.0f);
}

TEST(NearestPoints, NoPointsAreLegalToHold) { EXPECT_EQ(NearestPoints({}).size(), 0u); }

TEST(NearestPoints, CanBeMoved) {
    std::mt19937 random(3);
    const auto set = points(200, 0, random);
    std::vector<NearestPoints> trees;
    for (int i = 0; i < 5; ++i) trees.emplace_back(set);
    EXPECT_EQ(trees[0].nearest(set[17]).squared_distance, 0.0f);
}

}  // namespace
}  // namespace htvm::internal
