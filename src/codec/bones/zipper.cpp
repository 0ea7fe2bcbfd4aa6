#include "codec/bones/zipper.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numeric>
#include <queue>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "codec/bones/zipper_surface.h"
#include "core/parallel.h"

namespace htvm::internal {
namespace {

using namespace zipping;

// In mean sides of the triangles of both meshes. Cover reaches far enough for typical prediction errors. A gap of at
// least half a triangle is left, so that no stitch is a sliver.
constexpr double cover_reach = 3, cover_clearance = 0.6, bridge_reach = 4, longest_stitch = 6;
constexpr int rings_beyond_still = 1;
// Bounds on the work for any stream, including untrusted ones.
constexpr int longest_filled = 64;          // edges of a hole
constexpr std::size_t most_at_vertex = 64;  // edges examined per vertex

struct Surface {
    std::span<const LatticePoint> positions;
    std::span<const Triangle> triangles;
};

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

// Normals of the vertices with wanted[v] != 0: the sum over the triangles around them, in their order, each weighted by
// twice its area. The entries of other vertices are meaningless.
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

// Mean length of the sides of all triangles; 0 if there are none.
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

// First part: decides which animated triangles stay, and finds the two borders that face each other across the gap.

// A side of a triangle, from its corner `side` to the next.
struct TriangleSide {
    std::uint32_t triangle = 0, side = 0;
};

struct Trimmed {
    std::vector<std::uint8_t> kept;          // one per animated triangle
    std::vector<TriangleSide> coded_seam;    // border sides of `coded` above the part that is still
    std::vector<TriangleSide> animated_cut;  // sides between a kept triangle and a dropped one, as sides of the kept
                                             // one
};

// The sides that no other triangle of `used` shares in either direction, sorted by triangle and side. Only sides
// between two vertices with chosen[v] != 0 are considered.
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
    std::vector<std::pair<std::uint32_t, TriangleSide>> sides(begin.back());  // the higher end, grouped by the lower
                                                                              // end
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

// For each triangle, one bit for each side that is listed; for each vertex, whether it is an end of such a side.
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

// The border of the whole animated mesh, restricted to what the triangles under the points need.
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

// The bounding box of all points, widened on every side.
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

// The parts of the two meshes that may be near each other.
struct Near {
    std::vector<std::uint32_t> coded, animated;  // indices of triangles
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

// The border sides of the listed triangles.
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

// The border sides of the coded mesh above the animated candidates; not those beyond an edge of the captured surface
// itself.
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

// Whether a point of the animated surface is covered by the inside of the coded surface, or by its border.
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

// Clears kept[t] of the listed triangles that are covered at a corner, or that are near the coded surface at the middle
// of a side or at the centre.
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

// Keeps only triangles that are connected, through sides, to a triangle with a still vertex away from the rim.
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
            // Each side is visited once, since then everything it leads to has been reached.
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

