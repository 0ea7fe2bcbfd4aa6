#include "codec/reference/quantiser_cells.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <tuple>

#include "core/geometry.h"

namespace htvm::internal {
namespace {

// For each vertex the lowest one at its place.
std::vector<std::uint32_t> first_at_same_place(std::span<const LatticePoint> positions) {
    std::vector<std::uint32_t> order(positions.size()), out(positions.size());
    std::iota(order.begin(), order.end(), 0u);
    const auto key = [&](std::uint32_t v) { return std::tuple(positions[v].x, positions[v].y, positions[v].z, v); };
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
    for (std::size_t i = 0; i < order.size(); ++i) {
        const bool same = i > 0 && positions[order[i]] == positions[order[i - 1]];
        out[order[i]] = same ? out[order[i - 1]] : order[i];
    }
    return out;
}

using Triple = std::array<std::int64_t, 3>;
Triple triple(LatticePoint p) { return {p.x, p.y, p.z}; }

// The sum of what a vertex's neighbours have, once for each triangle that they share with it, and how often that is.
struct Surroundings {
    Triple sum{};
    std::int64_t count = 0;
};

// leader: whose surroundings are those of each vertex too; or empty, where each has its own.
std::vector<Surroundings> surroundings(std::span<const Triple> values, std::span<const Triangle> triangles,
                                       std::span<const std::uint32_t> leader) {
    std::vector<Surroundings> out(values.size());
    for (const auto& t : triangles)
        for (std::size_t i = 0; i < 3; ++i) {
            auto& of = out[leader.empty() ? t[i] : leader[t[i]]];
            for (const auto neighbour : {t[(i + 1) % 3], t[(i + 2) % 3]})
                for (std::size_t c = 0; c < 3; ++c) of.sum[c] += values[neighbour][c];
            of.count += 2;
        }
    for (std::size_t v = 0; v < leader.size(); ++v) out[v] = out[leader[v]];
    return out;
}

// The triangles that have one of the vertices that are marked.
std::vector<Triangle> triangles_at(std::span<const Triangle> triangles, const std::vector<std::uint8_t>& marked) {
    std::vector<Triangle> out;
    for (const auto& t : triangles)
        if ((marked[t[0]] | marked[t[1]] | marked[t[2]]) != 0) out.push_back(t);
    return out;
}

std::vector<Triple> triples(std::span<const LatticePoint> positions) {
    std::vector<Triple> out;
    out.reserve(positions.size());
    for (const auto p : positions) out.push_back(triple(p));
    return out;
}

LatticePoint moved_within(const Triple& from, const Triple& change, std::int64_t reach) {
    const auto moved = [&](std::size_t c) { return within_lattice(from[c] + std::clamp(change[c], -reach, reach)); };
    return {moved(0), moved(1), moved(2)};
}

}  // namespace

std::vector<LatticePoint> averaged_within_cells(std::span<const LatticePoint> positions,
                                                std::span<const Triangle> triangles, std::int32_t step) {
    std::vector<LatticePoint> out(positions.begin(), positions.end());
    const std::int64_t reach = step / 2;
    if (reach == 0) return out;
    const auto own = triples(positions);
    const auto around = surroundings(own, triangles, {});
    for (std::size_t v = 0; v < out.size(); ++v) {
        const auto& [sum, count] = around[v];
        if (count == 0) continue;
        Triple change;
        for (std::size_t c = 0; c < 3; ++c) change[c] = divide_rounded(sum[c] - count * own[v][c], 2 * count);
        out[v] = moved_within(own[v], change, reach);
    }
    return out;
}

std::vector<LatticePoint> smoothed_within_cells(std::span<const LatticePoint> positions,
                                                std::span<const Triangle> triangles, const QuantiserCells& cells) {
    constexpr std::int64_t share = 8;
    std::vector<LatticePoint> out(positions.begin(), positions.end());
    const std::int64_t reach = cells.step / 2;
    if (reach == 0) return out;
    const auto leader = cells.at_seams ? first_at_same_place(positions) : std::vector<std::uint32_t>{};
    // Little of a patched mesh moves: only the triangles there, and those around what bends there, are looked at.
    const bool in_part = cells.settled > 0 && !cells.at_seams;
    std::vector<Triangle> nearest, near;
    if (in_part) {
        std::vector<std::uint8_t> marked(positions.size(), 1);
        std::fill_n(marked.begin(), std::min<std::size_t>(cells.settled, marked.size()), std::uint8_t{0});
        nearest = triangles_at(triangles, marked);
        for (const auto& t : nearest)
            for (const auto v : t) marked[v] = 1;
        near = triangles_at(triangles, marked);
    }
    const auto moving = in_part ? std::span<const Triangle>(nearest) : triangles;
    const auto bending = in_part ? std::span<const Triangle>(near) : triangles;
    const auto own = triples(positions);
    auto around = surroundings(own, bending, leader);
    std::vector<Triple> bend(own.size(), Triple{});  // from each vertex to the mean of its neighbours
    for (std::size_t v = 0; v < own.size(); ++v)
        for (std::size_t c = 0; c < 3 && around[v].count > 0; ++c)
            bend[v][c] = divide_rounded(around[v].sum[c] - around[v].count * own[v][c], around[v].count);
    around = surroundings(bend, moving, leader);
    for (std::size_t v = cells.settled; v < out.size(); ++v) {
        const auto& [sum, count] = around[v];
        if (count == 0) continue;
        Triple change;
        for (std::size_t c = 0; c < 3; ++c) change[c] = divide_rounded(count * bend[v][c] - sum[c], share * count);
        out[v] = moved_within(own[v], change, reach);
    }
    return out;
}

}  // namespace htvm::internal
