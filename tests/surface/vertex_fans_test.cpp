// Fans of triangles: what they find is what trying every neighbour and every triangle finds, with any instructions.
#include "surface/vertex_fans.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "surface/surface_index.h"

namespace htvm::internal {
namespace {

struct Sheet {
    std::vector<Vector3f> positions;
    std::vector<Triangle> triangles;
    TrianglesAround around;
    VertexFans fans;
};

// A bumpy sheet of side x side vertices, whose triangles are in an order by chance, each begun with a corner by chance;
// a tenth of them is missing.
Sheet sheet(std::uint32_t side, std::mt19937& random) {
    std::uniform_real_distribution<float> jitter(-3, 3);
    Sheet out;
    for (std::uint32_t y = 0; y < side; ++y)
        for (std::uint32_t x = 0; x < side; ++x)
            out.positions.push_back({10.0F * static_cast<float>(x) + jitter(random),
                                     10.0F * static_cast<float>(y) + jitter(random), jitter(random)});
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        Triangle t = {a, b, c};
        std::rotate(t.begin(), t.begin() + random() % 3, t.end());
        if (random() % 10 > 0) out.triangles.push_back(t);
    };
    for (std::uint32_t y = 0; y + 1 < side; ++y)
        for (std::uint32_t x = 0; x + 1 < side; ++x) {
            const std::uint32_t v = y * side + x;
            if (random() % 2 == 0)
                add(v, v + 1, v + side), add(v + 1, v + side + 1, v + side);
            else
                add(v, v + 1, v + side + 1), add(v, v + side + 1, v + side);
        }
    std::shuffle(out.triangles.begin(), out.triangles.end(), random);
    out.around = triangles_around(out.positions.size(), out.triangles);
    out.fans = VertexFans(out.positions, std::vector<Vector3f>(out.positions.size()), out.triangles, out.around, {});
    return out;
}

Vector3f somewhere(std::uint32_t side, std::mt19937& random) {
    std::uniform_real_distribution<float> along(0, 10.0F * static_cast<float>(side)), off(-8, 8);
    return {along(random), along(random), off(random)};
}

float squared(const Vector3f& a, const Vector3f& b) {
    const float x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

TEST(VertexFans, HaveTheTrianglesInTheOrderInWhichTheyFollowEachOther) {
    std::mt19937 random(1);
    const auto made = sheet(20, random);
    std::size_t regular = 0;
    for (std::uint32_t v = 0; v < made.positions.size(); ++v) {
        const auto& fan = made.fans[v];
        EXPECT_EQ(fan.own, made.positions[v]);
        if (!fan.regular()) continue;
        ++regular;
        std::vector<std::uint32_t> seen;
        for (std::uint32_t lane = 0; lane < fan.triangles; ++lane) {
            const auto& t = made.triangles[fan.side[lane] / 3];
            const auto corner = fan.side[lane] % 3;
            ASSERT_EQ(t[corner], v);
            ASSERT_EQ(t[(corner + 1) % 3], fan.neighbour[lane]);
            ASSERT_EQ(t[(corner + 2) % 3], fan.neighbour[(lane + 1) % VertexFan::lanes]);
            ASSERT_EQ(fan.place(lane), made.positions[fan.neighbour[lane]]);
            seen.push_back(fan.side[lane] / 3);
        }
        std::sort(seen.begin(), seen.end());
        const auto around = made.around.of(v);
        EXPECT_TRUE(std::equal(seen.begin(), seen.end(), around.begin(), around.end()));
    }
    EXPECT_GT(regular, made.positions.size() / 2);
    EXPECT_LT(regular, made.positions.size());  // some have a gap, or no triangle
}

TEST(VertexFans, OfMoreThanEightTrianglesOrOfSeveralFansAreNotRegular) {
    const auto wheel = [](std::uint32_t spokes, std::uint32_t left_out) {
        Sheet out;
        out.positions.assign(spokes + 1, {});
        for (std::uint32_t i = 0; i < spokes; ++i)
            if (i != left_out && i != left_out + 2) out.triangles.push_back({0, i + 1, (i + 1) % spokes + 1});
        out.around = triangles_around(out.positions.size(), out.triangles);
        return VertexFans(out.positions, out.positions, out.triangles, out.around, {})[0];
    };
    EXPECT_TRUE(wheel(8, 100).closed());
    EXPECT_TRUE(wheel(3, 100).closed());
    EXPECT_FALSE(wheel(9, 100).regular());
    EXPECT_FALSE(wheel(8, 2).regular());  // two fans
    EXPECT_TRUE(wheel(4, 2).regular());   // one with a gap
    EXPECT_FALSE(wheel(4, 2).closed());
    EXPECT_FALSE(wheel(0, 100).regular());
}

TEST(VertexFans, WalksEndWhereNoNeighbourIsNearer) {
    std::mt19937 random(2);
    const auto made = sheet(20, random);
    std::size_t ended = 0;
    for (int i = 0; i < 2000; ++i) {
        const auto query = somewhere(20, random);
        const auto from = static_cast<std::uint32_t>(random() % made.positions.size());
        const float least = squared(query, made.positions[from]);
        const auto walk = made.fans.walk(query, from, least);
        const float here = squared(query, made.positions[walk.vertex]);
        EXPECT_LE(here, least);
        EXPECT_EQ(walk.ended, made.fans[walk.vertex].regular());
        if (!walk.ended) continue;
        ++ended;
        for (const auto t : made.around.of(walk.vertex))
            for (const auto v : made.triangles[t]) EXPECT_GE(squared(query, made.positions[v]), here * 0.999999F);
    }
    EXPECT_GT(ended, 500u);
}

TEST(VertexFans, WalksSideBySideEndWhereEachWouldAlone) {
    std::mt19937 random(5);
    const auto made = sheet(20, random);
    const auto count = static_cast<std::uint32_t>(made.positions.size());
    constexpr float within = 60 * 60;
    for (const std::size_t walks : {0, 1, 7, 8, 9, 500}) {
        std::vector<Vector3f> queries;
        std::vector<std::uint32_t> from, expected;
        for (std::size_t i = 0; i < walks; ++i) {
            queries.push_back(somewhere(20, random));
            from.push_back(i % 10 == 9 ? count + static_cast<std::uint32_t>(random() % 3)
                                       : static_cast<std::uint32_t>(random() % count));
            expected.push_back(from.back());
            if (from.back() >= count) continue;
            const float least = squared(queries.back(), made.positions[from.back()]);
            if (least < within) expected.back() = made.fans.walk(queries.back(), from.back(), least).vertex;
        }
        made.fans.walk_all(queries, within, from);
        EXPECT_EQ(from, expected);
    }
}

TEST(VertexFans, FindTheTriangleThatTryingEachFinds) {
    std::mt19937 random(3);
    const auto made = sheet(12, random);
    const Facing up{{0, 0, 1}, 0.35F}, down{{0, 0, -1}, 0.35F};
    for (int i = 0; i < 3000; ++i) {
        const auto v = static_cast<std::uint32_t>(random() % made.positions.size());
        const auto& fan = made.fans[v];
        if (!fan.regular()) continue;
        std::uniform_real_distribution<float> off(-12, 12);
        const Vector3f query = {fan.own[0] + off(random), fan.own[1] + off(random), fan.own[2] + off(random)};
        float least = std::numeric_limits<float>::infinity();
        for (std::uint32_t lane = 0; lane < fan.triangles; ++lane)
            least = std::min(least, near_on_triangle(fan.own, fan.place(lane), fan.place((lane + 1) % 8), query,
                                                     std::numeric_limits<float>::infinity(), &up)
                                        .squared_distance);
        const auto near = made.fans.nearest(v, query, &up);
        if (!std::isfinite(least)) {
            EXPECT_EQ(near.squared_distance, least);
            continue;
        }
        EXPECT_NEAR(near.squared_distance, least, 1e-3F * (1 + least));
        const auto exact = near_on_triangle(fan.own, fan.place(near.lane), fan.place((near.lane + 1) % 8), query,
                                            std::numeric_limits<float>::infinity(), &up);
        EXPECT_NEAR(exact.squared_distance, least, 1e-3F * (1 + least));
        EXPECT_FALSE(std::isfinite(made.fans.nearest(v, query, &down).squared_distance));
        EXPECT_LE(made.fans.nearest(v, query, nullptr).squared_distance, near.squared_distance);
    }
}

// Which instructions a processor has must not decide what is encoded.
TEST(VertexFans, FindTheSameToTheBitWithAnyInstructions) {
    const auto &here = fan_searches(), &portable = portable_fan_searches();
    if (&here == &portable) GTEST_SKIP() << "this processor has no others";
    std::mt19937 random(4);
    const auto made = sheet(20, random);
    const auto count = static_cast<std::uint32_t>(made.positions.size());
    std::vector<VertexFan> fans(count), others(count);
    for (auto* all : {&fans, &others}) std::fill(all->begin(), all->end(), VertexFan{});
    for (std::uint32_t v = 0; v < count; ++v) {
        here.set_fan(made.positions, made.triangles, made.around, v, fans[v]);
        portable.set_fan(made.positions, made.triangles, made.around, v, others[v]);
        ASSERT_EQ(fans[v].triangles, others[v].triangles);
        ASSERT_EQ(fans[v].neighbour, others[v].neighbour);
        ASSERT_EQ(fans[v].side, others[v].side);
        ASSERT_EQ(fans[v].x, others[v].x);
    }
    std::vector<Vector3f> queries;
    std::vector<std::uint32_t> ends, other_ends;
    for (int i = 0; i < 500; ++i) {
        queries.push_back(somewhere(20, random));
        ends.push_back(static_cast<std::uint32_t>(random() % count));
    }
    other_ends = ends;
    here.walk_all(fans, queries, 1e6F, ends);
    portable.walk_all(fans, queries, 1e6F, other_ends);
    EXPECT_EQ(ends, other_ends);
    const Facing up{{0, 0, 1}, 0.35F};
    for (int i = 0; i < 5000; ++i) {
        const auto query = somewhere(20, random);
        const auto v = static_cast<std::uint32_t>(random() % count);
        const float least = squared(query, made.positions[v]);
        const auto walk = here.walk(fans, query, v, least), other_walk = portable.walk(fans, query, v, least);
        ASSERT_EQ(walk.vertex, other_walk.vertex);
        ASSERT_EQ(walk.ended, other_walk.ended);
        if (!fans[v].regular()) continue;
        for (const Facing* facing : {&up, static_cast<const Facing*>(nullptr)}) {
            const auto near = here.nearest(fans[v], query, facing);
            const auto other = portable.nearest(fans[v], query, facing);
            ASSERT_EQ(near.lane, other.lane);
            ASSERT_EQ(near.squared_distance, other.squared_distance);
        }
    }
}

}  // namespace
}  // namespace htvm::internal
