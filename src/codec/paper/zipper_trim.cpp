#include "codec/paper/zipper_trim.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/parallel.h"

namespace htvm::internal::zipping {
namespace {

// In mean sides. Wide enough for what prediction errors displace; a gap of at least half a triangle is left, so that no
// stitch is a sliver.
constexpr double cover_reach = 3, cover_clearance = 0.6;
constexpr int rings_beyond_still = 1;

bool degenerate(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

LatticePoint middle(LatticePoint a, LatticePoint b) {
    const auto half = [](std::int32_t p, std::int32_t q) {
        return static_cast<std::int32_t>(divide_rounded(p + q, 2));
    };
    return {half(a.x, b.x), half(a.y, b.y), half(a.z, b.z)};
}

LatticePoint centre(LatticePoint a, LatticePoint b, LatticePoint c) {
    const auto third = [](std::int32_t p, std::int32_t q, std::int32_t r) {
        return static_cast<std::int32_t>(divide_rounded(p + q + r, 3));
    };
    return {third(a.x, b.x, c.x), third(a.y, b.y, c.y), third(a.z, b.z, c.z)};
}

// The sides that no other triangle of `used` shares, in either direction, by triangle and side.
// Only sides between two vertices with chosen[v] != 0 are looked at.
std::vector<TriangleSide> border_sides(std::span<const Triangle> triangles, std::span<const std::uint32_t> used,
                                       std::span<const std::uint8_t> chosen) {
    std::vector<std::uint32_t> begin(chosen.size() + 2);
    const auto for_each_side = [&](const auto& visit) {
        for (const std::uint32_t t : used) {
            if (degenerate(triangles[t])) continue;
            for (std::uint32_t i = 0; i < 3; ++i) {
                const auto [low, high] = std::minmax(triangles[t][i], triangles[t][(i + 1) % 3]);
                if (chosen[low] && chosen[high]) visit(low, high, TriangleSide{t, i});
            }
        }
    };
    for_each_side([&](std::uint32_t low, std::uint32_t, TriangleSide) { ++begin[low + 2]; });
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::pair<std::uint32_t, TriangleSide>> sides(begin.back());  // the higher end, by lower end
    for_each_side([&](std::uint32_t low, std::uint32_t high, TriangleSide at) {
        sides[begin[low + 1]++] = {high, at};
    });
    std::vector<TriangleSide> out;
    for (std::size_t v = 0; v < chosen.size(); ++v) {
        const auto first = sides.begin() + begin[v], last = sides.begin() + begin[v + 1];
        std::sort(first, last, [](const auto& a, const auto& b) { return a.first < b.first; });
        for (auto side = first; side != last;) {
            const auto end = std::find_if(side, last, [&](const auto& other) { return other.first != side->first; });
            if (end - side == 1) out.push_back(side->second);
            side = end;
        }
    }
    std::sort(out.begin(), out.end(), [](TriangleSide a, TriangleSide b) {
        return a.triangle != b.triangle ? a.triangle < b.triangle : a.side < b.side;
    });
    return out;
}

// Per triangle, a bit for each side that is listed; per vertex, whether it ends such a side.
struct SideMarks {
    std::vector<std::uint8_t> sides, vertices;
    SideMarks(std::span<const Triangle> triangles, std::size_t count, std::span<const TriangleSide> listed)
        : sides(triangles.size()), vertices(count) {
        for (const TriangleSide& s : listed) {
            sides[s.triangle] = static_cast<std::uint8_t>(sides[s.triangle] | 1u << s.side);
            vertices[triangles[s.triangle][s.side]] = vertices[triangles[s.triangle][(s.side + 1) % 3]] = 1;
        }
    }
    bool holds(const SurfacePoint& at, std::span<const Triangle> triangles) const {
        if (at.side >= 0) return (sides[at.triangle] >> at.side & 1) != 0;
        return at.corner >= 0 && vertices[triangles[at.triangle][static_cast<std::size_t>(at.corner)]];
    }
};

// Triangles with a still vertex, and `rings` of triangles around them.
std::vector<std::uint8_t> candidates(const Surface& animated, std::span<const std::uint8_t> still, int rings) {
    std::vector<std::uint8_t> inside(animated.positions.size()), out(animated.triangles.size());
    for (std::size_t v = 0; v < inside.size(); ++v) inside[v] = v < still.size() && still[v] != 0;
    for (int ring = 0; ring <= rings; ++ring) {
        for (std::size_t t = 0; t < out.size(); ++t) {
            const Triangle& c = animated.triangles[t];
            out[t] = out[t] || inside[c[0]] || inside[c[1]] || inside[c[2]];
        }
        if (ring == rings) break;
        for (std::size_t t = 0; t < out.size(); ++t)
            if (out[t])
                for (const std::uint32_t v : animated.triangles[t]) inside[v] = 1;
    }
    return out;
}

// The border of the whole animated mesh, as far as it is needed for the triangles that the points lie on.
std::vector<TriangleSide> border_around(const Surface& animated, std::span<const SurfacePoint> points) {
    std::vector<std::uint8_t> own(animated.positions.size()), around(animated.positions.size());
    for (const SurfacePoint& p : points)
        if (p.triangle != none)
            for (const std::uint32_t v : animated.triangles[p.triangle]) own[v] = 1;
    std::vector<std::uint32_t> used;
    for (std::uint32_t t = 0; t < animated.triangles.size(); ++t) {
        const Triangle& c = animated.triangles[t];
        if (!own[c[0]] && !own[c[1]] && !own[c[2]]) continue;
        used.push_back(t);
        for (const std::uint32_t v : c) around[v] = 1;
    }
    return border_sides(animated.triangles, used, around);
}

// The box of all points, wider on every side.
Box widened_box(std::span<const LatticePoint> points, std::int64_t by) {
    if (points.empty()) return {};
    Box box{points[0], points[0]};
    for (const LatticePoint p : points) {
        box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y), std::min(box.low.z, p.z)};
        box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y), std::max(box.high.z, p.z)};
    }
    const auto d = static_cast<std::int32_t>(std::min<std::int64_t>(by, 4 * lattice_limit));
    return {box.low - LatticePoint{d, d, d}, box.high + LatticePoint{d, d, d}};
}

