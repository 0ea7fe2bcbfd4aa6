#include "geometry/oriented_points.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace htvm {
namespace {

bool finite(const Point3f& p) { return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]); }

float product(const Point3f& a, const Point3f& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

}  // namespace

OrientedPoints::OrientedPoints(std::span<const Point3f> points, std::span<const Point3f> normals, float cell)
    : side_(cell), per_side_(1 / cell) {
    mask_ = std::bit_ceil(static_cast<std::uint32_t>(std::max<std::size_t>(points.size() * 2, 64))) - 1;
    first_.assign(std::size_t{mask_} + 2, 0);
    std::vector<std::uint32_t> bucket(points.size());
    std::size_t kept = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!finite(points[i])) continue;
        bucket[i] = bucket_of(cell_of(points[i]));
        ++first_[bucket[i] + 1];
        ++kept;
    }
    for (std::size_t b = 1; b < first_.size(); ++b) first_[b] += first_[b - 1];
    entries_.resize(kept);
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t i = 0; i < points.size(); ++i)
        if (finite(points[i])) entries_[next[bucket[i]]++] = {points[i], normals[i], static_cast<std::uint32_t>(i)};
}

OrientedPoints::Cell OrientedPoints::cell_of(const Point3f& p) const {
    auto index = [&](float c) { return static_cast<std::int32_t>(std::floor(std::clamp(c * per_side_, -1e9f, 1e9f))); };
    return {index(p[0]), index(p[1]), index(p[2])};
}

std::uint32_t OrientedPoints::bucket_of(const Cell& cell) const {
    const std::uint32_t h = static_cast<std::uint32_t>(cell[0]) * 73856093u ^
                            static_cast<std::uint32_t>(cell[1]) * 19349663u ^
                            static_cast<std::uint32_t>(cell[2]) * 83492791u;
    return (h ^ (h >> 15)) & mask_;
}

OrientedMatch OrientedPoints::nearest(const Point3f& query, const Point3f& normal, float reach, float agreement) const {
    OrientedMatch best;
    if (entries_.empty() || !finite(query)) return best;
    best.squared_distance = reach * reach;
    const Cell middle = cell_of(query);
    auto look_at = [&](std::uint32_t begin, std::uint32_t end) {
        for (std::uint32_t e = begin; e < end; ++e) {
            const Entry& entry = entries_[e];
            const Point3f apart = {entry.point[0] - query[0], entry.point[1] - query[1], entry.point[2] - query[2]};
            const float d = product(apart, apart);
            if (d > best.squared_distance) continue;
            if (d == best.squared_distance && best.found && entry.index >= best.index) continue;
            if (entry.normal != Point3f{} && product(entry.normal, normal) < agreement) continue;
            best = {entry.index, d, true};
        }
    };
    auto look_into = [&](std::int32_t x, std::int32_t y, std::int32_t z) {
        const std::uint32_t bucket = bucket_of({x, y, z});
        look_at(first_[bucket], first_[bucket + 1]);
    };
    // Shells of cells around the query's own; cells that begin further away than the best so far are passed over.
    std::array<float, 3> low{};
    float inside = side_;
    for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::clamp(query[k] - static_cast<float>(middle[k]) * side_, 0.0f, side_);
        inside = std::min({inside, low[k], side_ - low[k]});
    }
    auto squared_gap = [&](std::size_t axis, std::int32_t offset) {
        if (offset == 0) return 0.0f;
        const float gap = offset > 0 ? static_cast<float>(offset) * side_ - low[axis]
                                     : low[axis] - static_cast<float>(offset + 1) * side_;
        return gap * gap;
    };
    for (std::int32_t shell = 0;; ++shell) {
        const float bound = static_cast<float>(shell - 1) * side_ + inside;
        if (shell > 0 && bound > 0 && bound * bound > best.squared_distance) break;
        const auto across = static_cast<std::uint64_t>(2 * shell + 1);
        if (across * across * across > 8 * entries_.size()) {  // so far from everything, it is quicker to try them all
            look_at(0, static_cast<std::uint32_t>(entries_.size()));
            break;
        }
        for (std::int32_t x = -shell; x <= shell; ++x) {
            const float gap_x = squared_gap(0, x);
            if (gap_x > best.squared_distance) continue;
            for (std::int32_t y = -shell; y <= shell; ++y) {
                const float gap_xy = gap_x + squared_gap(1, y);
                if (gap_xy > best.squared_distance) continue;
                const bool on_side = std::abs(x) == shell || std::abs(y) == shell;
                for (std::int32_t z = -shell; z <= shell; z += on_side || shell == 0 ? 1 : 2 * shell)
                    if (gap_xy + squared_gap(2, z) <= best.squared_distance)
                        look_into(middle[0] + x, middle[1] + y, middle[2] + z);
            }
        }
    }
    return best;
}

}  // namespace htvm
