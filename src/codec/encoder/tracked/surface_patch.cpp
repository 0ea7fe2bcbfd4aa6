#include "codec/encoder/tracked/surface_patch.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "codec/encoder/tracked/mesh_borders.h"
#include "codec/encoder/tracked/patch_join.h"
#include "core/disjoint_sets.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "surface/open_border.h"

// A patch is made in four steps:
//  1. Which vertices of the tracked mesh are lost (find_lost). The two surfaces are compared in both directions, since
//     either may be missing where the other is: a lost arm leaves a tracked arm where nothing was captured, and a
//     captured one where nothing is tracked.
//  2. What stays (Remainder) is made tidy, so that its open border is a set of plain chains.
//  3. The piece (cut_piece) is what of the captured surface lies outside of that border, by half an edge at least. The
//     gap gives the strip between the two borders triangles of a good shape, and keeps the borders from crossing.
//  4. The borders are joined (patch_join.h): runs of sides that found the same chain, by a strip of triangles.
// Where step 4 finds no clear partner, more goes around that place and steps 2 to 4 are repeated: farther from what was
// lost the surfaces lie closer together, and the borders are longer and rounder.

namespace htvm::internal {
namespace {

constexpr std::uint32_t none = SurfacePoint::nothing;

// ---- Closest points -------------------------------------------------------------------------------------------------

struct Seeker {
    LatticeUnits reach;
    LatticeUnits enough;  // what is this near need not be searched for a second time; 0: nothing is
    double agreement = 0.2;
    Threads threads = {};
};

// The closest points that face the same way. What is found along the surface is taken where that is near enough; else
// the search is among all that face that way, and since that misses points in the middle of long triangles, in all
// directions as well where it finds nothing near. near: of each point a vertex of the surface to begin with, or
// OrientedPoints::no_point; or none.
std::vector<SurfacePoint> closest_on_same_side(const SurfaceIndex& surface, std::span<const Point3f> points,
                                               std::span<const Point3f> normals, const Seeker& how,
                                               std::vector<std::uint32_t> near = {}) {
    std::vector<SurfacePoint> out(points.size());
    if (surface.triangles.empty()) return out;
    const auto reach = static_cast<float>(how.reach.value), agreement = static_cast<float>(how.agreement);
    const auto is_enough = [&](const SurfacePoint& found) {
        return found.found() && static_cast<double>(found.squared_distance) <= how.enough.value * how.enough.value;
    };
    const auto closest = [&](const Point3f& point, const Point3f& normal, std::uint32_t& guess) {
        if (how.enough.value > 0) {
            auto along =
                surface.closest_facing(point, normal, {.reach = reach, .agreement = agreement, .along = true}, guess);
            if (is_enough(along)) return along;
        }
        auto facing = surface.closest_facing(point, normal, {.reach = reach, .agreement = agreement}, guess);
        if (is_enough(facing)) return facing;
        auto from = guess;
        const auto any = surface.closest_within(point, reach, from);
        if (!any.found() || (facing.found() && any.squared_distance >= facing.squared_distance)) return facing;
        const auto across =
            normalised(area_vector(std::span<const Point3f>(surface.positions), surface.triangles[any.triangle]));
        return dot(across, to_vector(normal)) >= how.agreement ? any : facing;
    };
    // Guesses may decide what is found, so they must not depend on how the threads cut the range.
    constexpr std::size_t in_a_row = 512, ahead = 6;
    parallel_for((points.size() + in_a_row - 1) / in_a_row, how.threads, 2, [&](std::size_t begin, std::size_t end) {
        for (std::size_t row = begin; row < end; ++row) {
            std::uint32_t guess = OrientedPoints::no_point;
            const std::size_t first = row * in_a_row, after = std::min(points.size(), first + in_a_row);
            if (how.enough.value > 0 && !near.empty())
                surface.walk_all(points.subspan(first, after - first), surface.begins_near(),
                                 std::span(near).subspan(first, after - first));
            for (std::size_t i = first; i < after; ++i) {
                if (i + ahead < after && !near.empty()) surface.expect(near[i + ahead]);
                if (!near.empty() && near[i] != OrientedPoints::no_point) guess = near[i];
                out[i] = closest(points[i], normals[i], guess);
            }
        }
    });
    return out;
}

// reach: what is given where nothing was found.
LatticeUnits distance_to(const SurfacePoint& found, LatticeUnits reach) {
    return found.found() ? LatticeUnits(std::sqrt(static_cast<double>(found.squared_distance))) : reach;
}

// ---- 1. What is lost ------------------------------------------------------------------------------------------------

// The captured mesh, its seams closed. Triangles have the numbers that they have in its index.
struct Capture {
    Merging merging;
    LatticeMesh mesh;
    const SurfaceIndex& surface;
    std::vector<bool> rim{};  // vertices on a border: beyond it nothing was seen, so nothing is known there; none if
                              // there is no border
    std::vector<Point3f> points{}, normals{};
    std::vector<SurfacePoint> on_decoded{};  // the nearest point of the tracked mesh to each vertex

