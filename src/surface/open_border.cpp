#include "surface/open_border.h"

#include <algorithm>

#include "core/disjoint_sets.h"
#include "core/equal_floats.h"

namespace htvm::internal {
namespace {

std::uint64_t scattered(std::uint64_t x) {
    x ^= x >> 31;
    x *= 0x9E3779B97F4A7C15u;
    return x ^ (x >> 29);
}

// The vertices on a border, by place. Around a vertex inside, each side that leads away from it belongs to two
// triangles, however they face, so what both add cancels out.
std::vector<std::uint8_t> on_border(std::span<const Triangle> triangles, std::span<const std::uint32_t> place) {
    std::vector<std::uint64_t> left(place.size(), 0);
    for (const auto& t : triangles) {
        const Triangle at{place[t[0]], place[t[1]], place[t[2]]};
        if (at[0] == at[1] || at[1] == at[2] || at[2] == at[0]) continue;
        for (std::size_t i = 0; i < 3; ++i)
            left[at[i]] ^= scattered(at[(i + 1) % 3] + 1u) ^ scattered(at[(i + 2) % 3] + 1u);
    }
    std::vector<std::uint8_t> out(place.size());
    for (std::size_t v = 0; v < out.size(); ++v) out[v] = left[place[v]] != 0 ? 1 : 0;
    return out;
}

}  // namespace

std::vector<std::uint8_t> edges_from_border(std::span<const Vector3f> positions, std::span<const Triangle> triangles) {
    const auto place = first_equal(positions);
    const auto border = on_border(triangles, place);
    std::vector<std::uint8_t> out(positions.size(), far_from_border);
    for (std::size_t v = 0; v < out.size(); ++v)
        if (border[v] != 0) out[place[v]] = 0;
    for (std::uint8_t ring = 0; ring + 1 < far_from_border; ++ring)
        for (const auto& t : triangles) {
            const Triangle at{place[t[0]], place[t[1]], place[t[2]]};
            if (out[at[0]] != ring && out[at[1]] != ring && out[at[2]] != ring) continue;
            for (const auto v : at) out[v] = std::min<std::uint8_t>(out[v], ring + 1);
        }
    for (std::size_t v = 0; v < out.size(); ++v) out[v] = out[place[v]];
    return out;
}

double share_on_border(std::span<const Vector3f> positions, std::span<const Triangle> triangles) {
    const auto border = on_border(triangles, first_equal(positions));
    std::vector<std::uint8_t> used(positions.size(), 0);
    for (const auto& t : triangles)
        for (const auto v : t) used[v] = 1;
    std::size_t all = 0, open = 0;
    for (std::size_t v = 0; v < used.size(); ++v) {
        all += used[v];
        open += used[v] != 0 && border[v] != 0 ? 1 : 0;
    }
    return all == 0 ? 0 : static_cast<double>(open) / static_cast<double>(all);
}

Openness openness_of(std::span<const Vector3f> positions, std::span<const Triangle> triangles) {
    constexpr double open = 0.02;             // share of the vertices on a border
    constexpr double piece = 1.0 / 400;       // of the area: a hand is twice as large, a speck a tenth
    constexpr std::size_t fewest_pieces = 5;  // a person, another one, a chair, a ball are four
    const auto is_wrong = [&](const Triangle& t) { return std::ranges::max(t) >= positions.size(); };
    if (std::ranges::any_of(triangles, is_wrong)) return Openness::closed;
    if (share_on_border(positions, triangles) > open) return Openness::bordered;
    const auto place = first_equal(positions);
    DisjointSets pieces(positions.size());
    std::vector<double> area(positions.size(), 0);
    double all = 0;
    for (const auto& t : triangles) pieces.join(place[t[0]], place[t[1]]), pieces.join(place[t[1]], place[t[2]]);
    for (const auto& t : triangles) {
        const double own = length(area_vector(positions, t));
        area[pieces.of(place[t[0]])] += own;
        all += own;
    }
    const auto large = std::ranges::count_if(area, [&](double a) { return a > piece * all; });
    return static_cast<std::size_t>(large) >= fewest_pieces ? Openness::in_pieces : Openness::closed;
}

}  // namespace htvm::internal