    const std::vector<std::uint8_t> at_rim = rim(animated, out.kept);
    std::vector<std::uint32_t> at_cut, kept_at_cut;
    for (std::uint32_t t = 0; t < out.kept.size(); ++t) {
        const Triangle& c = animated.triangles[t];
        if (at_rim[c[0]] + at_rim[c[1]] + at_rim[c[2]] < 2) continue;
        at_cut.push_back(t);
        if (out.kept[t]) kept_at_cut.push_back(t);
    }
    const auto before = [](TriangleSide a, TriangleSide b) {
        return a.triangle != b.triangle ? a.triangle < b.triangle : a.side < b.side;
    };
    const std::vector<TriangleSide> whole = border_sides(animated.triangles, at_cut, at_rim);
    const std::vector<TriangleSide> cut = border_sides(animated.triangles, kept_at_cut, at_rim);
    std::set_difference(cut.begin(), cut.end(), whole.begin(), whole.end(), std::back_inserter(out.animated_cut),
                        before);
    return out;
}

// Second part: closes the gap between the two borders with new triangles.

// One side of a border: the surface's triangle has it from `to` to `from`, a stitch has it from `from` to `to`.
struct BorderSide {
    std::uint32_t from = 0, to = 0;
    Direction normal;  // of the surface's triangle
};

struct Gap {
    std::vector<LatticePoint> positions;  // first the coded vertices, then the animated ones
    std::vector<Direction> normals;       // of vertices, any length; set for border vertices only
    std::uint32_t coded_vertices = 0;
    std::vector<BorderSide> coded, animated;
    std::vector<Triangle> around;    // all triangles of the surface that have at least two border vertices
    std::vector<std::uint32_t> cut;  // indices of the animated ones in `around`, ascending
    double unit = 1;                 // mean side length, in lattice units
};

Gap gap_between(const Surface& coded, const Surface& animated, const Trimmed& trimmed, double unit) {
    const auto first = static_cast<std::uint32_t>(coded.positions.size());
    Gap gap;
    gap.unit = unit;
    gap.coded_vertices = first;
    gap.positions.assign(coded.positions.begin(), coded.positions.end());
    gap.positions.insert(gap.positions.end(), animated.positions.begin(), animated.positions.end());
    std::vector<std::uint8_t> at_border(gap.positions.size());
    const auto sides = [&](const Surface& surface, std::span<const TriangleSide> from, std::uint32_t offset) {
        std::vector<BorderSide> out;
        for (const TriangleSide& s : from) {
            const Triangle& t = surface.triangles[s.triangle];
            const std::uint32_t a = t[s.side] + offset, b = t[(s.side + 1) % 3] + offset;
            at_border[a] = at_border[b] = 1;
            out.push_back({b, a, normal_of(surface.positions, t)});
        }
        return out;
    };
    gap.coded = sides(coded, trimmed.coded_seam, 0);
    gap.animated = sides(animated, trimmed.animated_cut, first);
    const std::span<const std::uint8_t> wanted(at_border);
    gap.normals = vertex_normals(coded.positions, coded.triangles, wanted.first(first));
    const std::vector<Direction> of_animated =
        vertex_normals(animated.positions, animated.triangles, wanted.subspan(first));
    gap.normals.insert(gap.normals.end(), of_animated.begin(), of_animated.end());
    const auto near = [&](const Triangle& t) { return at_border[t[0]] + at_border[t[1]] + at_border[t[2]] >= 2; };
    for (const Triangle& t : coded.triangles)
        if (near(t)) gap.around.push_back(t);
    for (std::size_t t = 0; t < trimmed.kept.size(); ++t) {
        if (!trimmed.kept[t]) continue;
        const Triangle& c = animated.triangles[t];
        const Triangle moved = {c[0] + first, c[1] + first, c[2] + first};
        if (!near(moved)) continue;
        gap.cut.push_back(static_cast<std::uint32_t>(gap.around.size()));
        gap.around.push_back(moved);
    }
    return gap;
}

std::uint64_t directed(std::uint32_t from, std::uint32_t to) { return std::uint64_t{from} << 32 | to; }

struct Edge {
    std::uint32_t from = 0, to = 0;
    std::uint32_t next = none, previous = none;
    bool open = true;
    Direction normal;
};

struct Corner {  // candidate triangle: an edge, and the corner at the end of `arriving`
    double cost = 0;
    std::uint32_t edge = 0, arriving = 0;
    auto key() const { return std::tuple(cost, edge, arriving); }
    bool operator>(const Corner& other) const { return key() > other.key(); }
};

// Grows with the angle from `from` to the other direction, counter-clockwise about the normal: 0 .. 4.
double turn(Direction normal, Direction from, Direction to) {
    const Direction left = cross(normal, from), ahead = cross(left, normal);
    const double x = dot(to, ahead), y = dot(to, left);
    const double size = std::abs(x) + std::abs(y);
    if (!(size > 0)) return 0;
    return y >= 0 ? 1 - x / size : 3 + x / size;
}

Direction unit_vector(Direction v) {
    const double length = std::sqrt(dot(v, v));
    return length > 0 ? Direction{v.x / length, v.y / length, v.z / length} : Direction{};
}

// The borders of the gap while it is being closed: edges with the gap on their left, linked into loops or open chains.
struct Front {
    std::span<const LatticePoint> positions;
    std::span<const Direction> normals;
    std::vector<Edge> edges;
    std::unordered_map<std::uint64_t, std::uint32_t> open;                   // open edges, by their two ends
    std::unordered_map<std::uint64_t, std::uint8_t> taken;                   // directed sides of the triangles near the
                                                                             // gap
    std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> arriving;  // edges, by the vertex where they end
    std::vector<Triangle> made;

    Direction normal_at(std::uint32_t v) const { return unit_vector(normals[v]); }
    Direction towards(std::uint32_t a, std::uint32_t b) const { return direction(positions[a], positions[b]); }

    void link(std::uint32_t a, std::uint32_t b) {
        if (a != none) edges[a].next = b;
        if (b != none) edges[b].previous = a;
    }

    void add_border(const BorderSide& side) {
        const auto id = static_cast<std::uint32_t>(edges.size());
        edges.push_back({side.from, side.to, none, none, true, side.normal});
        open.emplace(directed(side.from, side.to), id);
        arriving[side.to].push_back(id);
    }