    std::vector<std::uint8_t> from_border{};  // edges_from_border(), where surface comes and goes; else none

    // Whether a vertex is one of the ragged rim of surface that comes and goes.
    bool at_ragged_rim(std::uint32_t v) const { return !from_border.empty() && from_border[v] < 2; }
    // Whether the tracked mesh is this near a vertex.
    bool is_covered(std::uint32_t v, LatticeUnits near) const {
        const auto& found = on_decoded[v];
        return found.found() && static_cast<double>(found.squared_distance) <= near.value * near.value;
    }

    CaptureRim border{};

    // Whether the capture's point nearest to this one lies on its border.
    bool ends_at(const Point3f& point) const {
        constexpr float inside = 1e-3F;
        if (rim.empty()) return false;
        const auto found = surface.closest(point);
        for (std::size_t i = 0; i < 3; ++i)
            if (found.shares[i] > inside && !rim[mesh.triangles[found.triangle][i]]) return false;
        return *std::min_element(found.shares.begin(), found.shares.end()) <= inside;
    }
};

// Distances of the tracked mesh from the capture, one per vertex: of the vertex itself, or of the middles of the
// triangles around it on average if that is more. What lies beyond the capture's border does not count: it may be there
// and have been out of sight.
std::vector<double> errors_of(const TrackedMesh& tracked, const SurfaceIndex& shown, const Capture& capture,
                              const SurfacePatchOptions& options) {
    const auto& points = shown.positions;
    const auto& decoded = tracked.decoded;
    // Those of vertices first, those of triangles behind them: of all that may be seen.
    std::vector<std::size_t> sampled;
    std::vector<Point3f> samples, facing;
    std::vector<std::uint32_t> near;
    const auto sample = [&](std::size_t of, const Point3f& point, const Point3f& normal, std::uint32_t vertex) {
        sampled.push_back(of);
        samples.push_back(point);
        facing.push_back(normal);
        if (!tracked.near.empty()) near.push_back(tracked.near[vertex]);
    };
    for (std::uint32_t v = 0; v < points.size(); ++v)
        if (tracked.seen.empty() || tracked.seen[v] != 0) sample(v, points[v], shown.normals[v], v);
    for (std::size_t i = 0; i < decoded.triangles.size(); ++i) {
        const auto& t = decoded.triangles[i];
        if (tracked.is_unseen(t)) continue;
        Vector3d middle{};
        for (const auto v : t) middle = middle + to_vector(decoded.positions[v]) * (1.0 / 3);
        sample(points.size() + i, to_floats(middle), to_floats(normal_of(decoded.positions, t)), t[0]);
    }
    const auto found = closest_on_same_side(capture.surface, samples, facing,
                                            {options.reach, options.lost / 2, 0, options.threads}, std::move(near));
    std::vector<double> error(points.size() + decoded.triangles.size(), 0);
    parallel_for(samples.size(), options.threads, 512, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const auto distance = distance_to(found[i], options.reach);
            if (distance <= options.lost / 2 || !capture.ends_at(samples[i])) error[sampled[i]] = distance.value;
        }
    });
    std::vector<double> out(points.size(), 0);
    for (std::size_t v = 0; v < out.size(); ++v) {
        const auto triangles = shown.around.of(v);
        if (triangles.empty()) continue;
        double sum = 0;
        for (const auto t : triangles) sum += error[points.size() + t];
        out[v] = std::max(error[v], sum / static_cast<double>(triangles.size()));
    }
    return out;
}

// Parts that hang on nothing are left, or added, from this area on: in those of a speck.
constexpr double smallest_part = 4;

// In squared lattice units.
double area_of_speck(const SurfacePatchOptions& options) { return options.speck.value * options.speck.value; }

