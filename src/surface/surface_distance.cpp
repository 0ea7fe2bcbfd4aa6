#include "surface/surface_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace htvm::internal {
namespace {

using Level = std::array<float, 3>;  // a colour interpolated between vertices

constexpr std::size_t block = 512;  // samples summed together; fixed, so that sums do not depend on the number of
                                    // threads

Level level(const Colour& c) { return {float(c[0]), float(c[1]), float(c[2])}; }

// The surface to measure the distance to.
struct Target {
    const SurfaceView& surface;
    const SurfaceIndex& search;
    bool colours;  // whether to compare colours

    Level colour_at(const SurfacePoint& p) const {
        if (surface.triangles.empty()) return level(surface.colours[p.triangle]);
        Level out{};
        for (std::size_t i = 0; i < 3; ++i) {
            const Level corner = level(surface.colours[surface.triangles[p.triangle][i]]);
            for (std::size_t c = 0; c < 3; ++c) out[c] += p.shares[i] * corner[c];
        }
        return out;
    }
};

struct Squares {
    double distance = 0, colour = 0;
};

Squares measure(const Point3f& sample, const Level& colour, const Target& target) {
    const auto found = target.search.closest(sample);
    Squares out{found.squared_distance, 0};
    if (!target.colours) return out;
    const Level there = target.colour_at(found);
    for (std::size_t c = 0; c < 3; ++c) out.colour += double{colour[c] - there[c]} * (colour[c] - there[c]);
    return out;
}

struct Sums {
    double weight = 0, distance = 0, colour = 0, largest = 0;

    void add(double w, const Squares& squares) {
        weight += w;
        distance += w * squares.distance;
        colour += w * squares.colour;
        largest = std::max(largest, squares.distance);
    }
    void add(const Sums& more) {
        weight += more.weight;
        distance += more.distance;
        colour += more.colour;
        largest = std::max(largest, more.largest);
    }
};

// Sums of body(i, sums) over [0, count). The cuts are the same for any number of threads, hence the sums too.
template <class Body>
Sums sum_blocks(std::size_t count, Threads threads, const Body& body) {
    std::vector<Sums> parts((count + block - 1) / block);
    parallel_for(parts.size(), threads, 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p)
            for (std::size_t i = p * block; i < std::min(count, (p + 1) * block); ++i) body(i, parts[p]);
    });
    Sums total;
    for (const auto& part : parts) total.add(part);
    return total;
}

struct Weights {
    std::vector<double> vertices, triangles;
};

Weights weigh(const SurfaceView& mesh) {
    Weights out{std::vector<double>(mesh.positions.size(), 0.0), {}};
    out.triangles.reserve(mesh.triangles.size());
    double whole = 0;
    for (const auto& t : mesh.triangles) {
        const double area = length(area_vector(mesh.positions, t)) / 2;
        out.triangles.push_back(area);
        for (const auto v : t) out.vertices[v] += area;
        whole += area;
    }
    if (whole > 0) return out;
    for (const auto& t : mesh.triangles)
        for (const auto v : t) out.vertices[v] = 1;
    if (mesh.triangles.empty()) out.vertices.assign(mesh.positions.size(), 1.0);
    return out;
}

Level colour_of(const SurfaceView& mesh, std::size_t vertex) {
    return mesh.colours.empty() ? Level{} : level(mesh.colours[vertex]);
}

Sums measure_vertices(const SurfaceView& from, const std::vector<double>& weights, const Target& target,
                      const SurfaceDistanceOptions& options) {
    const std::size_t every = std::max(1u, options.every);
    return sum_blocks((from.positions.size() + every - 1) / every, options.threads, [&](std::size_t i, Sums& sums) {
        const std::size_t v = i * every;
        if (weights[v] > 0) sums.add(weights[v], measure(from.positions[v], colour_of(from, v), target));
    });
}

Sums measure_centres(const SurfaceView& from, const std::vector<double>& weights, const Target& target,
                     const SurfaceDistanceOptions& options) {
    const std::size_t every = std::max(1u, options.every);
    return sum_blocks((from.triangles.size() + every - 1) / every, options.threads, [&](std::size_t i, Sums& sums) {
        const std::size_t t = i * every;
        if (!(weights[t] > 0)) return;
        Point3f centre{};
        Level colour{};
        for (const auto v : from.triangles[t]) {
            const Level corner = colour_of(from, v);
            for (std::size_t c = 0; c < 3; ++c) {
                centre[c] += from.positions[v][c] / 3;
                colour[c] += corner[c] / 3;
            }
        }
        sums.add(weights[t], measure(centre, colour, target));
    });
}

}  // namespace

OneSidedErrors one_sided_errors(const SurfaceView& from, const SurfaceView& to, const SurfaceIndex& search_to,
                                const SurfaceDistanceOptions& options) {
    if (from.positions.empty()) return {};
    constexpr double infinity = std::numeric_limits<double>::infinity();
    if (search_to.empty()) return {infinity, 0, infinity};
    const Target target{to, search_to, !from.colours.empty() && !to.colours.empty()};
    const auto weights = weigh(from);
    const Sums vertices = measure_vertices(from, weights.vertices, target, options);
    const Sums centres = measure_centres(from, weights.triangles, target, options);
    double share = std::clamp(options.vertex_share, 0.0, 1.0);
    if (!(centres.weight > 0)) share = 1;
    if (!(vertices.weight > 0)) share = 0;
    const double vertex_weight = share / std::max(vertices.weight, std::numeric_limits<double>::min());
    const double centre_weight = (1 - share) / std::max(centres.weight, std::numeric_limits<double>::min());
    return {vertex_weight * vertices.distance + centre_weight * centres.distance,
            vertex_weight * vertices.colour + centre_weight * centres.colour,
            std::sqrt(std::max(vertices.largest, centres.largest))};
}

SurfaceErrors surface_errors(const SurfaceView& a, const SurfaceView& b, const SurfaceDistanceOptions& options) {
    return surface_errors(a, SurfaceIndex(a.positions, a.triangles), b, options);
}

SurfaceErrors surface_errors(const SurfaceView& a, const SurfaceIndex& search_a, const SurfaceView& b,
                             const SurfaceDistanceOptions& options) {
    const SurfaceIndex search_b(b.positions, b.triangles);
    const auto forward = one_sided_errors(a, b, search_b, options);
    const auto backward = one_sided_errors(b, a, search_a, options);
    return {std::sqrt(std::max(forward.squared_distance, backward.squared_distance)),
            std::sqrt(std::max(forward.squared_colour, backward.squared_colour))};
}

}  // namespace htvm::internal
