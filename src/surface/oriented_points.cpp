#include "surface/oriented_points.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace htvm::internal {
namespace {

constexpr std::int32_t most_cell = 1 << 24;  // the cells at the ends hold all that is beyond

bool finite(const Point3f& p) { return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]); }

// The largest whole number that is not above x; for what is far out, or not a number, an end of the cells' range.
std::int32_t floor_of(float x) {
    if (!(x > -static_cast<float>(most_cell))) return -most_cell;
    if (x >= static_cast<float>(most_cell)) return most_cell;
    const auto whole = static_cast<std::int32_t>(x);
    return whole - (static_cast<float>(whole) > x ? 1 : 0);
}

float product(const Point3f& a, const Point3f& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

}  // namespace

OrientedPoints::OrientedPoints(std::span<const Point3f> points, std::span<const Point3f> normals, float cell)
    : side_(cell), per_side_(1 / cell) {
    mask_ = std::bit_ceil(static_cast<std::uint32_t>(std::max<std::size_t>(points.size() * 2, 64))) - 1;
    first_.assign(std::size_t{mask_} + 2, 0);
    std::vector<std::uint32_t> bucket(points.size());
    place_.assign(points.size(), no_point);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!finite(points[i])) continue;
        const std::int32_t z = cell_of(points[i][2]);
        bucket[i] = block_of(cell_of(points[i][0]), cell_of(points[i][1]), z >> 3) + static_cast<std::uint32_t>(z & 7);
        ++first_[bucket[i] + 1];
        ++kept;
    }
    for (std::size_t b = 1; b < first_.size(); ++b) first_[b] += first_[b - 1];
    entries_.resize(kept);
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!finite(points[i])) continue;
        place_[i] = next[bucket[i]]++;
        entries_[place_[i]] = {points[i], normals[i], static_cast<std::uint32_t>(i)};
    }
}

std::int32_t OrientedPoints::cell_of(float coordinate) const { return floor_of(coordinate * per_side_); }

// The first of the eight buckets of a block; z counts blocks.
std::uint32_t OrientedPoints::block_of(std::int32_t x, std::int32_t y, std::int32_t z) const {
    const std::uint32_t h = static_cast<std::uint32_t>(x) * 73856093u ^ static_cast<std::uint32_t>(y) * 19349663u ^
                            static_cast<std::uint32_t>(z) * 83492791u;
    return ((h ^ (h >> 15)) << 3) & mask_;
}

void OrientedPoints::look_at(std::uint32_t begin, std::uint32_t end, const Query& query, OrientedMatch& best) const {
    for (std::uint32_t e = begin; e < end; ++e) {
        const Entry& entry = entries_[e];
        const Point3f apart = {entry.point[0] - query.point[0], entry.point[1] - query.point[1],
                               entry.point[2] - query.point[2]};
        const float d = product(apart, apart);
        if (d > best.squared_distance) continue;
        if (d == best.squared_distance && best.found && entry.index >= best.index) continue;
        if (product(entry.normal, query.normal) < query.agreement && entry.normal != Point3f{}) continue;
        best = {entry.index, d, true};
    }
}

// All cells that are no further away than the radius, nor than the best so far. True where that was all points.
bool OrientedPoints::look_into_ball(float radius, const Query& query, OrientedMatch& best) const {
    const auto& p = query.point;
    const float rounding = 1e-6f * (side_ + std::abs(p[0]) + std::abs(p[1]) + std::abs(p[2]));
    Cell low{}, high{};
    double cells = 1;
    for (std::size_t k = 0; k < 3; ++k) {
        low[k] = cell_of(p[k] - radius - rounding);
        high[k] = cell_of(p[k] + radius + rounding);
        cells *= static_cast<double>(high[k]) - low[k] + 1;
    }
    if (cells > 8.0 * static_cast<double>(entries_.size())) {  // it is quicker to try them all
        look_at(0, static_cast<std::uint32_t>(entries_.size()), query, best);
        return true;
    }
    const auto squared_gap = [&](std::size_t axis, std::int32_t cell) {
        if (std::abs(cell) >= most_cell) return 0.0f;
        const float below = static_cast<float>(cell) * side_ - p[axis];
        const float gap = std::max({below - rounding, -below - side_ - rounding, 0.0f});
        return gap * gap;
    };
    for (std::int32_t x = low[0]; x <= high[0]; ++x) {
        const float gap_x = squared_gap(0, x);
        if (gap_x > best.squared_distance) continue;
        for (std::int32_t y = low[1]; y <= high[1]; ++y) {
            if (gap_x + squared_gap(1, y) > best.squared_distance) continue;
            for (std::int32_t z = low[2]; z <= high[2];) {
                const std::int32_t last = std::min(z | 7, high[2]);
                const std::uint32_t block = block_of(x, y, z >> 3);
                look_at(first_[block + static_cast<std::uint32_t>(z & 7)],
                        first_[block + static_cast<std::uint32_t>(last & 7) + 1], query, best);
                z = last + 1;
            }
        }
    }
    return false;
}

OrientedMatch OrientedPoints::nearest(const Point3f& query, const Point3f& normal, float reach, float agreement,
                                      std::uint32_t guess) const {
    OrientedMatch best;
    if (entries_.empty() || !finite(query)) return best;
    best.squared_distance = reach * reach;
    const Query wanted{query, normal, agreement};
    if (guess < place_.size() && place_[guess] != no_point) look_at(place_[guess], place_[guess] + 1, wanted, best);
    const std::int32_t z = cell_of(query[2]);
    const std::uint32_t own =
        block_of(cell_of(query[0]), cell_of(query[1]), z >> 3) + static_cast<std::uint32_t>(z & 7);
    look_at(first_[own], first_[own + 1], wanted, best);
    // Balls that double until the best lies within.
    for (float radius = 0.5f * side_;; radius *= 2) {
        const float bound = std::sqrt(best.squared_distance);
        const bool all = look_into_ball(std::min(radius, bound), wanted, best);
        if (all || radius >= bound || best.squared_distance <= radius * radius) break;
    }
    return best;
}

}  // namespace htvm::internal