// Vertices of the tracked mesh around captured surface that it does not cover: they are lost, so that the hole in which
// the uncovered surface belongs opens there. Specks of it do not count, nor do ragged rims. Gives whether there is
// uncovered surface with nothing around it.
bool add_rims_of_uncovered(const Capture& capture, const LatticeMesh& decoded, const SurfacePatchOptions& options,
                           std::vector<bool>& lost) {
    const auto& mesh = capture.mesh;
    std::vector<bool> uncovered(mesh.positions.size());
    for (std::uint32_t v = 0; v < uncovered.size(); ++v)
        uncovered[v] = !capture.at_ragged_rim(v) && !capture.is_covered(v, options.lost);
    std::vector<Triangle> there;
    std::copy_if(mesh.triangles.begin(), mesh.triangles.end(), std::back_inserter(there),
                 [&](const Triangle& t) { return uncovered[t[0]] || uncovered[t[1]] || uncovered[t[2]]; });
    DisjointSets regions(uncovered.size());
    std::vector<double> area(uncovered.size(), 0);
    for (const auto& t : there)
        for (std::size_t i = 0; i < 3; ++i)
            if (uncovered[t[i]] && uncovered[t[(i + 1) % 3]]) regions.join(t[i], t[(i + 1) % 3]);
    for (const auto& t : there) {
        const double third = area_of(mesh.positions, t) / 3;
        for (const auto v : t)
            if (uncovered[v]) area[regions.of(v)] += third;
    }
    std::vector<bool> has_rim(uncovered.size(), false);
    for (const auto& t : there)
        for (const auto from : t)
            for (const auto to : t)
                if (uncovered[from] && capture.is_covered(to, options.lost) &&
                    area[regions.of(from)] > area_of_speck(options)) {
                    has_rim[regions.of(from)] = true;
                    for (const auto corner : decoded.triangles[capture.on_decoded[to].triangle]) lost[corner] = true;
                }
    for (std::uint32_t v = 0; v < uncovered.size(); ++v)
        if (uncovered[v] && regions.of(v) == v && !has_rim[v] && area[v] > smallest_part * area_of_speck(options))
            return true;
    return false;
}

// Marks the corners of triangles that are stretched, or turned against a neighbour beside which they lay flat.
std::vector<bool> distorted(const TrackedMesh& tracked, const Sides& sides, const SurfacePatchOptions& options) {
    constexpr double folded = -0.5, flat = 0.5;
    const auto& decoded = tracked.decoded;
    const auto rest = tracked.rest;
    std::vector<bool> out(decoded.positions.size(), false);
    if (rest.size() != decoded.positions.size()) return out;
    const auto mark = [&](std::uint32_t triangle) {
        if (tracked.is_unseen(decoded.triangles[triangle])) return;
        for (const auto v : decoded.triangles[triangle]) out[v] = true;
    };
    const auto side_length = [&](std::span<const LatticePoint> positions, std::uint32_t s) {
        return length(to_vector(positions[sides.to(s)]) - to_vector(positions[sides.from(s)]));
    };
    for (std::uint32_t s = 0; s < sides.count(); ++s) {
        if (side_length(decoded.positions, s) > options.stretch * std::max(side_length(rest, s), 1.0)) mark(s / 3);
        const auto twin = sides.twin(s);
        if (twin == no_side || twin < s) continue;
        const auto &t = decoded.triangles[s / 3], &u = decoded.triangles[twin / 3];
        if (dot(normal_of(decoded.positions, t), normal_of(decoded.positions, u)) < folded &&
            dot(normal_of(rest, t), normal_of(rest, u)) > flat)
            mark(s / 3), mark(twin / 3);
    }
    return out;
}

// All vertices that share a triangle with a marked one are marked too.
void grow(std::vector<bool>& marked, std::span<const Triangle> triangles) {
    const auto before = marked;
    for (const auto& t : triangles)
        if (before[t[0]] || before[t[1]] || before[t[2]])
            for (const auto v : t) marked[v] = true;
}

// How far the surfaces are apart around each vertex of the tracked mesh: the RMS distance in its cube of space, of
// either surface's vertices from the other.
std::vector<double> errors_around(std::span<const Point3f> points, std::span<const double> error,
                                  const Capture& capture, const SurfacePatchOptions& options) {
    constexpr std::ptrdiff_t fewest = 4;
    std::vector<double> squared, of_capture;
    for (const double distance : error) squared.push_back(distance * distance);
    for (std::uint32_t v = 0; v < capture.on_decoded.size(); ++v) {
        const double distance = capture.at_ragged_rim(v) ? 0 : distance_to(capture.on_decoded[v], options.reach).value;
        of_capture.push_back(distance * distance);
    }
    const auto back = cube_errors(points, squared, options.region, fewest),
               forth = cube_errors(capture.points, of_capture, options.region, fewest);
    std::vector<double> out;
    for (const auto& point : points) out.push_back(std::max(back.at(point), forth.at(point)));
    return out;
}

// What tells that surface is lost, by vertex of the tracked mesh.
struct LossSigns {
    std::span<const double> error, error_around;
    const std::vector<bool>&rims, &bad_shape;
};