bool overlap(const Box& a, const Box& b) {
    return a.low.x <= b.high.x && b.low.x <= a.high.x && a.low.y <= b.high.y && b.low.y <= a.high.y &&
           a.low.z <= b.high.z && b.low.z <= a.high.z;
}

// The parts of both meshes that may be near each other.
struct Near {
    std::vector<std::uint32_t> coded, animated;  // triangles
};
Near near_each_other(const Surface& coded, const Surface& animated, std::span<const std::uint8_t> candidate,
                     std::int64_t reach) {
    Near out;
    const Box around = widened_box(coded.positions, 2 * cell_side(reach) + 1);
    std::vector<std::pair<std::uint32_t, Box>> boxes;
    CellFilter near_animated(reach), near_coded(reach);
    for (std::uint32_t t = 0; t < candidate.size(); ++t) {
        if (!candidate[t]) continue;
        const Box box = box_of(animated.positions, animated.triangles[t]);
        if (!overlap(box, around)) continue;
        boxes.push_back({t, box});
        near_animated.mark(box);
    }
    near_animated.widen();
    for (std::uint32_t t = 0; t < coded.triangles.size(); ++t) {
        const Box box = box_of(coded.positions, coded.triangles[t]);
        if (!near_animated.may_touch(box)) continue;
        out.coded.push_back(t);
        near_coded.mark(box);
    }
    near_coded.widen();
    for (const auto& [t, box] : boxes)
        if (near_coded.may_touch(box)) out.animated.push_back(t);
    return out;
}

// The border sides of the triangles listed.
std::vector<TriangleSide> border_of(const Surface& surface, std::span<const std::uint32_t> triangles) {
    std::vector<std::uint8_t> chosen(surface.positions.size());
    for (const std::uint32_t t : triangles)
        for (const std::uint32_t v : surface.triangles[t]) chosen[v] = 1;
    std::vector<std::uint32_t> used;
    for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
        const Triangle& c = surface.triangles[t];
        if (chosen[c[0]] + chosen[c[1]] + chosen[c[2]] >= 2) used.push_back(t);
    }
    return border_sides(surface.triangles, used, chosen);
}

