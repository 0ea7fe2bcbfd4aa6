#include "metrics/surface_error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/parallel.h"
#include "metrics/mesh_measures.h"
#include "metrics/point_error.h"
#include "metrics/triangle_index.h"

namespace htvm {

using namespace internal;
namespace {

struct DistanceSums {
    std::uint64_t samples = 0;
    double distance = 0, squared = 0, largest_squared = 0;
};

void add(DistanceSums& sums, double squared) {
    ++sums.samples;
    sums.distance += std::sqrt(squared);
    sums.squared += squared;
    sums.largest_squared = std::max(sums.largest_squared, squared);
}

void add(DistanceSums& sums, const DistanceSums& more) {
    sums.samples += more.samples;
    sums.distance += more.distance;
    sums.squared += more.squared;
    sums.largest_squared = std::max(sums.largest_squared, more.largest_squared);
}

SurfaceDistances summarise(const DistanceSums& sums) {
    if (sums.samples == 0) return {};
    const double n = static_cast<double>(sums.samples);
    return {sums.samples, std::sqrt(sums.squared / n), sums.distance / n, std::sqrt(sums.largest_squared)};
}

// splitmix64 (Steele, Lea, Flood 2014) as a function of the sample's number, so that samples do not depend on each
// other.
double uniform(std::uint64_t seed, std::uint64_t number) {
    std::uint64_t z = seed * 0xD1342543DE82EF95ull + (number + 1) * 0x9E3779B97F4A7C15ull;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

// Distributes samples over items (edges or faces) in proportion to their measure: the samples of item i are those whose
// number lies in [first(i), first(i + 1)).
struct Shares {
    std::vector<double> until;  // running sum of the measures, items + 1 entries
    double samples = 0;
    std::uint64_t first(std::size_t i) const {
        return until.back() > 0 ? static_cast<std::uint64_t>(until[i] / until.back() * samples + 0.5) : 0;
    }
};

using Edge = std::pair<std::uint32_t, std::uint32_t>;

// What to sample on one mesh.
struct SamplingPlan {
    std::vector<std::uint32_t> vertices;
    std::vector<Edge> edges;
    Shares edge_shares, face_shares;
};

std::vector<Edge> unique_edges(const Mesh& mesh) {
    std::vector<Edge> edges;
    edges.reserve(mesh.triangles.size() * 3);
    for (const auto& t : mesh.triangles)
        for (std::size_t i = 0; i < 3; ++i) edges.push_back(std::minmax(t[i], t[(i + 1) % 3]));
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    return edges;
}

Point3 at(const Mesh& mesh, std::uint32_t vertex) { return to_point(mesh.positions[vertex]); }

std::vector<std::uint32_t> used_vertices(const Mesh& mesh) {
    const auto used = shown_vertices(mesh);
    std::vector<std::uint32_t> vertices;
    for (std::uint32_t v = 0; v < used.size(); ++v)
        if (used[v]) vertices.push_back(v);
    return vertices;
}

// METRO's distribution of samples, see the header. `target` is the number of samples asked for.
SamplingPlan plan_samples(const Mesh& mesh, double target, const SurfaceErrorOptions& options) {
    SamplingPlan plan;
    if (options.vertices || mesh.triangles.empty()) plan.vertices = used_vertices(mesh);
    const double vertices = static_cast<double>(plan.vertices.size());
    double left = std::max(0.0, target - vertices);
    plan.face_shares.until.push_back(0);
    for (const auto& t : mesh.triangles) {
        const double area = length(cross(at(mesh, t[1]) - at(mesh, t[0]), at(mesh, t[2]) - at(mesh, t[0]))) / 2;
        plan.face_shares.until.push_back(plan.face_shares.until.back() + area);
    }
    const double area = plan.face_shares.until.back();
    plan.edge_shares.until.push_back(0);
    if (options.edges) {
        plan.edges = unique_edges(mesh);
        for (const auto& [a, b] : plan.edges)
            plan.edge_shares.until.push_back(plan.edge_shares.until.back() + length(at(mesh, a) - at(mesh, b)));
        const double per_length =
            options.faces ? std::sqrt(left / std::max(area, std::numeric_limits<double>::min()))
                          : left / std::max(plan.edge_shares.until.back(), std::numeric_limits<double>::min());
        plan.edge_shares.samples = std::floor(std::min(left, plan.edge_shares.until.back() * per_length));
        left = std::max(0.0, left - plan.edge_shares.samples - vertices);
    }
    plan.face_shares.samples = options.faces && area > 0 ? std::floor(left) : 0;
    return plan;
}

// Distance to the surface of `mesh`; remembers the last triangle found as the start of the next search.
struct DistanceToSurface {
    const TriangleIndex* index;
    std::uint32_t hint = 0;
    double squared(const Point3& p) {
        const ClosestTriangle found = index->closest(p, hint);
        hint = found.triangle;
        return found.squared_distance;
    }
};

// Runs measure(item, distance, sums) over [0, count) in blocks that do not depend on the number of threads, and adds up
// the sums of the blocks in order.
template <class Measure>
void measure_blocks(std::size_t count, const TriangleIndex& index, Threads threads, DistanceSums& total,
                    const Measure& measure) {
    constexpr std::size_t block = 512;
    std::vector<DistanceSums> sums((count + block - 1) / block);
    parallel_for(sums.size(), threads, 1, [&](std::size_t begin, std::size_t end) {
        DistanceToSurface distance{&index};
        for (std::size_t b = begin; b < end; ++b)
            for (std::size_t i = b * block; i < std::min(count, (b + 1) * block); ++i) measure(i, distance, sums[b]);
    });
    for (const auto& s : sums) add(total, s);
}

DistanceSums measure_plan(const Mesh& from, const SamplingPlan& plan, const TriangleIndex& index,
                          const SurfaceErrorOptions& options) {
    DistanceSums total;
    measure_blocks(plan.vertices.size(), index, options.threads, total,
                   [&](std::size_t i, DistanceToSurface& distance, DistanceSums& sums) {
                       add(sums, distance.squared(at(from, plan.vertices[i])));
                   });
    measure_blocks(plan.edges.size(), index, options.threads, total,
                   [&](std::size_t i, DistanceToSurface& distance, DistanceSums& sums) {
                       const Point3 a = at(from, plan.edges[i].first), b = at(from, plan.edges[i].second);
                       const std::uint64_t n = plan.edge_shares.first(i + 1) - plan.edge_shares.first(i);
                       for (std::uint64_t k = 1; k <= n; ++k)
                           add(sums, distance.squared(a + (b - a) * (double(k) / (double(n) + 1))));
                   });
    const std::size_t faces = plan.face_shares.samples > 0 ? from.triangles.size() : 0;
    measure_blocks(faces, index, options.threads, total,
                   [&](std::size_t i, DistanceToSurface& distance, DistanceSums& sums) {
                       const auto& t = from.triangles[i];
                       const Point3 a = at(from, t[0]), ab = at(from, t[1]) - a, ac = at(from, t[2]) - a;
                       for (std::uint64_t k = plan.face_shares.first(i); k < plan.face_shares.first(i + 1); ++k) {
                           double u = uniform(options.seed, 2 * k), v = uniform(options.seed, 2 * k + 1);
                           if (u + v > 1) u = 1 - u, v = 1 - v;
                           add(sums, distance.squared(a + ab * u + ac * v));
                       }
                   });
    return total;
}

// For `to` without triangles: the samples are the vertices of `from` that are shown, the surface the vertices of `to`.
SurfaceDistances distances_to_vertices(const Mesh& from, const Mesh& to, Threads threads) {
    DistanceSums sums;
    const auto nearest = nearest_vertices(from.positions, to.positions, threads);
    for (const std::uint32_t v : used_vertices(from)) {
        const double infinity = std::numeric_limits<double>::infinity();
        const Point3 d = nearest.empty() ? Point3{} : at(from, v) - at(to, nearest[v]);
        add(sums, nearest.empty() ? infinity : dot(d, d));
    }
    return summarise(sums);
}

}  // namespace

Result<SurfaceDistances> surface_distances(const Mesh& from, const Mesh& to, const SurfaceErrorOptions& options) {
    if (from.positions.empty()) return SurfaceDistances{};
    if (to.triangles.empty()) return distances_to_vertices(from, to, options.threads);
    const auto index = TriangleIndex::build(to, options.threads);
    if (!index) return tl::unexpected(index.error());
    const double target = options.samples > 0
                              ? static_cast<double>(options.samples)
                              : 10.0 * static_cast<double>(std::max(from.triangles.size(), to.triangles.size()));
    return summarise(measure_plan(from, plan_samples(from, target, options), *index, options));
}

Result<SurfaceError> surface_error(const Mesh& original, const Mesh& decoded, const SurfaceErrorOptions& options) {
    const auto forward = surface_distances(original, decoded, options);
    if (!forward) return tl::unexpected(forward.error());
    const auto backward = surface_distances(decoded, original, options);
    if (!backward) return tl::unexpected(backward.error());
    return SurfaceError{*forward, *backward};
}

namespace {

void accumulate(SurfaceDistances& sums, const SurfaceDistances& frame) {
    sums.samples += frame.samples;
    sums.rms += frame.rms;
    sums.mean += frame.mean;
    sums.largest = std::max(sums.largest, frame.largest);
}

SurfaceDistances over_frames(SurfaceDistances sums, std::uint64_t frames) {
    if (frames == 0) return {};
    sums.rms /= static_cast<double>(frames);
    sums.mean /= static_cast<double>(frames);
    return sums;
}

}  // namespace

SurfaceErrorSums& operator+=(SurfaceErrorSums& sums, const SurfaceError& frame) {
    ++sums.frames;
    accumulate(sums.forward, frame.forward);
    accumulate(sums.backward, frame.backward);
    sums.worst_frame_rms = std::max(sums.worst_frame_rms, m2(frame));
    return sums;
}

SurfaceDistances sequence_forward(const SurfaceErrorSums& sums) { return over_frames(sums.forward, sums.frames); }
SurfaceDistances sequence_backward(const SurfaceErrorSums& sums) { return over_frames(sums.backward, sums.frames); }

double m2(const SurfaceErrorSums& sums) { return std::max(sequence_forward(sums).rms, sequence_backward(sums).rms); }
double m2(const SurfaceError& frame) { return std::max(frame.forward.rms, frame.backward.rms); }

}  // namespace htvm