// A region is lost as far as the error is over half the limit, if enough of it is over the limit. Where any cube of
// space is lost, only regions that reach into lost cubes are.
std::vector<bool> find_lost(const LatticeMesh& decoded, const Sides& sides, const LossSigns& signs,
                            LatticeUnits region_lost, const SurfacePatchOptions& options) {
    constexpr double hardly_seen = 0.25;  // how much a triangle of bad shape counts that lies on the surface
    const std::size_t vertices = decoded.positions.size();
    const auto& [error, around, rims, bad_shape] = signs;
    const auto doubtful = [&](std::uint32_t v) {
        return LatticeUnits(signs.error[v]) > options.lost / 2 || signs.rims[v] || signs.bad_shape[v];
    };
    DisjointSets regions(vertices);
    std::vector<double> area(vertices, 0);
    for (std::uint32_t s = 0; s < sides.count(); ++s)
        if (doubtful(sides.from(s)) && doubtful(sides.to(s))) regions.join(sides.from(s), sides.to(s));
    for (const auto& t : decoded.triangles) {
        const double third = area_of(decoded.positions, t) / 3;
        for (const auto v : t)
            if (LatticeUnits(error[v]) > options.lost)
                area[regions.of(v)] += third;
            else if (bad_shape[v])
                area[regions.of(v)] += hardly_seen * third;
    }
    const double enough = area_of_speck(options);
    for (std::uint32_t v = 0; v < vertices; ++v)
        if (rims[v]) area[regions.of(v)] += enough;
    std::vector<bool> reaches(vertices, true);
    const auto in_lost_cube = [&](std::uint32_t v) { return LatticeUnits(signs.error_around[v]) > region_lost; };
    if (std::any_of(around.begin(), around.end(), [&](double rms) { return LatticeUnits(rms) > region_lost; })) {
        reaches.assign(vertices, false);
        for (std::uint32_t v = 0; v < vertices; ++v)
            if (in_lost_cube(v)) reaches[regions.of(v)] = true;
    }
    std::vector<bool> lost(vertices);
    for (std::uint32_t v = 0; v < vertices; ++v) {
        const auto region = regions.of(v);
        lost[v] = doubtful(v) && area[region] >= enough && reaches[region];
    }
    if (std::find(lost.begin(), lost.end(), true) == lost.end()) return lost;
    for (int ring = 0; ring < options.margin; ++ring) grow(lost, decoded.triangles);
    return lost;
}

// ---- 2. What stays --------------------------------------------------------------------------------------------------

// Lets go of what would be left as a notch, a bridge one triangle wide, or an island, until nothing changes.
void tidy(std::vector<bool>& removed, const LatticeMesh& decoded, const Sides& sides,
          const SurfacePatchOptions& options) {
    constexpr int rounds = 12, smoothing = 3;
    constexpr double most_gone = 0.6;
    const double least = smallest_part * area_of_speck(options);
    const std::size_t vertices = removed.size();
    std::vector<double> area_of_triangle;
    for (const auto& t : decoded.triangles) area_of_triangle.push_back(area_of(decoded.positions, t));
    for (int round = 0; round < rounds; ++round) {
        std::vector<std::uint32_t> kept(vertices, 0), gone(vertices, 0), lost_corners(vertices, 0),
            corners(vertices, 0);
        std::vector<std::uint32_t> staying;
        std::vector<char> stays_as_whole(decoded.triangles.size());
        DisjointSets parts(vertices);
        for (std::uint32_t index = 0; index < decoded.triangles.size(); ++index) {
            const auto& t = decoded.triangles[index];
            const bool stays = !removed[t[0]] && !removed[t[1]] && !removed[t[2]];
            stays_as_whole[index] = stays ? 1 : 0;
            for (std::size_t i = 0; i < 3; ++i) {
                ++(stays ? kept : gone)[t[i]];
                for (const std::size_t other : {(i + 1) % 3, (i + 2) % 3}) {
                    ++corners[t[i]];
                    if (removed[t[other]]) ++lost_corners[t[i]];
                }
                parts.join(t[i], stays ? t[(i + 1) % 3] : t[i]);
            }
            if (stays) staying.push_back(index);
        }
        std::vector<double> area(vertices, 0);
        std::vector<bool> opened(vertices, false);
        for (const auto index : staying) {
            const auto& t = decoded.triangles[index];
            area[parts.of(t[0])] += area_of_triangle[index];
            for (const auto v : t)
                if (gone[v] > 0) opened[parts.of(v)] = true;
        }
        const auto stays = [&](std::uint32_t triangle) { return stays_as_whole[triangle] != 0; };
        std::vector<std::uint32_t> borders(vertices, 0);
        for (std::uint32_t s = 0; s < sides.count(); ++s)
            if (stays(s / 3) && (sides.twin(s) == no_side || !stays(sides.twin(s) / 3))) ++borders[sides.from(s)];
        std::vector<std::uint32_t> more;
        for (std::uint32_t v = 0; v < vertices; ++v) {
            if (removed[v] || gone[v] == 0) {
                if (!removed[v] && kept[v] > 0 && opened[parts.of(v)] && area[parts.of(v)] < least) more.push_back(v);
                continue;
            }
            const bool notch = round < smoothing && lost_corners[v] > most_gone * corners[v];
            const bool island = area[parts.of(v)] < least;
            if (kept[v] == 0 || borders[v] > 1 || notch || island) more.push_back(v);
        }
        for (const auto v : more) removed[v] = true;
        if (more.empty()) return;  // nor will a later round find any, which looks for no more than this one
    }
}