// The coded border sides that lie over the animated candidates, not beyond an edge of the captured surface itself.
std::vector<TriangleSide> coded_seam_sides(const Surface& coded, const Surface& animated, const Near& near,
                                           std::int64_t reach, Threads threads) {
    const std::vector<TriangleSide> border = border_of(coded, near.coded);
    const SurfaceGrid grid(animated.positions, animated.triangles, near.animated, reach);
    std::vector<SurfacePoint> under(border.size());
    parallel_for(border.size(), threads, 128, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const Triangle& t = coded.triangles[border[k].triangle];
            const std::uint32_t a = t[border[k].side], b = t[(border[k].side + 1) % 3];
            under[k] = grid.nearest(middle(coded.positions[a], coded.positions[b]), normal_of(coded.positions, t));
        }
    });
    const SideMarks ends(animated.triangles, animated.positions.size(), border_around(animated, under));
    std::vector<TriangleSide> out;
    for (std::size_t k = 0; k < border.size(); ++k)
        if (under[k].triangle != none && !ends.holds(under[k], animated.triangles)) out.push_back(border[k]);
    return out;
}

// Whether a point of the animated surface has the inside of the coded surface, or its very border, over it.
struct Cover {
    const Surface& coded;
    const SurfaceGrid& grid;
    const SideMarks& seam;
    double clearance;  // squared
    // 0: nothing within reach; 1: only its border; 2: covered.
    int of(LatticePoint point, Direction facing) const {
        const SurfacePoint at = grid.nearest(point, facing);
        if (at.triangle == none) return 0;
        return seam.holds(at, coded.triangles) && !(at.squared_distance < clearance) ? 1 : 2;
    }
};

bool triangle_covered(const Surface& animated, std::uint32_t triangle, const Cover& cover) {
    const Triangle& t = animated.triangles[triangle];
    const LatticePoint a = animated.positions[t[0]], b = animated.positions[t[1]], c = animated.positions[t[2]];
    const Direction facing = normal_of(animated.positions, t);
    return cover.of(centre(a, b, c), facing) == 2 || cover.of(middle(a, b), facing) == 2 ||
           cover.of(middle(b, c), facing) == 2 || cover.of(middle(c, a), facing) == 2;
}

// Clears kept[t] of the listed triangles that are covered at a corner, or near the coded surface at the middle of a
// side or at the centre.
void drop_covered(const Surface& animated, std::span<const std::uint32_t> triangles, const Cover& cover,
                  Threads threads, std::vector<std::uint8_t>& kept) {
    std::vector<std::uint8_t> listed(animated.positions.size()), covered(animated.positions.size());
    for (const std::uint32_t t : triangles)
        for (const std::uint32_t v : animated.triangles[t]) listed[v] = 1;
    const std::vector<Direction> normals = vertex_normals(animated.positions, animated.triangles, listed);
    parallel_for(covered.size(), threads, 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v)
            if (listed[v]) covered[v] = static_cast<std::uint8_t>(cover.of(animated.positions[v], normals[v]));
    });
    parallel_for(triangles.size(), threads, 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const Triangle& t = animated.triangles[triangles[k]];
            const int most = std::max({covered[t[0]], covered[t[1]], covered[t[2]]});
            if (most == 2 || (most == 1 && triangle_covered(animated, triangles[k], cover))) kept[triangles[k]] = 0;
        }
    });
}

// Leaves in `kept` only what hangs together, through sides, with a triangle that has a still vertex away from the rim.
void drop_scraps(const Surface& animated, std::span<const std::uint8_t> still, std::span<const std::uint8_t> at_rim,
                 std::vector<std::uint8_t>& kept) {
    const auto anchored = [&](const Triangle& t) {
        return std::any_of(t.begin(), t.end(),
                           [&](std::uint32_t v) { return v < still.size() && still[v] != 0 && !at_rim[v]; });
    };
    std::vector<std::uint32_t> loose;
    std::vector<std::uint8_t> near(animated.positions.size());
    for (std::uint32_t t = 0; t < kept.size(); ++t)
        if (kept[t] && !anchored(animated.triangles[t])) {
            loose.push_back(t);
            for (const std::uint32_t v : animated.triangles[t]) near[v] = 1;
        }
    if (loose.empty()) return;
    struct Side {
        std::uint64_t ends;
        std::uint32_t triangle;
    };
    std::vector<Side> sides;
    std::vector<std::uint32_t> reached;
    for (std::uint32_t t = 0; t < kept.size(); ++t) {
        const Triangle& c = animated.triangles[t];
        if (!kept[t] || near[c[0]] + near[c[1]] + near[c[2]] < 2) continue;
        for (std::size_t i = 0; i < 3; ++i) {
            const auto [low, high] = std::minmax(c[i], c[(i + 1) % 3]);
            if (near[low] && near[high] && low != high) sides.push_back({std::uint64_t{low} << 32 | high, t});
        }
        if (anchored(c)) reached.push_back(t);
    }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
        return a.ends != b.ends ? a.ends < b.ends : a.triangle < b.triangle;
    });
    for (const std::uint32_t t : loose) kept[t] = 0;
    while (!reached.empty()) {
        const Triangle c = animated.triangles[reached.back()];
        reached.pop_back();
        for (std::size_t i = 0; i < 3; ++i) {
            const auto [low, high] = std::minmax(c[i], c[(i + 1) % 3]);
            const std::uint64_t ends = std::uint64_t{low} << 32 | high;
            auto side = std::lower_bound(sides.begin(), sides.end(), ends,
                                         [](const Side& s, std::uint64_t wanted) { return s.ends < wanted; });
            // A side is walked over once: what it leads to is reached then.
            for (; side != sides.end() && side->ends == ends && side->triangle != none; ++side) {
                if (!kept[side->triangle]) {
                    kept[side->triangle] = 1;
                    reached.push_back(side->triangle);
                }
                side->triangle = none;
            }
        }
    }
}

