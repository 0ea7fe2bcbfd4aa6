#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "codec/random_numbers.h"
#include "codec/reference/skinning.h"

namespace htvm::internal {
namespace {

using Handles = std::vector<std::uint16_t>;

struct Patch {
    std::vector<LatticePoint> positions;
    std::vector<Triangle> triangles;
};

// A flat grid of columns x rows vertices, `edge` apart; vertex row * columns + column.
Patch grid(std::uint32_t columns, std::uint32_t rows, std::int32_t edge) {
    Patch out;
    for (std::uint32_t r = 0; r < rows; ++r)
        for (std::uint32_t c = 0; c < columns; ++c)
            out.positions.push_back({static_cast<std::int32_t>(c) * edge, static_cast<std::int32_t>(r) * edge, 0});
    for (std::uint32_t r = 0; r + 1 < rows; ++r)
        for (std::uint32_t c = 0; c + 1 < columns; ++c) {
            const std::uint32_t v = r * columns + c;
            out.triangles.push_back({v, v + 1, v + columns});
            out.triangles.push_back({v + 1, v + columns + 1, v + columns});
        }
    return out;
}

HandleWeights weights_on(const Patch& patch, const Handles& own, std::int32_t width, Threads threads = {}) {
    return smooth_weights(own, patch.positions, patch.triangles, width, threads);
}

VertexWeights alone(std::uint16_t handle) { return {{handle}, {4096}}; }

void expect_sound(const HandleWeights& weights, const Handles& own) {
    ASSERT_EQ(weights.size(), own.size());
    for (std::size_t v = 0; v < own.size(); ++v) {
        const auto& w = weights[v];
        SCOPED_TRACE(v);
        ASSERT_EQ(std::accumulate(w.weight.begin(), w.weight.end(), 0), 4096);
        bool has_own = false;
        for (std::size_t i = 0; i < handles_per_vertex; ++i) {
            if (w.weight[i] == 0) {
                ASSERT_EQ(w.handle[i], 0);
            }
            has_own = has_own || (w.weight[i] == w.weight[0] && w.handle[i] == own[v]);
            if (i == 0 || w.weight[i] == 0) continue;
            ASSERT_LE(w.weight[i], w.weight[i - 1]);
            if (w.weight[i] == w.weight[i - 1]) {
                ASSERT_LT(w.handle[i - 1], w.handle[i]);
            }
            ASSERT_EQ(std::count(w.handle.begin(), w.handle.begin() + static_cast<std::ptrdiff_t>(i), w.handle[i]), 0);
        }
        ASSERT_TRUE(has_own) << "no handle weighs more than the vertex's own";
    }
}

std::uint16_t weight_of(const VertexWeights& weights, std::uint16_t handle) {
    for (std::size_t i = 0; i < handles_per_vertex; ++i)
        if (weights.weight[i] > 0 && weights.handle[i] == handle) return weights.weight[i];
    return 0;
}

TEST(SmoothWeights, OfNothingAreNone) { EXPECT_TRUE(smooth_weights({}, {}, {}, 100, ThreadPool(2)).empty()); }

TEST(SmoothWeights, OfOneHandleAreThatHandleAlone) {
    const auto patch = grid(5, 4, 10);
    EXPECT_EQ(weights_on(patch, Handles(20, 7), 1000), HandleWeights(20, alone(7)));
}

TEST(SmoothWeights, OfNoWidthAreEachVertexsOwnHandle) {
    const auto patch = grid(2, 2, 10);
    EXPECT_EQ(weights_on(patch, {0, 1, 2, 3}, 0), (HandleWeights{alone(0), alone(1), alone(2), alone(3)}));
}

TEST(SmoothWeights, FallInAStraightLineFromTheMiddleOfTheEdgesAcrossTheBorder) {
    const auto patch = grid(8, 1, 10);  // no triangles: a strip needs two rows
    EXPECT_EQ(weights_on(patch, {0, 0, 0, 0, 1, 1, 1, 1}, 80),
              (HandleWeights{alone(0), alone(0), alone(0), alone(0), alone(1), alone(1), alone(1), alone(1)}));
    // Columns 0..3 belong to handle 0, 4..7 to handle 1: the border is halfway, at 35.
    const auto strip = grid(8, 2, 10);
    Handles own;
    for (int row = 0; row < 2; ++row) own.insert(own.end(), {0, 0, 0, 0, 1, 1, 1, 1});
    const auto weights = weights_on(strip, own, 80);
    // 1/2 - distance / width, in 1/4096: at 5, 15, 25, 35 from the border.
    const std::vector<std::uint16_t> other = {256, 768, 1280, 1792};
    for (std::size_t c = 0; c < 4; ++c) {
        EXPECT_EQ(weights[c], (VertexWeights{{0, 1}, {static_cast<std::uint16_t>(4096 - other[c]), other[c]}})) << c;
        EXPECT_EQ(weights[7 - c], (VertexWeights{{1, 0}, {static_cast<std::uint16_t>(4096 - other[c]), other[c]}}));
    }
    // Half as wide: the columns at 25 and 35 from the border are outside.
    const auto narrow = weights_on(strip, own, 40);
    EXPECT_EQ(narrow[1], alone(0));
    EXPECT_EQ(narrow[2], (VertexWeights{{0, 1}, {3584, 512}}));
    EXPECT_EQ(narrow[3], (VertexWeights{{0, 1}, {2560, 1536}}));
    EXPECT_EQ(narrow[6], alone(1));
}

TEST(SmoothWeights, MakeABorderAboutAsWideAsAsked) {
    const auto patch = grid(200, 20, 10);
    Handles own(patch.positions.size());
    for (std::size_t v = 0; v < own.size(); ++v) own[v] = patch.positions[v].x < 1000;
    for (const std::int32_t width : {50, 200, 700}) {
        const auto weights = weights_on(patch, own, width);
        std::int32_t low = 2000, high = 0;
        for (std::size_t v = 0; v < own.size(); ++v)
            if (weights[v].weight[1] > 0) {
                low = std::min(low, patch.positions[v].x);
                high = std::max(high, patch.positions[v].x);
            }
        EXPECT_LE(high - low, width);
        EXPECT_GE(high - low, width - 20);
    }
}

TEST(SmoothWeights, AreTheSameMirrored) {
    const auto patch = grid(6, 2, 10);
    const auto weights = weights_on(patch, {0, 0, 0, 1, 1, 1, 0, 0, 0, 1, 1, 1}, 50);
    for (std::size_t c = 0; c < 6; ++c)
        EXPECT_EQ(weight_of(weights[c], 0), weight_of(weights[11 - c], 1)) << c;  // turned by 180 degrees
}

TEST(SmoothWeights, AreEqualThirdsWhereThreeHandlesMeetFarFromTheWidth) {
    const Patch triangle{{{0, 0, 0}, {100, 0, 0}, {0, 100, 0}}, {{0, 1, 2}}};
    const auto weights = weights_on(triangle, {4, 9, 2}, 1 << 20);
    for (const auto& w : weights) {
        EXPECT_EQ(w.weight[3], 0);
        for (const std::uint16_t h : Handles{4, 9, 2}) EXPECT_NEAR(weight_of(w, h), 4096 / 3, 2);
    }
}

TEST(SmoothWeights, KeepTheFourNearestHandlesOfMany) {
    // A strip of columns, each with its own handle.
    const auto patch = grid(9, 2, 10);
    Handles own;
    for (int row = 0; row < 2; ++row)
        for (std::uint16_t c = 0; c < 9; ++c) own.push_back(c);
    const auto weights = weights_on(patch, own, 1000);
    expect_sound(weights, own);
    EXPECT_EQ(weights[4].handle, (std::array<std::uint16_t, 4>{4, 3, 5, 2})) << "of 2 and 6, as near, the lower one";
}

TEST(SmoothWeights, LeaveIsolatedVerticesAlone) {
    auto patch = grid(2, 2, 10);
    patch.positions.push_back({5, 5, 0});
    const auto weights = weights_on(patch, {0, 1, 0, 1, 3}, 100);
    EXPECT_EQ(weights[4], alone(3));
    EXPECT_GT(weights[0].weight[1], 0);
}

TEST(SmoothWeights, DoNotCrossGapsBetweenComponents) {
    auto patch = grid(2, 2, 10);
    const auto count = static_cast<std::uint32_t>(patch.positions.size());
    for (std::uint32_t v = 0; v < count; ++v) patch.positions.push_back(patch.positions[v]);
    for (std::size_t t = 0; t < 2; ++t) {
        const auto& own = patch.triangles[t];
        patch.triangles.push_back({own[0] + count, own[1] + count, own[2] + count});
    }
    const auto weights = weights_on(patch, {0, 0, 0, 0, 1, 1, 1, 1}, 100);
    EXPECT_EQ(weights, (HandleWeights{alone(0), alone(0), alone(0), alone(0), alone(1), alone(1), alone(1), alone(1)}));
}

TEST(SmoothWeights, AreSoundOnHostileMeshesForAnyNumberOfThreads) {
    std::mt19937 random(11);
    for (int round = 0; round < 300; ++round) {
        const std::uint32_t vertices = 1 + test::below(random, 60), handles = 1 + test::below(random, 12);
        const std::int32_t reach = round % 3 == 0 ? lattice_limit : round % 3 == 1 ? 100 : 1;
        Patch soup;
        Handles own;
        for (std::uint32_t v = 0; v < vertices; ++v) {
            soup.positions.push_back({test::between(random, -reach, reach), test::between(random, -reach, reach),
                                      test::between(random, -reach, reach)});
            own.push_back(static_cast<std::uint16_t>(round % 2 ? test::below(random, handles)
                                                               : 65535 - test::below(random, handles)));
        }
        for (std::uint32_t t = 0; t < test::below(random, 150); ++t)  // repeated corners and triangles, fans of many
            soup.triangles.push_back(
                {test::below(random, vertices), test::below(random, vertices), test::below(random, vertices)});
        for (const std::int32_t width : {1, 50, 5000, lattice_limit}) {
            const auto weights = weights_on(soup, own, width);
            expect_sound(weights, own);
            EXPECT_EQ(weights_on(soup, own, width, ThreadPool(5)), weights);
            std::reverse(soup.triangles.begin(), soup.triangles.end());
            EXPECT_EQ(weights_on(soup, own, width), weights) << "the order of the triangles does not matter";
        }
    }
}

TEST(SmoothWeights, AreExactShortestPathsAlthoughVerticesRememberFewHandles) {
    // Compared with the paths by Floyd and Warshall, on small random meshes with many handles.
    std::mt19937 random(12);
    for (int round = 0; round < 60; ++round) {
        const std::uint32_t n = 12;
        constexpr std::int32_t width = 400;
        Patch soup;
        Handles own;
        for (std::uint32_t v = 0; v < n; ++v) {
            soup.positions.push_back({test::between(random, 0, 60), test::between(random, 0, 60), 0});
            own.push_back(static_cast<std::uint16_t>(test::below(random, 7)));
        }
        for (int t = 0; t < 9; ++t)
            soup.triangles.push_back({test::below(random, n), test::below(random, n), test::below(random, n)});
        const std::int64_t far = 1 << 30;
        std::vector<std::vector<std::int64_t>> edge(n, std::vector<std::int64_t>(n, far)), path;
        for (const auto& t : soup.triangles)
            for (const auto a : t)
                for (const auto b : t)
                    edge[a][b] = std::max<std::int64_t>(
                        1, static_cast<std::int64_t>(
                               std::sqrt(static_cast<double>(squared_distance(soup.positions[a], soup.positions[b])))));
        path = edge;
        for (std::size_t v = 0; v < n; ++v) path[v][v] = 0;
        for (std::size_t k = 0; k < n; ++k)
            for (std::size_t a = 0; a < n; ++a)
                for (std::size_t b = 0; b < n; ++b) path[a][b] = std::min(path[a][b], path[a][k] + path[k][b]);
        const auto weights = weights_on(soup, own, width);
        for (std::size_t v = 0; v < n; ++v) {
            std::vector<std::pair<std::int64_t, std::uint16_t>> near;
            for (std::uint16_t h = 0; h < 7; ++h) {
                std::int64_t least = far;
                for (std::size_t a = 0; a < n; ++a)
                    for (std::size_t b = 0; b < n; ++b)
                        if (own[b] == h && a != b) least = std::min(least, 2 * path[v][a] + edge[a][b]);
                if (h != own[v] && least < width) near.emplace_back(least, h);
            }
            std::sort(near.begin(), near.end());
            near.resize(std::min<std::size_t>(near.size(), 3));
            std::int64_t sum = near.empty() ? 0 : width + near[0].first;
            for (const auto& [d, h] : near) sum += width - d;
            for (const auto& [d, h] : near) EXPECT_EQ(weight_of(weights[v], h), (width - d) * 4096 / sum);
        }
    }
}

}  // namespace
}  // namespace htvm::internal