Remainder remainder_of(const LatticeMesh& decoded, const Sides& sides, const std::vector<bool>& removed) {
    const auto stays = [&](std::uint32_t triangle) {
        const auto& t = decoded.triangles[triangle];
        return !removed[t[0]] && !removed[t[1]] && !removed[t[2]];
    };
    Remainder out;
    for (std::uint32_t t = 0; t < decoded.triangles.size(); ++t)
        if (stays(t)) out.triangles.push_back(decoded.triangles[t]);
    out.open.assign(removed.size(), false);
    const auto natural = [&](std::uint32_t side) { return sides.twin(side) == no_side; };
    for (auto& loop : border_loops(sides, stays)) {
        const auto end = std::find_if(loop.begin(), loop.end(), natural);
        const bool closed = end == loop.end();
        if (!closed) std::rotate(loop.begin(), end, loop.end());
        bool goes_on = false;
        for (const auto side : loop) {
            if (!natural(side)) {
                if (!goes_on) out.chains.emplace_back().closed = closed;
                out.chains.back().sides.push_back(side);
                out.open[sides.from(side)] = out.open[sides.to(side)] = true;
            }
            goes_on = !natural(side);
        }
    }
    return out;
}

// ---- 3. The piece ---------------------------------------------------------------------------------------------------

// How far each captured vertex lies outside of the open border, in edges of the mesh there; negative where the mesh
// stays. Large where no mesh is near.
struct Outside {
    std::vector<double> edges;
    std::vector<bool> at_opening;  // the nearest point is on the open border
};

Outside outside_of(const Remainder& stays, const LatticeMesh& decoded, const std::vector<bool>& removed,
                   std::span<const double> edge, const Capture& capture, const SurfacePatchOptions& options) {
    constexpr double far = 2;
    constexpr float none_of_it = 1e-3F;
    std::vector<std::uint32_t> number(removed.size(), none), queries;
    std::vector<Point3f> points, query_points, query_normals;
    auto triangles = stays.triangles;
    for (auto& t : triangles)
        for (auto& v : t) {
            if (number[v] == none) {
                number[v] = static_cast<std::uint32_t>(points.size());
                points.push_back(point_of(decoded.positions[v]));
            }
            v = number[v];
        }
    const auto nearest_stays = [&](const SurfacePoint& p) {
        if (!p.found()) return false;
        const auto& t = decoded.triangles[p.triangle];
        return !removed[t[0]] && !removed[t[1]] && !removed[t[2]];
    };
    for (std::uint32_t v = 0; v < capture.points.size(); ++v) {
        if (nearest_stays(capture.on_decoded[v])) continue;
        queries.push_back(v);
        query_points.push_back(capture.points[v]);
        query_normals.push_back(capture.normals[v]);
    }
    const double mean = mean_edge(decoded.positions, stays.triangles);
    const SurfaceIndex index(points, triangles,
                             {.cell = static_cast<float>(std::max(2 * mean, 1.0)), .threads = options.threads});
    const auto found =
        closest_on_same_side(index, query_points, query_normals, {options.reach, {}, 0.2, options.threads});
    Outside out;
    out.edges.assign(capture.points.size(), far);
    out.at_opening.assign(capture.points.size(), false);
    const auto judge = [&](std::uint32_t v, const SurfacePoint& p, const Triangle& t) {
        double depth = 0, local = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            local += static_cast<double>(p.shares[i]) * edge[t[i]];
            if (p.shares[i] > none_of_it && !stays.open[t[i]]) depth += static_cast<double>(p.shares[i]);
        }
        const auto distance = distance_to(p, options.reach);
        if (depth > 0) {
            out.edges[v] = distance > options.lost ? far : -depth;
            return;
        }
        out.at_opening[v] = true;
        out.edges[v] = std::min(far, distance.value / std::max(local, 1.0));
    };
    for (std::uint32_t v = 0; v < capture.points.size(); ++v)
        if (nearest_stays(capture.on_decoded[v]))
            judge(v, capture.on_decoded[v], decoded.triangles[capture.on_decoded[v].triangle]);
    for (std::size_t i = 0; i < queries.size(); ++i)
        if (found[i].found()) judge(queries[i], found[i], stays.triangles[found[i].triangle]);
    return out;
}

