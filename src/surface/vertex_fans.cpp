#include "surface/vertex_fans.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "core/parallel.h"

namespace htvm::internal {
namespace {

// An always_inline function is compiled into each of the functions at the end of this file that name an instruction
// set.
constexpr std::size_t lanes = VertexFan::lanes;
constexpr float infinite = std::numeric_limits<float>::infinity();

// Eight lanes. The compilers' own vectors: operators work lane by lane, and become as many instructions as the
// processor needs for eight.
using Floats [[gnu::vector_size(32)]] = float;
using Whole [[gnu::vector_size(32)]] = std::int32_t;

[[gnu::always_inline]] inline Floats lanes_of(const std::array<float, lanes>& values) {
    Floats out;
    std::memcpy(&out, values.data(), sizeof out);
    return out;
}

[[gnu::always_inline]] inline Whole lanes_of(const std::array<std::uint32_t, lanes>& values) {
    Whole out;
    std::memcpy(&out, values.data(), sizeof out);
    return out;
}

[[gnu::always_inline]] inline Whole bits_of(Floats values) {
    Whole out;
    std::memcpy(&out, &values, sizeof out);
    return out;
}

// The value of the lane behind; of the last one, that of the first.
[[gnu::always_inline]] inline Floats of_next_lane(Floats values) {
    return __builtin_shufflevector(values, values, 1, 2, 3, 4, 5, 6, 7, 0);
}

[[gnu::always_inline]] inline Floats least_of(Floats a, Floats b) { return a < b ? a : b; }

// The lane of the least distance, and that distance but for its last three bits, which make room for the number of the
// lane: squared distances are never negative, and have the order of their bits.
[[gnu::always_inline]] inline NearInFan nearest_lane(Floats squared) {
    constexpr Whole numbers = {0, 1, 2, 3, 4, 5, 6, 7};
    const Whole keys = (bits_of(squared) & ~7) | numbers;
    const Whole halves = __builtin_shufflevector(keys, keys, 4, 5, 6, 7, 0, 1, 2, 3),
                four = keys < halves ? keys : halves;
    const Whole pairs = __builtin_shufflevector(four, four, 2, 3, 0, 1, 6, 7, 4, 5), two = four < pairs ? four : pairs;
    const Whole single = __builtin_shufflevector(two, two, 1, 0, 3, 2, 5, 4, 7, 6), one = two < single ? two : single;
    const auto key = static_cast<std::uint32_t>(one[0]);
    return {key & 7, std::bit_cast<float>(key & ~7U)};
}

[[gnu::always_inline]] inline FanWalk walk(std::span<const VertexFan> fans, const Vector3f& query, std::uint32_t from,
                                           float squared_distance) {
    for (;;) {
        const VertexFan& fan = fans[from];
        if (!fan.regular()) return {from, false};
        const Floats x = lanes_of(fan.x) - query[0], y = lanes_of(fan.y) - query[1], z = lanes_of(fan.z) - query[2];
        const auto near = nearest_lane(x * x + y * y + z * z);
        if (!(near.squared_distance < squared_distance)) return {from, true};
        from = fan.neighbour[near.lane];
        squared_distance = near.squared_distance;
    }
}

[[gnu::always_inline]] inline void walk_all(std::span<const VertexFan> fans, std::span<const Vector3f> queries,
                                            float within, std::span<std::uint32_t> from) {
    constexpr std::size_t side_by_side = 8;
    struct Walk {
        std::size_t query;
        float squared_distance;
    };
    std::array<Walk, side_by_side> walks;
    const auto expect = [&](std::size_t begin) {
        for (std::size_t i = begin; i < std::min(begin + side_by_side, from.size()); ++i)
            if (from[i] < fans.size()) fans[from[i]].expect();
    };
    expect(0);
    for (std::size_t begin = 0; begin < from.size(); begin += side_by_side) {
        expect(begin + side_by_side);
        std::size_t going = 0;
        for (std::size_t i = begin; i < std::min(begin + side_by_side, from.size()); ++i) {
            if (from[i] >= fans.size()) continue;
            const auto &own = fans[from[i]].own, &query = queries[i];
            const float x = own[0] - query[0], y = own[1] - query[1], z = own[2] - query[2];
            const float squared_distance = x * x + y * y + z * z;
            if (squared_distance < within) walks[going++] = {i, squared_distance};
        }
        while (going > 0) {
            std::size_t go_on = 0;
            for (std::size_t k = 0; k < going; ++k) {
                auto walk = walks[k];
                const VertexFan& fan = fans[from[walk.query]];
                if (!fan.regular()) continue;
                const auto& query = queries[walk.query];
                const Floats x = lanes_of(fan.x) - query[0], y = lanes_of(fan.y) - query[1],
                             z = lanes_of(fan.z) - query[2];
                const auto near = nearest_lane(x * x + y * y + z * z);
                if (!(near.squared_distance < walk.squared_distance)) continue;
                from[walk.query] = fan.neighbour[near.lane];
                fans[from[walk.query]].expect();
                walk.squared_distance = near.squared_distance;
                walks[go_on++] = walk;
            }
            going = go_on;
        }
    }
}

// How far from the vertex, as a share of the way, the place on a side is that is nearest to the query: how far the
// query lies along the side, by the side's squared length.
[[gnu::always_inline]] inline Floats along_side(Floats product, Floats squared_length) {
    const Floats share = squared_length > 0 ? product / squared_length : Floats{};
    const Floats above = share > 0 ? share : Floats{};
    return above < 1 ? above : Floats{} + 1;
}

// All is seen from the vertex: b and c are the other corners, q is the query. Only the distance of a triangle's
// nearest point is found, which the products of these tell.
[[gnu::always_inline]] inline NearInFan nearest(const VertexFan& fan, const Vector3f& query, const Facing* facing) {
    constexpr Whole numbers = {0, 1, 2, 3, 4, 5, 6, 7};
    const auto& own = fan.own;
    const float qx = query[0] - own[0], qy = query[1] - own[1], qz = query[2] - own[2];
    const float qq = qx * qx + qy * qy + qz * qz;
    const Floats bx = lanes_of(fan.x) - own[0], by = lanes_of(fan.y) - own[1], bz = lanes_of(fan.z) - own[2];
    const Floats cx = of_next_lane(bx), cy = of_next_lane(by), cz = of_next_lane(bz);
    const Floats bb = bx * bx + by * by + bz * bz, cc = of_next_lane(bb);
    const Floats bq = bx * qx + by * qy + bz * qz, cq = of_next_lane(bq);
    const Floats bc = bx * cx + by * cy + bz * cz;
    const Floats whole = bb * cc - bc * bc;
    const Floats v = cc * bq - bc * cq, w = bb * cq - bc * bq, u = whole - v - w;
    const Floats share_b = along_side(bq, bb), to_b = qq - share_b * (2 * bq - share_b * bb);
    const Floats rim = bb + cc - 2 * bc, rim_q = cq - bq - bc + bb, share_rim = along_side(rim_q, rim);
    const Floats to_rim = qq - 2 * bq + bb - share_rim * (2 * rim_q - share_rim * rim);
    const Floats to_sides = least_of(least_of(to_b, of_next_lane(to_b)), to_rim);
    const Floats to_plane = qq - (v * bq + w * cq) / whole;
    const Whole within = (u >= 0) & (v >= 0) & (w >= 0) & (whole > 1e-4F * bb * cc);
    Floats squared = within ? to_plane : to_sides;
    squared = squared > 0 ? squared : Floats{};
    Whole may = numbers < static_cast<std::int32_t>(fan.triangles);
    if (facing) {
        const auto& n = facing->normal;
        const Floats along = (by * cz - bz * cy) * n[0] + (bz * cx - bx * cz) * n[1] + (bx * cy - by * cx) * n[2];
        // Squared, with their signs, since what a triangle's normal is longer by is only known squared.
        const Floats faces = along * (along < 0 ? -along : along);
        const float least = facing->agreement * std::abs(facing->agreement);
        may &= (faces >= least * whole) & (whole > 0);
    }
    return nearest_lane(may ? squared : Floats{} + infinite);
}

// The triangles around a vertex: their corners after it, and their sides as in VertexFan. Lanes beyond their number
// hold `none` and nothing else does.
struct Row {
    static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
    std::array<std::uint32_t, lanes> next, last, side;
    std::uint32_t count = 0;
};

using Order = std::array<std::uint32_t, lanes>;

// The places of the row in the order of a fan; false if the triangles do not form one. Which triangle follows which is
// found for all at once and without branches, of which none could be foreseen.
[[gnu::always_inline]] inline bool find_order(const Row& row, Order& order) {
    constexpr std::int32_t nobody = lanes;
    const Whole next = lanes_of(row.next), last = lanes_of(row.last);
    Whole followers = Whole{} + nobody, leaders = followers;
    for (std::int32_t other = 0; other < nobody; ++other) {
        followers = last == static_cast<std::int32_t>(row.next[other]) ? Whole{} + other : followers;
        leaders = next == static_cast<std::int32_t>(row.last[other]) ? Whole{} + other : leaders;
    }
    std::array<std::int32_t, lanes> follower, leader;
    std::memcpy(follower.data(), &followers, sizeof followers);
    std::memcpy(leader.data(), &leaders, sizeof leaders);
    // Around a vertex on a border the fan begins with the triangle that follows none.
    std::int32_t at = 0;
    for (std::uint32_t i = row.count; i-- > 0;) at = leader[i] == nobody ? static_cast<std::int32_t>(i) : at;
    std::uint32_t seen = 0;
    for (std::uint32_t i = 0; i < row.count; ++i) {
        if (at == nobody) return false;
        order[i] = static_cast<std::uint32_t>(at);
        seen |= 1U << at;
        at = follower[static_cast<std::size_t>(at)];
    }
    return seen == (1U << row.count) - 1;
}

[[gnu::always_inline]] inline void set_fan(std::span<const Vector3f> positions, std::span<const Triangle> triangles,
                                           const TrianglesAround& triangles_around, std::uint32_t vertex,
                                           VertexFan& fan) {
    const auto around = triangles_around.of(vertex);
    fan.own = positions[vertex];
    fan.triangles = 0;
    const std::size_t count = around.size();
    if (count == 0 || count > lanes) return;
    Row row;
    row.count = static_cast<std::uint32_t>(count);
    for (std::size_t i = 0; i < lanes; ++i) row.next[i] = row.last[i] = Row::none - static_cast<std::uint32_t>(i);
    for (std::size_t i = 0; i < count; ++i) {
        const auto& t = triangles[around[i]];
        const std::uint32_t at = t[0] == vertex ? 0 : t[1] == vertex ? 1 : 2;
        row.side[i] = 3 * around[i] + at;
        row.next[i] = t[(at + 1) % 3];
        row.last[i] = t[(at + 2) % 3];
    }
    Order order;
    if (!find_order(row, order)) return;
    const auto end = row.last[order[count - 1]];
    // Eight triangles have nine neighbours in a fan that is open, or that is not the only one here.
    if (count == lanes && end != row.next[order[0]]) return;
    fan.triangles = row.count;
    for (std::size_t i = 0; i < lanes; ++i) {
        const bool inside = i < count;
        const auto place = order[inside ? i : 0];
        fan.side[i] = row.side[place];
        fan.neighbour[i] = inside ? row.next[place] : end;
        const auto& p = positions[fan.neighbour[i]];
        fan.x[i] = p[0], fan.y[i] = p[1], fan.z[i] = p[2];
    }
}

#ifdef __x86_64__

[[gnu::target("avx2")]] void set_fan_by_avx2(std::span<const Vector3f> positions, std::span<const Triangle> triangles,
                                             const TrianglesAround& around, std::uint32_t vertex, VertexFan& fan) {
    set_fan(positions, triangles, around, vertex, fan);
}
[[gnu::target("avx2")]] FanWalk walk_by_avx2(std::span<const VertexFan> fans, const Vector3f& query, std::uint32_t from,
                                             float squared_distance) {
    return walk(fans, query, from, squared_distance);
}
[[gnu::target("avx2")]] void walk_all_by_avx2(std::span<const VertexFan> fans, std::span<const Vector3f> queries,
                                              float within, std::span<std::uint32_t> from) {
    walk_all(fans, queries, within, from);
}
[[gnu::target("avx2")]] NearInFan nearest_by_avx2(const VertexFan& fan, const Vector3f& query, const Facing* facing) {
    return nearest(fan, query, facing);
}

#endif

}  // namespace

const FanSearches& portable_fan_searches() {
    static const FanSearches out = {set_fan, walk, walk_all, nearest};
    return out;
}

const FanSearches& fan_searches() {
#ifdef __x86_64__
    static const FanSearches by_avx2 = {set_fan_by_avx2, walk_by_avx2, walk_all_by_avx2, nearest_by_avx2};
    static const bool has_avx2 = __builtin_cpu_supports("avx2") > 0;
    if (has_avx2) return by_avx2;
#endif
    return portable_fan_searches();
}

VertexFans::VertexFans(std::span<const Vector3f> positions, std::span<const Vector3f> normals,
                       std::span<const Triangle> triangles, const TrianglesAround& around, Threads threads)
    : fans_(std::make_unique_for_overwrite<VertexFan[]>(positions.size())), count_(positions.size()) {
    parallel_for(count_, threads, 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
            searches_->set_fan(positions, triangles, around, static_cast<std::uint32_t>(v), fans_[v]);
            fans_[v].normal = normals[v];
        }
    });
}

}  // namespace htvm::internal