std::vector<std::uint8_t> rim(const Surface& animated, std::span<const std::uint8_t> kept) {
    std::vector<std::uint8_t> of(animated.positions.size());  // bit 0: of a kept triangle, bit 1: of a dropped one
    for (std::size_t t = 0; t < kept.size(); ++t)
        for (const std::uint32_t v : animated.triangles[t])
            of[v] = static_cast<std::uint8_t>(of[v] | (kept[t] ? 1 : 2));
    for (std::uint8_t& v : of) v = v == 3;
    return of;
}

}  // namespace

std::vector<Direction> vertex_normals(std::span<const LatticePoint> positions, std::span<const Triangle> triangles,
                                      std::span<const std::uint8_t> wanted) {
    std::vector<Direction> out(positions.size());
    for (const Triangle& t : triangles) {
        if (!wanted[t[0]] && !wanted[t[1]] && !wanted[t[2]]) continue;
        const Direction n = normal_of(positions, t);
        for (const std::uint32_t v : t) out[v] = out[v] + n;
    }
    return out;
}

double mean_side(const Surface& coded, const Surface& animated) {
    double sum = 0;
    std::size_t count = 0;
    for (const Surface* surface : {&coded, &animated})
        for (const Triangle& t : surface->triangles) {
            for (std::size_t i = 0; i < 3; ++i)
                sum += std::sqrt(static_cast<double>(
                    squared_distance(surface->positions[t[i]], surface->positions[t[(i + 1) % 3]])));
            count += 3;
        }
    return count == 0 ? 0 : sum / static_cast<double>(count);
}

Trimmed trim(const Surface& coded, const Surface& animated, std::span<const std::uint8_t> still, double unit,
             Threads threads) {
    const auto reach = static_cast<std::int64_t>(cover_reach * unit) + 1;
    Trimmed out;
    out.kept = candidates(animated, still, rings_beyond_still);
    const Near near = near_each_other(coded, animated, out.kept, reach);
    out.coded_seam = coded_seam_sides(coded, animated, near, reach, threads);
    const SideMarks seam(coded.triangles, coded.positions.size(), out.coded_seam);
    const SurfaceGrid grid(coded.positions, coded.triangles, near.coded, reach);
    const Cover cover{coded, grid, seam, cover_clearance * unit * (cover_clearance * unit)};
    drop_covered(animated, near.animated, cover, threads, out.kept);
    drop_scraps(animated, still, rim(animated, out.kept), out.kept);

    out.at_rim = rim(animated, out.kept);
    std::vector<std::uint32_t> at_cut, kept_at_cut;
    for (std::uint32_t t = 0; t < out.kept.size(); ++t) {
        const Triangle& c = animated.triangles[t];
        if (out.at_rim[c[0]] + out.at_rim[c[1]] + out.at_rim[c[2]] < 2) continue;
        at_cut.push_back(t);
        if (out.kept[t]) kept_at_cut.push_back(t);
    }
    const auto before = [](TriangleSide a, TriangleSide b) {
        return a.triangle != b.triangle ? a.triangle < b.triangle : a.side < b.side;
    };
    const std::vector<TriangleSide> whole = border_sides(animated.triangles, at_cut, out.at_rim);
    const std::vector<TriangleSide> cut = border_sides(animated.triangles, kept_at_cut, out.at_rim);
    std::set_difference(cut.begin(), cut.end(), whole.begin(), whole.end(), std::back_inserter(out.animated_cut),
                        before);
    return out;
}

}  // namespace htvm::internal::zipping