// Captured triangles that were cut out.
struct Cutting {
    LatticeMesh mesh;
    std::vector<bool> joins;  // of its vertices: whether it was cut at the open border
};

// Cuts the captured triangles along the line at which `outside` is the gap, and keeps what is beyond it.
class Cutter {
public:
    Cutter(const Outside& outside, const LatticeMesh& captured, double gap)
        : outside_(outside), captured_(captured), gap_(gap), number_(captured.positions.size(), none) {}

    Cutting run() {
        for (const auto& t : captured_.triangles) add(t);
        return std::move(out_);
    }

private:
    const Outside& outside_;
    const LatticeMesh& captured_;
    double gap_;                                                             // in edges
    std::vector<std::uint32_t> number_;                                      // of the captured vertices in the piece
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> cuts_;  // those of sides that cross the line
    Cutting out_;

    bool inside(std::uint32_t v) const { return outside_.edges[v] > gap_; }

    void add(const Triangle& t) {
        const int count = int{inside(t[0])} + int{inside(t[1])} + int{inside(t[2])};
        if (count == 0) return;
        auto& triangles = out_.mesh.triangles;
        if (count == 3) {
            triangles.push_back({whole(t[0]), whole(t[1]), whole(t[2])});
            return;
        }
        // The corner that is alone on its side comes first.
        std::size_t alone = 0;
        while (inside(t[alone]) != (count == 1)) ++alone;
        const auto a = t[alone], b = t[(alone + 1) % 3], c = t[(alone + 2) % 3];
        if (count == 1) {
            triangles.push_back({whole(a), cut(a, b), cut(a, c)});
        } else {
            const auto at_b = cut(b, a), at_c = cut(c, a);
            triangles.push_back({at_b, whole(b), whole(c)});
            triangles.push_back({at_b, whole(c), at_c});
        }
    }

    // The piece's number of a captured vertex.
    std::uint32_t whole(std::uint32_t v) {
        if (number_[v] == none) {
            number_[v] = static_cast<std::uint32_t>(out_.mesh.positions.size());
            out_.mesh.positions.push_back(captured_.positions[v]);
            if (!captured_.colours.empty()) out_.mesh.colours.push_back(captured_.colours[v]);
            out_.joins.push_back(false);
        }
        return number_[v];
    }

    // That of the vertex at which the side between a vertex inside and one outside crosses the line.
    std::uint32_t cut(std::uint32_t in, std::uint32_t out) {
        constexpr double least_share = 0.1;  // of an edge, so that no triangle gets too thin for the lattice
        auto& mesh = out_.mesh;
        const auto [at, fresh] = cuts_.try_emplace({in, out}, static_cast<std::uint32_t>(mesh.positions.size()));
        if (!fresh) return at->second;
        const double span = outside_.edges[in] - outside_.edges[out];
        const double share = std::clamp((outside_.edges[in] - gap_) / span, least_share, 1 - least_share);
        const auto a = to_vector(captured_.positions[in]), b = to_vector(captured_.positions[out]);
        const auto p = a + (b - a) * share;
        const auto coordinate = [&](std::size_t axis) { return static_cast<std::int32_t>(std::lround(p[axis])); };
        mesh.positions.push_back({coordinate(0), coordinate(1), coordinate(2)});
        if (!captured_.colours.empty()) {
            const auto &from = captured_.colours[in], &to = captured_.colours[out];
            Colour colour{};
            for (std::size_t c = 0; c < 3; ++c)
                colour[c] = static_cast<std::uint8_t>(std::lround(from[c] + (to[c] - from[c]) * share));
            mesh.colours.push_back(colour);
        }
        out_.joins.push_back(outside_.at_opening[in] || outside_.at_opening[out]);
        return at->second;
    }
};

// Without the parts that do not reach the open border, unless they may be added alone, and without crumbs.
LatticeMesh parts_that_join(const Cutting& cutting, bool alone, const SurfacePatchOptions& options) {
    constexpr double crumb = 0.25;  // side of a square, in specks
    const double least = crumb * crumb * area_of_speck(options), least_alone = smallest_part * area_of_speck(options);
    const auto& all = cutting.mesh;
    const std::size_t vertices = all.positions.size();
    DisjointSets parts(vertices);
    std::vector<double> area(vertices, 0);
    for (const auto& t : all.triangles) parts.join(t[0], t[1]), parts.join(t[1], t[2]);
    for (const auto& t : all.triangles) area[parts.of(t[0])] += area_of(all.positions, t);
    std::vector<bool> wanted(vertices, false);
    for (std::uint32_t v = 0; v < vertices; ++v)
        if (cutting.joins[v]) wanted[parts.of(v)] = true;
    LatticeMesh out;
    std::vector<std::uint32_t> number(vertices, none);
    for (auto t : all.triangles) {
        const auto part = parts.of(t[0]);
        if (wanted[part] ? area[part] < least : !alone || area[part] < least_alone) continue;
        for (auto& v : t) {
            if (number[v] == none) {
                number[v] = static_cast<std::uint32_t>(out.positions.size());
                out.positions.push_back(all.positions[v]);
                if (!all.colours.empty()) out.colours.push_back(all.colours[v]);
            }
            v = number[v];
        }
        out.triangles.push_back(t);
    }
    return out;
}