    // At each vertex, every arriving edge is followed by the first leaving one, clockwise: the narrowest gap.
    void link_borders() {
        std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> leaving;
        for (std::uint32_t e = 0; e < edges.size(); ++e) leaving[edges[e].from].push_back(e);
        for (std::uint32_t e = 0; e < edges.size(); ++e) {
            const std::uint32_t v = edges[e].to;
            const auto at = leaving.find(v);
            if (at == leaving.end()) continue;
            std::uint32_t best = none;
            double widest = -1;
            std::size_t looked_at = 0;
            for (const std::uint32_t f : at->second) {
                if (++looked_at > most_at_vertex) break;
                if (edges[f].previous != none) continue;
                const double angle =
                    at->second.size() == 1 ? 0 : turn(normal_at(v), towards(v, edges[e].from), towards(v, edges[f].to));
                if (angle > widest) {
                    widest = angle;
                    best = f;
                }
            }
            if (best != none) link(e, best);
        }
    }

    // Whether the direction to z lies in the gap between two consecutive edges at their vertex.
    bool in_sector(std::uint32_t arrives, std::uint32_t leaves, std::uint32_t z) const {
        if (arrives == none || leaves == none) return true;
        const std::uint32_t v = edges[leaves].from, x = edges[arrives].from, y = edges[leaves].to;
        if (z == x || z == y) return true;
        const Direction normal = normal_at(v), first = towards(v, y);
        const double whole = turn(normal, first, towards(v, x)), part = turn(normal, first, towards(v, z));
        return whole == 0 || part <= whole;
    }

    // Whether the triangle on edge e, with its third corner where `arrives` ends, is allowed.
    bool allowed(std::uint32_t e, std::uint32_t arrives) const {
        const Edge& edge = edges[e];
        const std::uint32_t a = edge.from, b = edge.to, c = edges[arrives].to;
        if (a == c || b == c || taken.contains(directed(a, b)) || taken.contains(directed(b, c)) ||
            taken.contains(directed(c, a)))
            return false;
        return true;
    }
    bool well_shaped(std::uint32_t e, std::uint32_t arrives) const {
        const Edge& edge = edges[e];
        const std::uint32_t a = edge.from, b = edge.to, c = edges[arrives].to;
        const Direction normal = cross(towards(a, b), towards(a, c));
        if (!(dot(normal, edge.normal) > 0) || !(dot(normal, normals[a]) > 0) || !(dot(normal, normals[b]) > 0) ||
            !(dot(normal, normals[c]) > 0))
            return false;
        const std::uint32_t leaves = edges[arrives].next;
        return in_sector(edge.previous, e, c) && in_sector(e, edge.next, c) && in_sector(arrives, leaves, a) &&
               in_sector(arrives, leaves, b);
    }

    void close(std::uint32_t e) {
        edges[e].open = false;
        open.erase(directed(edges[e].from, edges[e].to));
    }

    std::uint32_t open_edge(std::uint32_t from, std::uint32_t to, Direction normal) {
        const auto id = static_cast<std::uint32_t>(edges.size());
        edges.push_back({from, to, none, none, true, normal});
        return id;
    }

    // A new edge that meets an existing one cancels with it.
    void settle(std::uint32_t e) {
        const std::uint32_t from = edges[e].from, to = edges[e].to;
        const auto other = open.find(directed(to, from));
        if (other != open.end()) {
            const std::uint32_t o = other->second;
            const std::uint32_t before = edges[e].previous, after = edges[e].next;
            const std::uint32_t other_before = edges[o].previous, other_after = edges[o].next;
            if (before != o) link(before, other_after);
            if (other_before != e) link(other_before, after);
            close(o);
            edges[e].open = false;
        } else if (taken.contains(directed(from, to))) {
            if (edges[e].previous != none) edges[edges[e].previous].next = none;
            if (edges[e].next != none) edges[edges[e].next].previous = none;
            edges[e].open = false;
        } else {
            open.emplace(directed(from, to), e);
            arriving[to].push_back(e);
        }
    }

