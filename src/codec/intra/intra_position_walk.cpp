#include "codec/intra/intra_position_walk.h"

#include <bit>

namespace htvm::internal {

namespace {

// 65536 / n, rounded. Means are taken of differences from a near point, so that the rounding does not show.
constexpr std::array<std::int64_t, row_limit + 1> reciprocals = [] {
    std::array<std::int64_t, row_limit + 1> r{};
    for (std::size_t n = 1; n <= row_limit; ++n)
        r[n] = (65536 + static_cast<std::int64_t>(n) / 2) / static_cast<std::int64_t>(n);
    return r;
}();

std::int64_t mean_of(std::int64_t sum, std::size_t count) { return (sum * reciprocals[count]) >> 16; }

Triple triple(LatticePoint p) { return {p.x, p.y, p.z}; }

// How many of the ascending thresholds lie below the value. Without an early way out: it is faster than a branch that
// is hard to predict.
template <std::size_t size>
std::size_t class_of(std::int64_t value, const std::array<std::int32_t, size>& thresholds) {
    const auto bounded = static_cast<std::int32_t>(std::min<std::int64_t>(value, 1 << 30));
    std::int32_t k = 0;
    for (const std::int32_t threshold : thresholds) k += bounded > threshold;
    return static_cast<std::size_t>(k);
}

// The features that come from the parallelograms; `base` is the point from which differences are taken.
void add_parallelograms(std::span<const LatticePoint> points, std::span<const Parallelogram> parallelograms,
                        LatticePoint base, const Triple& base_to_mean, PositionFeatures& out) {
    std::array<Triple, row_limit> at{};
    std::array<Triple, 2> sum{};  // ending, across
    std::array<std::size_t, 2> count{};
    Triple total{}, normal{};
    for (std::size_t i = 0; i < parallelograms.size(); ++i) {
        const Parallelogram& p = parallelograms[i];
        const LatticePoint opposite = points[p.opposite];
        const Triple a = triple(points[p.a] - opposite), b = triple(points[p.b] - opposite),
                     o = triple(opposite - base);
        for (std::size_t c = 0; c < 3; ++c) {
            at[i][c] = a[c] + b[c] + o[c];
            sum[p.across][c] += at[i][c];
            total[c] += at[i][c];
            const std::size_t d = (c + 1) % 3, e = (c + 2) % 3;
            normal[c] += b[d] * a[e] - b[e] * a[d];
        }
        ++count[p.across];
    }
    for (std::size_t c = 0; c < 3; ++c) {
        if (count[0] > 0) out.ending[c] = mean_of(16 * sum[0][c], count[0]) - base_to_mean[c];
        if (count[1] > 0) out.across[c] = mean_of(16 * sum[1][c], count[1]) - base_to_mean[c];
        const std::int64_t centre = mean_of(16 * total[c], parallelograms.size());
        for (std::size_t i = 0; i < parallelograms.size(); ++i) out.spread += std::abs(16 * at[i][c] - centre);
    }
    out.spread = mean_of(out.spread, parallelograms.size());
    const auto longest =
        static_cast<std::uint64_t>(std::max({std::abs(normal[0]), std::abs(normal[1]), std::abs(normal[2])}));
    const int excess = std::max(static_cast<int>(std::bit_width(longest)) - 27, 0);
    for (std::size_t c = 0; c < 3; ++c) out.normal[c] = normal[c] >> excess;
    out.parallelograms = parallelograms.size();
    out.has_ending = count[0] > 0;
}

}  // namespace

ResidualContext& PositionContexts::by_activity(std::size_t role, std::int64_t activity) {
    static constexpr std::array<std::int32_t, activities - 1> thresholds{5,   13,  26,  48,   80,  128,
                                                                         208, 320, 640, 1280, 3200};
    return activity_[role][class_of(activity, thresholds)];
}

ResidualContext& PositionContexts::by_shape(std::size_t role, const PositionFeatures& features, std::int64_t fraction) {
    std::int64_t extent = 0;
    for (std::size_t c = 0; c < 3; ++c)
        extent = std::max({extent, std::abs(features.across[c]), std::abs(features.ending[c])});
    const auto size = static_cast<std::size_t>(std::bit_width(static_cast<std::uint64_t>(extent) >> 4));
    const std::size_t count = std::min(features.parallelograms, counts - 1);
    const auto part = std::min(static_cast<std::size_t>(fraction) / 2, fractions - 1);
    return shape_[role][(count * fractions + part) * extents + std::min(size, extents - 1)];
}

PositionFeatures position_features(std::span<const LatticePoint> points, const Neighbours& neighbours, std::size_t rank,
                                   PositionHistory& history) {
    PositionFeatures out;
    const auto around = neighbours.neighbours_of(rank);
    auto& ring_mean = history.ring_mean[neighbours.order[rank]];
    if (around.empty()) {
        const Triple before = rank == 0 ? Triple{} : triple(points[neighbours.order[rank - 1]]);
        for (std::size_t c = 0; c < 3; ++c) {
            out.mean[c] = 16 * before[c];
            ring_mean[c] = static_cast<std::int32_t>(out.mean[c]);
        }
        return out;
    }
    const LatticePoint base = points[around[0]];
    Triple sum{}, outer{};
    for (const std::uint32_t v : around) {
        const Triple offset = triple(points[v] - base);
        for (std::size_t c = 0; c < 3; ++c) {
            sum[c] += offset[c];
            outer[c] += history.ring_mean[v][c] - history.ring_mean[around[0]][c];
        }
    }
    Triple base_to_mean;
    for (std::size_t c = 0; c < 3; ++c) {
        base_to_mean[c] = mean_of(16 * sum[c], around.size());
        out.mean[c] = 16 * triple(base)[c] + base_to_mean[c];
        ring_mean[c] = static_cast<std::int32_t>(out.mean[c]);
        out.outer[c] = history.ring_mean[around[0]][c] + mean_of(outer[c], around.size()) - out.mean[c];
    }
    const auto parallelograms = neighbours.parallelograms_of(rank);
    if (!parallelograms.empty()) add_parallelograms(points, parallelograms, base, base_to_mean, out);
    return out;
}

Triple predict_position(const PositionFeatures& features, const PositionWeights& weights) {
    constexpr std::int64_t reach = 32 * std::int64_t{lattice_limit};  // sixteenths: twice the lattice
    const auto& w = weights[features.has_ending];
    Triple predicted;
    for (std::size_t c = 0; c < 3; ++c) {
        std::int64_t offset = 0;
        if (features.parallelograms > 0)
            offset = (w[0] * features.across[c] + w[1] * features.ending[c] + w[2] * features.outer[c] + 32) >> 6;
        predicted[c] = std::clamp(features.mean[c] + offset, -reach, reach);
    }
    return predicted;
}

Activity activity_around(std::span<const std::uint32_t> around, const PositionHistory& history) {
    Activity sum;
    for (const std::uint32_t v : around) {
        sum.along += history.along[v];
        sum.across += history.across[v];
    }
    if (around.empty()) return sum;
    return {mean_of(sum.along, around.size()), mean_of(sum.across, around.size())};
}

}  // namespace htvm::internal