// What of the captured surface lies farther outside than the gap, as far as it reaches the open border: the rest is
// none of this patch's.
LatticeMesh cut_piece(const Outside& outside, const Capture& capture, const SurfacePatchOptions& options) {
    return parts_that_join(Cutter(outside, capture.mesh, options.gap).run(), !capture.from_border.empty(), options);
}

}  // namespace

struct SurfacePatchSearch::Measured {
    const LatticeMesh &decoded, &captured;
    const SurfaceIndex& surface;
    SurfacePatchOptions options;
    std::optional<Sides> sides;
    std::optional<Capture> capture;
    std::vector<double> error;          // of each vertex of the tracked mesh
    std::vector<double> error_around;   // RMS in its cube of space
    std::vector<double> edge;           // mean length of the sides at it
    std::vector<bool> rims, bad_shape;  // what is lost whatever the error: around uncovered surface, and distorted
    bool uncovered_alone = false;       // whether there is uncovered surface with nothing around it
    double area = 0;                    // of the tracked mesh

    Measured(const TrackedMesh& tracked, const LatticeMesh& mesh, const SurfaceIndex& index,
             const SurfacePatchOptions& wanted);
    void measure_sides();  // edge and area
};

namespace {

// The captured mesh with its border.
Capture make_capture(const LatticeMesh& captured, const SurfaceIndex& surface, const SurfacePatchOptions& options) {
    auto merging = at_same_place(captured);
    auto mesh = welded(captured, merging);
    Capture capture{.merging = std::move(merging), .mesh = std::move(mesh), .surface = surface};
    const bool as_indexed = capture.mesh.positions.size() == surface.positions.size();
    capture.points = as_indexed ? surface.positions : points_of(capture.mesh.positions);
    capture.normals =
        as_indexed ? surface.normals : points_of(vertex_normals(capture.mesh.positions, capture.mesh.triangles));
    if (!surface.from_border.empty()) capture.from_border = edges_from_border(capture.points, capture.mesh.triangles);
    // The sides of a border have both ends on it, so that of most captures hardly any triangles are looked at.
    std::vector<char> inside(capture.points.size(), 1);
    for (std::uint32_t v = 0; v < surface.positions.size(); ++v)
        if (!surface.is_inside(v)) inside[capture.merging.number[v]] = 0;
    std::vector<Triangle> at_border;
    for (const auto& t : capture.mesh.triangles)
        if (inside[t[0]] + inside[t[1]] + inside[t[2]] < 2) at_border.push_back(t);
    const Sides sides(capture.mesh.positions, at_border);
    std::vector<Point3f> along_rim;
    double rim_length = 0;
    for (std::uint32_t s = 0; s < sides.count(); ++s) {
        if (sides.twin(s) != no_side) continue;
        if (inside[sides.from(s)] != 0 || inside[sides.to(s)] != 0) continue;
        if (capture.rim.empty()) capture.rim.assign(capture.points.size(), false);
        const auto a = sides.from(s), b = sides.to(s);
        capture.rim[a] = capture.rim[b] = true;
        const auto from = to_vector(capture.points[a]), to = to_vector(capture.points[b]);
        along_rim.push_back(capture.points[a]);
        along_rim.push_back(to_floats((from + to) * 0.5));
        rim_length += length(to - from);
    }
    if (along_rim.empty()) return capture;
    capture.border.along.emplace(along_rim);
    capture.border.reach =
        2 * options.simplification.surface_error + LatticeUnits(rim_length / static_cast<double>(along_rim.size()));
    return capture;
}

}  // namespace