    // Returns the two new edges, whether open or not.
    std::array<std::uint32_t, 2> add_triangle(std::uint32_t e, std::uint32_t arrives) {
        const std::uint32_t a = edges[e].from, b = edges[e].to, c = edges[arrives].to;
        const std::uint32_t before = edges[e].previous, after = edges[e].next, leaves = edges[arrives].next;
        made.push_back({a, b, c});
        taken[directed(a, b)] = taken[directed(b, c)] = taken[directed(c, a)] = 1;
        const Direction normal = cross(towards(a, b), towards(a, c));
        close(e);
        const std::uint32_t first = open_edge(a, c, normal), second = open_edge(c, b, normal);
        link(before, first);
        link(first, leaves);
        link(arrives, second);
        link(second, after);
        settle(second);
        settle(first);
        return {first, second};
    }
};

using Queue = std::priority_queue<Corner, std::vector<Corner>, std::greater<>>;

struct Zip {
    Front& front;
    const Gap& gap;
    bool both_sides = true;  // whether a stitch must have vertices of both meshes
    double longest = 0;      // squared, for new edges
    bool shaped = true;
    Queue queue;

    void push(std::uint32_t e) {
        if (e == none || !front.edges[e].open) return;
        const std::uint32_t n = front.edges[e].next;
        if (n == none) return;
        const std::uint32_t a = front.edges[e].from, b = front.edges[e].to, c = front.edges[n].to;
        const bool coded_a = a < gap.coded_vertices, coded_b = b < gap.coded_vertices, coded_c = c < gap.coded_vertices;
        if (both_sides && coded_a == coded_b && coded_b == coded_c) return;
        const double cost = static_cast<double>(squared_distance(gap.positions[a], gap.positions[c]));
        if (cost <= longest) queue.push({cost, e, n});
    }
    // Queues the corners that a change at an edge may open or close.
    void push_around(std::uint32_t e) {
        if (e == none || !front.edges[e].open) return;
        const std::uint32_t before = front.edges[e].previous;
        if (before != none) push(front.edges[before].previous);
        push(before);
        push(e);
        push(front.edges[e].next);
    }
    void add(std::uint32_t e, std::uint32_t arrives) {
        const std::uint32_t before = front.edges[e].previous, after = front.edges[arrives].next;
        const auto [first, second] = front.add_triangle(e, arrives);
        for (const std::uint32_t changed : {before, first, second, after}) push_around(changed);
    }
    void run() {
        while (!queue.empty()) {
            const Corner corner = queue.top();
            queue.pop();
            const std::uint32_t e = corner.edge;
            if (!front.edges[e].open || front.edges[e].next != corner.arriving) continue;
            if (!front.allowed(e, corner.arriving) || (shaped && !front.well_shaped(e, corner.arriving))) continue;
            add(e, corner.arriving);
        }
    }
};

// For each coded edge, the nearest vertices of the animated border, sorted by length.
std::vector<std::pair<double, std::array<std::uint32_t, 2>>> bridges(const Gap& gap, const Front& front) {
    const SurfaceGrid grid(gap.positions, gap.around, gap.cut, static_cast<std::int64_t>(bridge_reach * gap.unit) + 1);
    std::vector<std::pair<double, std::array<std::uint32_t, 2>>> out;
    for (std::uint32_t e = 0; e < gap.coded.size(); ++e) {
        const LatticePoint a = gap.positions[gap.coded[e].from], b = gap.positions[gap.coded[e].to];
        const SurfacePoint at = grid.nearest(middle(a, b), gap.coded[e].normal);
        if (at.triangle == none) continue;
        for (const std::uint32_t c : gap.around[at.triangle]) {
            if (!front.arriving.contains(c)) continue;
            const double cost = static_cast<double>(
                std::max(squared_distance(gap.positions[c], a), squared_distance(gap.positions[c], b)));
            out.push_back({cost, {e, c}});
        }
    }
    std::sort(out.begin(), out.end());
    return out;
}

void zip(const Gap& gap, Front& front) {
    Zip zipper{front, gap, true, longest_stitch * gap.unit * (longest_stitch * gap.unit), true, {}};
    for (const auto& [cost, bridge] : bridges(gap, front)) {
        const auto [e, c] = bridge;
        if (!front.edges[e].open || cost > zipper.longest) continue;
        const std::vector<std::uint32_t>& ends = front.arriving[c];
        std::uint32_t found = none;
        for (std::size_t i = 0; i < ends.size() && i < most_at_vertex && found == none; ++i)
            if (front.edges[ends[i]].open && front.allowed(e, ends[i]) && front.well_shaped(e, ends[i]))
                found = ends[i];
        if (found == none) continue;
        zipper.add(e, found);
        zipper.run();
    }
}

// Fills loops of at most longest_filled edges.
void fill(const Gap& gap, Front& front, bool shaped) {
    Zip filler{front, gap, false, 1e18, shaped, {}};
    std::vector<std::uint8_t> seen(front.edges.size());
    for (std::uint32_t e = 0; e < seen.size(); ++e) {
        if (!front.edges[e].open || seen[e]) continue;
        int length = 0;
        std::uint32_t at = e;
        do {
            seen[at] = 1;
            ++length;
            at = front.edges[at].next;
        } while (at != none && at != e && !seen[at]);
        if (at != e || length > longest_filled) continue;
        do {
            filler.push(at);
            at = front.edges[at].next;
        } while (at != e);
    }
    filler.run();
}

// The new triangles, in the order in which they are made.
std::vector<Triangle> stitch(const Gap& gap) {
    Front front;
    front.positions = gap.positions;
    front.normals = gap.normals;
    for (const BorderSide& side : gap.coded) front.add_border(side);
    for (const BorderSide& side : gap.animated) front.add_border(side);
    for (const Triangle& t : gap.around)
        for (std::size_t i = 0; i < 3; ++i) front.taken[directed(t[i], t[(i + 1) % 3])] = 1;
    front.link_borders();
    zip(gap, front);
    fill(gap, front, true);
    fill(gap, front, false);
    return front.made;
}

// Third part: joins what is left of both surfaces and the stitches.

template <class Value>
void join_attribute(const std::vector<Value>& coded, const std::vector<Value>& animated, const LatticeMesh& from_coded,
                    const LatticeMesh& from_animated, std::span<const std::uint32_t> used, std::vector<Value>& out) {
    if (coded.size() != from_coded.positions.size() || animated.size() != from_animated.positions.size()) return;
    out = coded;
    out.reserve(coded.size() + used.size());
    for (const std::uint32_t v : used) out.push_back(animated[v]);
}

// The coded mesh, the kept part of the animated one, and the stitches; animated vertices are numbered after coded ones.
LatticeMesh join(const LatticeMesh& coded, const LatticeMesh& animated, std::span<const std::uint8_t> kept,
                 std::span<const Triangle> stitches) {
    const auto first = static_cast<std::uint32_t>(coded.positions.size());
    std::vector<std::uint32_t> number(animated.positions.size(), none), used;
    for (std::size_t t = 0; t < kept.size(); ++t)
        if (kept[t])
            for (const std::uint32_t v : animated.triangles[t]) number[v] = 0;
    for (std::uint32_t v = 0; v < number.size(); ++v)
        if (number[v] == 0) {
            number[v] = first + static_cast<std::uint32_t>(used.size());
            used.push_back(v);
        }
    LatticeMesh out;
    join_attribute(coded.positions, animated.positions, coded, animated, used, out.positions);
    join_attribute(coded.colours, animated.colours, coded, animated, used, out.colours);
    join_attribute(coded.normals, animated.normals, coded, animated, used, out.normals);
    join_attribute(coded.texcoords, animated.texcoords, coded, animated, used, out.texcoords);
    out.triangles = coded.triangles;
    out.triangles.reserve(coded.triangles.size() + animated.triangles.size() + stitches.size());
    for (std::size_t t = 0; t < kept.size(); ++t)
        if (kept[t]) {
            const Triangle& c = animated.triangles[t];
            out.triangles.push_back({number[c[0]], number[c[1]], number[c[2]]});
        }
    for (Triangle t : stitches) {
        for (std::uint32_t& v : t)
            if (v >= first) v = number[v - first];
        out.triangles.push_back(t);
    }
    return out;
}

}  // namespace

LatticeMesh zipper(const LatticeMesh& coded, const LatticeMesh& animated, std::span<const std::uint8_t> still,
                   Threads threads) {
    if (coded.triangles.empty())
        return join(coded, animated, std::vector<std::uint8_t>(animated.triangles.size(), 1), {});
    const Surface coded_surface{coded.positions, coded.triangles},
        animated_surface{animated.positions, animated.triangles};
    const double unit = mean_side(coded_surface, animated_surface);
    if (!(unit > 0)) return join(coded, animated, {}, {});
    const Trimmed trimmed = trim(coded_surface, animated_surface, still, unit, threads);
    return join(coded, animated, trimmed.kept, stitch(gap_between(coded_surface, animated_surface, trimmed, unit)));
}

std::vector<std::uint8_t> kept_by_zippering(const LatticeMesh& coded, const LatticeMesh& animated,
                                            std::span<const std::uint8_t> still, Threads threads) {
    const Surface coded_surface{coded.positions, coded.triangles},
        animated_surface{animated.positions, animated.triangles};
    const double unit = mean_side(coded_surface, animated_surface);
    if (coded.triangles.empty() || !(unit > 0)) return std::vector<std::uint8_t>(animated.triangles.size(), 1);
    return trim(coded_surface, animated_surface, still, unit, threads).kept;
}

}  // namespace htvm::internal
