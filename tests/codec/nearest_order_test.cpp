#include "codec/bones/nearest_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace htvm::internal {
namespace {

// The oracle: every other point sorted by (squared distance, index).
std::vector<std::uint32_t> by_brute_force(const std::vector<LatticePoint>& points, std::uint32_t of,
                                          std::size_t count) {
    std::vector<std::pair<std::int64_t, std::uint32_t>> all;
    for (std::uint32_t i = 0; i < points.size(); ++i)
        if (i != of) all.push_back({squared_distance(points[of], points[i]), i});
    std::sort(all.begin(), all.end());
    all.resize(std::min(all.size(), count));
    std::vector<std::uint32_t> indices;
    for (const auto& [distance, index] : all) indices.push_back(index);
    return indices;
}

void expect_exact(const std::vector<LatticePoint>& points, std::size_t count) {
    const NearestOrder order(points);
    std::vector<std::uint32_t> nearest(count);
    for (std::uint32_t of = 0; of < points.size(); ++of) {
        const std::size_t found = order.find(of, nearest);
        ASSERT_EQ(std::vector<std::uint32_t>(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(found)),
                  by_brute_force(points, of, count))
            << "vertex " << of << " of " << points.size();
    }
}

TEST(NearestOrder, NearestFirst) {
    const std::vector<LatticePoint> points = {{0, 0, 0}, {10, 0, 0}, {0, 3, 0}, {0, 0, -5}};
    const NearestOrder order(points);
    std::vector<std::uint32_t> nearest(3);
    EXPECT_EQ(order.find(0, nearest), 3u);
    EXPECT_EQ(nearest, (std::vector<std::uint32_t>{2, 3, 1}));
}

TEST(NearestOrder, EqualDistancesGoByIndex) {
    const std::vector<LatticePoint> points = {{0, 5, 0}, {5, 0, 0}, {0, 0, 0}, {-5, 0, 0}, {0, -5, 0}};
    const NearestOrder order(points);
    std::vector<std::uint32_t> nearest(4);
    EXPECT_EQ(order.find(2, nearest), 4u);
    EXPECT_EQ(nearest, (std::vector<std::uint32_t>{0, 1, 3, 4}));
}

TEST(NearestOrder, FewerPointsThanAskedForGivesAllOthers) {
    for (std::size_t count = 1; count < 20; ++count) expect_exact(std::vector<LatticePoint>(count, {1, 2, 3}), 16);
}

TEST(NearestOrder, NoPointsCanBeHeld) { EXPECT_NO_FATAL_FAILURE(NearestOrder({})); }

TEST(NearestOrder, EqualsBruteForceOnEveryDistribution) {
    std::mt19937 random(3);
    const auto below = [&](std::int32_t n) { return static_cast<std::int32_t>(random() % static_cast<unsigned>(n)); };
    for (const std::size_t size : {std::size_t{2}, std::size_t{9}, std::size_t{100}, std::size_t{700}}) {
        for (const std::int32_t extent : {1, 2, 5, 60, 3000, lattice_limit}) {
            std::vector<LatticePoint> points(size);
            for (auto& p : points) p = {below(extent), below(extent) - extent / 2, -below(extent)};
            expect_exact(points, 8);
            for (auto& p : points) p.y = 0;
            expect_exact(points, 16);
            for (auto& p : points) p.z = p.x;
            expect_exact(points, 32);
        }
        std::vector<LatticePoint> clusters(size);
        for (auto& p : clusters) p = {below(2) * lattice_limit + below(3), below(4), below(2) * -lattice_limit};
        expect_exact(clusters, 16);
        for (auto& p : clusters) p = {below(1 << (1 + below(24))), below(1 << (1 + below(24))), 0};
        expect_exact(clusters, 64);
    }
}

TEST(NearestOrder, TheFarthestCornersOfTheLatticeAreHandled) {
    const std::int32_t far = lattice_limit;
    expect_exact({{far, far, far}, {-far, -far, -far}, {far, -far, far}, {-far, far, 0}, {0, 0, 0}}, 4);
}

}  // namespace
}  // namespace htvm::internal