SurfacePatchSearch::Measured::Measured(const TrackedMesh& tracked, const LatticeMesh& mesh, const SurfaceIndex& index,
                                       const SurfacePatchOptions& wanted)
    : decoded(tracked.decoded), captured(mesh), surface(index), options(wanted) {
    std::optional<SurfaceIndex> shown;
    const auto look_at_tracked = [&] {
        sides.emplace(decoded.positions, decoded.triangles);
        const double mean = mean_edge(decoded.positions, decoded.triangles);
        shown.emplace(
            points_of(decoded.positions), decoded.triangles,
            SurfaceIndexOptions{.cell = static_cast<float>(std::max(2 * mean, 1.0)), .threads = options.threads});
        bad_shape = distorted(tracked, *sides, options);
        measure_sides();
    };
    parallel_invoke(
        options.threads, [&] { capture.emplace(make_capture(mesh, index, wanted)); }, look_at_tracked);
    std::vector<std::uint32_t> beside(tracked.near.empty() ? 0 : capture->points.size(), OrientedPoints::no_point);
    for (std::uint32_t v = 0; v < tracked.near.size(); ++v)
        if (tracked.near[v] != OrientedPoints::no_point) beside[capture->merging.number[tracked.near[v]]] = v;
    capture->on_decoded =
        closest_on_same_side(*shown, capture->points, capture->normals,
                             {options.reach, options.lost / 2, 0.2, options.threads}, std::move(beside));
    error = errors_of(tracked, *shown, *capture, options);
    error_around = errors_around(shown->positions, error, *capture, options);
    rims.assign(decoded.positions.size(), false);
    uncovered_alone = add_rims_of_uncovered(*capture, decoded, options, rims) && !index.from_border.empty();
}

void SurfacePatchSearch::Measured::measure_sides() {
    edge.assign(decoded.positions.size(), 0);
    std::vector<double> count(edge.size(), 0);
    for (std::uint32_t s = 0; s < sides->count(); ++s) {
        const auto a = sides->from(s), b = sides->to(s);
        const double size = length(to_vector(decoded.positions[b]) - to_vector(decoded.positions[a]));
        for (const auto v : {a, b}) edge[v] += size, count[v] += 1;
    }
    for (std::size_t v = 0; v < edge.size(); ++v) edge[v] /= std::max(count[v], 1.0);
    for (const auto& t : decoded.triangles) area += area_of(decoded.positions, t);
}

SurfacePatchSearch::SurfacePatchSearch(const TrackedMesh& tracked, const LatticeMesh& captured,
                                       const SurfaceIndex& surface, const SurfacePatchOptions& options) {
    if (!captured.texcoords.empty() || captured.triangles.empty() || tracked.decoded.triangles.empty()) return;
    measured_ = std::make_unique<const Measured>(tracked, captured, surface, options);
}
SurfacePatchSearch::SurfacePatchSearch(SurfacePatchSearch&&) noexcept = default;
SurfacePatchSearch& SurfacePatchSearch::operator=(SurfacePatchSearch&&) noexcept = default;
SurfacePatchSearch::~SurfacePatchSearch() = default;

std::optional<SurfacePatch> SurfacePatchSearch::find(LatticeUnits region_lost) const {
    if (!measured_) return std::nullopt;
    const auto& m = *measured_;
    const auto& options = m.options;
    const std::size_t vertices = m.decoded.positions.size();
    auto removed = find_lost(m.decoded, *m.sides, {m.error, m.error_around, m.rims, m.bad_shape}, region_lost, options);
    if (std::find(removed.begin(), removed.end(), true) == removed.end() && !m.uncovered_alone) return std::nullopt;
    // Surface that comes and goes has borders everywhere: what cannot be joined stays open.
    const bool open = !m.surface.from_border.empty();
    for (int attempt = 0; attempt < options.attempts; ++attempt) {
        tidy(removed, m.decoded, *m.sides, options);
        const auto stays = remainder_of(m.decoded, *m.sides, removed);
        double area = 0;
        for (const auto& t : stays.triangles) area += area_of(m.decoded.positions, t);
        if (m.area - area > options.most_share * m.area) return std::nullopt;
        const auto outside = outside_of(stays, m.decoded, removed, m.edge, *m.capture, options);
        const auto piece =
            simplified_piece(cut_piece(outside, *m.capture, options), m.captured, m.surface, options.simplification);
        auto join = join_piece({m.decoded, *m.sides, stays, m.edge}, piece, m.capture->border, options.gap);
        if (join.unclear.empty() || (open && attempt + 1 == options.attempts)) {
            if (piece.triangles.empty() && open) return std::nullopt;
            SurfacePatch out;
            out.removed = std::move(removed);
            out.positions = piece.positions;
            out.colours = piece.colours;
            for (auto t : piece.triangles) {
                for (auto& v : t) v += static_cast<std::uint32_t>(vertices);
                out.triangles.push_back(t);
            }
            out.triangles.insert(out.triangles.end(), join.triangles.begin(), join.triangles.end());
            return out;
        }
        grow(join.unclear, m.decoded.triangles);
        for (std::size_t v = 0; v < vertices; ++v)
            if (join.unclear[v]) removed[v] = true;
    }
    return std::nullopt;
}

}  // namespace htvm::internal
