#include "codec/tracked/captured_surface_enc.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include "codec/intra/duplicates.h"
#include "core/parallel.h"
#include "surface/simplification.h"
#include "surface/surface_index.h"

namespace htvm::internal {

namespace {

// Fills in values where nothing is known with the mean of the neighbours, from the rim inwards; zero if no neighbour is
// ever known.
void fill_gaps(std::vector<double>& values, std::vector<bool> known, std::span<const Triangle> triangles) {
    constexpr int rounds = 24;
    if (std::find(known.begin(), known.end(), false) == known.end()) return;
    std::vector<Triangle> open;
    const auto is_known = [&](const Triangle& t) { return known[t[0]] && known[t[1]] && known[t[2]]; };
    std::copy_if(triangles.begin(), triangles.end(), std::back_inserter(open),
                 [&](const auto& t) { return !is_known(t); });
    std::vector<double> sum(values.size());
    std::vector<std::uint32_t> count(values.size());
    for (int round = 0; round < rounds && !open.empty(); ++round) {
        for (const auto& t : open)
            for (const auto to : t) {
                if (known[to]) continue;
                for (const auto from : t) {
                    if (!known[from]) continue;
                    sum[to] += values[from];
                    ++count[to];
                }
            }
        bool any = false;
        for (const auto& t : open)
            for (const auto v : t) {
                if (known[v] || count[v] == 0) continue;
                values[v] = sum[v] / count[v];
                known[v] = any = true;
            }
        if (!any) break;
        std::erase_if(open, is_known);
    }
}

// The points at which one surface looks for the other.
struct SurfaceSamples {
    std::vector<Point3f> points, normals;  // unit length
};

void add_middle(SurfaceSamples& samples, std::span<const Point3f> points, std::span<const Point3f> normals,
                const Triangle& triangle) {
    Vector3d point{}, normal{};
    for (const auto corner : triangle) {
        point = point + to_vector(points[corner]) * (1.0 / 3);
        normal = normal + to_vector(normals[corner]);
    }
    samples.points.push_back(to_floats(point));
    samples.normals.push_back(to_floats(normalised(normal)));
}

// The samples at which the captured surface is examined: the moved reference's vertices, then the centres of its
// triangles.
SurfaceSamples samples_of(const MovedReference& moved) {
    SurfaceSamples out{points_of(moved.positions), points_of(moved.normals)};
    for (const auto& t : moved.triangles) add_middle(out, out.points, out.normals, t);
    return out;
}

// Finds the function on the mesh, linear within each triangle, that is nearest to the values at the samples: least
// squares by conjugate gradients, with the weights that integrate squares exactly (a twelfth of a triangle's area at
// each corner, three quarters at its centre).
struct SurfaceFit {
    std::span<const Triangle> triangles;
    std::vector<double> corner_weight, middle_weight;  // zero if the sample has no value
    std::vector<double> diagonal;

    std::vector<double> times(const std::vector<double>& x) const;
    std::vector<double> fitted(const std::vector<double>& seen) const;
};

SurfaceFit make_surface_fit(const MovedReference& moved, const std::vector<SurfacePoint>& targets) {
    const std::size_t vertices = moved.positions.size();
    SurfaceFit out;
    out.triangles = moved.triangles;
    out.corner_weight.assign(vertices, 0);
    out.middle_weight.assign(moved.triangles.size(), 0);
    for (std::size_t t = 0; t < moved.triangles.size(); ++t) {
        const auto& corners = moved.triangles[t];
        const double area = length(area_vector(moved.positions, corners)) / 2;
        for (const auto v : corners)
            if (targets[v].found()) out.corner_weight[v] += area / 12;
        if (targets[vertices + t].found()) out.middle_weight[t] = area * 3 / 4;
    }
    out.diagonal = out.corner_weight;
    for (std::size_t t = 0; t < moved.triangles.size(); ++t)
        for (const auto v : moved.triangles[t]) out.diagonal[v] += out.middle_weight[t] / 9;
    return out;
}

std::vector<double> SurfaceFit::times(const std::vector<double>& x) const {
    std::vector<double> out(x.size());
    for (std::size_t v = 0; v < x.size(); ++v) out[v] = corner_weight[v] * x[v];
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        const auto& [a, b, c] = triangles[t];
        const double share = middle_weight[t] * (x[a] + x[b] + x[c]) / 9;
        out[a] += share;
        out[b] += share;
        out[c] += share;
    }
    return out;
}

std::vector<double> SurfaceFit::fitted(const std::vector<double>& seen) const {
    constexpr int rounds = 6;
    const std::size_t vertices = diagonal.size();
    std::vector<double> x(vertices, 0), residual(vertices, 0);
    for (std::size_t v = 0; v < vertices; ++v) {
        x[v] = corner_weight[v] > 0 ? seen[v] : 0;
        residual[v] = corner_weight[v] * seen[v];
    }
    for (std::size_t t = 0; t < triangles.size(); ++t)
        for (const auto v : triangles[t]) residual[v] += middle_weight[t] * seen[vertices + t] / 3;
    const auto product = times(x);
    std::vector<double> direction(vertices);
    double product_before = 0;
    for (std::size_t v = 0; v < vertices; ++v) {
        residual[v] -= product[v];
        direction[v] = diagonal[v] > 0 ? residual[v] / diagonal[v] : 0;
        product_before += residual[v] * direction[v];
    }
    for (int round = 0; round < rounds && product_before > 0; ++round) {
        const auto image = times(direction);
        double along = 0;
        for (std::size_t v = 0; v < vertices; ++v) along += direction[v] * image[v];
        if (!(along > 0)) break;
        const double step = product_before / along;
        double product_after = 0;
        for (std::size_t v = 0; v < vertices; ++v) {
            x[v] += step * direction[v];
            residual[v] -= step * image[v];
            if (diagonal[v] > 0) product_after += residual[v] * residual[v] / diagonal[v];
        }
        for (std::size_t v = 0; v < vertices; ++v)
            direction[v] =
                (diagonal[v] > 0 ? residual[v] / diagonal[v] : 0) + product_after / product_before * direction[v];
        product_before = product_after;
    }
    std::vector<bool> known(vertices);
    for (std::size_t v = 0; v < vertices; ++v) known[v] = diagonal[v] > 0;
    fill_gaps(x, std::move(known), triangles);
    return x;
}

// The distance of each sample from the surface along its normal, in lattice units.
std::vector<double> distances(const SurfaceSamples& samples, const std::vector<SurfacePoint>& targets) {
    std::vector<double> out(targets.size(), 0);
    for (std::size_t i = 0; i < targets.size(); ++i) {
        if (!targets[i].found()) continue;
        for (std::size_t axis = 0; axis < 3; ++axis)
            out[i] +=
                (static_cast<double>(targets[i].point[axis]) - samples.points[i][axis]) * samples.normals[i][axis];
    }
    return out;
}

// The colour of the surface at each sample minus that of the reference there: a list of levels per component.
std::array<std::vector<double>, 3> colour_changes(const MovedReference& moved, const LatticeMesh& captured,
                                                  const std::vector<SurfacePoint>& targets, Threads threads) {
    std::array<std::vector<double>, 3> out;
    for (auto& component : out) component.assign(targets.size(), 0);
    const std::size_t vertices = moved.positions.size();
    const auto look_at = [&](std::size_t i) {
        const auto& t = captured.triangles[targets[i].triangle];
        const auto& share = targets[i].shares;
        for (std::size_t c = 0; c < 3; ++c) {
            double level = 0;
            for (std::size_t corner = 0; corner < 3; ++corner)
                level += static_cast<double>(share[corner]) * captured.colours[t[corner]][c];
            if (i < vertices) {
                level -= moved.colours[i][c];
            } else {
                for (const auto v : moved.triangles[i - vertices]) level -= moved.colours[v][c] / 3.0;
            }
            out[c][i] = level;
        }
    };
    parallel_for(targets.size(), threads, 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            if (targets[i].found()) look_at(i);
    });
    return out;
}

}  // namespace

SurfaceIndex captured_surface(const LatticeMesh& mesh, const DeformationOptions& options) {
    // The cells must not be too fine for the search to go through, as for captures with tiny triangles, or none. Every
    // eighth triangle gives a good enough estimate of the edges.
    const double edge =
        std::max({mean_edge(mesh.positions, mesh.triangles, 8), options.far_reach * options.millimetre / 48, 1.0});
    SurfaceIndex out(
        points_of(mesh.positions), mesh.triangles,
        {.cell = static_cast<float>(2 * edge), .samples = options.back_samples, .threads = options.threads});
    out.colours = mesh.colours;
    return out;
}

TrackedTargets find_tracked_targets(const MovedReference& moved, const LatticeMesh& captured,
                                    const SurfaceIndex& surface, double reach, Threads threads) {
    const auto samples = samples_of(moved);
    const auto targets =
        closest_facing(surface, samples.points, samples.normals, {.reach = static_cast<float>(reach)}, threads);
    const auto fit = make_surface_fit(moved, targets);
    std::vector<std::vector<double>> seen(1);
    seen[0] = distances(samples, targets);
    if (!moved.colours.empty())
        for (auto& component : colour_changes(moved, captured, targets, threads)) seen.push_back(std::move(component));
    parallel_for(seen.size(), threads, 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) seen[c] = fit.fitted(seen[c]);
    });
    TrackedTargets out;
    const std::size_t vertices = moved.positions.size();
    out.displacement.resize(vertices);
    // A field cannot code more than this: 16 mm on the finest lattice. The surface then lags behind by the rest.
    constexpr double most = field_limit;
    for (std::size_t v = 0; v < vertices; ++v)
        out.displacement[v] = static_cast<std::int32_t>(std::lround(std::clamp(seen[0][v], -most, most)));
    if (moved.colours.empty()) return out;
    out.colours.resize(3 * vertices);
    for (std::size_t v = 0; v < vertices; ++v)
        for (std::size_t c = 0; c < 3; ++c)
            out.colours[3 * v + c] = static_cast<std::int32_t>(std::lround(std::clamp(seen[1 + c][v], -255.0, 255.0)));
    return out;
}

namespace {

CubeErrors::Cube cube_of(const Point3f& point, double side) {
    CubeErrors::Cube out{};
    for (std::size_t axis = 0; axis < 3; ++axis)
        out[axis] = static_cast<std::int32_t>(std::floor(static_cast<double>(point[axis]) / side));
    return out;
}

}  // namespace

double CubeErrors::worst() const {
    double out = 0;
    for (const auto& region : rms) out = std::max(out, region.second);
    return out;
}

double CubeErrors::at(const Point3f& point) const {
    const auto cube = cube_of(point, side);
    const auto found = std::lower_bound(rms.begin(), rms.end(), cube,
                                        [](const auto& region, const Cube& other) { return region.first < other; });
    return found != rms.end() && found->first == cube ? found->second : 0;
}

CubeErrors cube_errors(std::span<const Point3f> samples, std::span<const double> squared, double side,
                       std::ptrdiff_t fewest, std::ptrdiff_t left_out) {
    std::vector<std::pair<CubeErrors::Cube, double>> sorted;
    sorted.reserve(samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) sorted.emplace_back(cube_of(samples[i], side), squared[i]);
    std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
        return a.first != b.first ? a.first < b.first : a.second < b.second;
    });
    CubeErrors out{side};
    for (auto i = sorted.begin(), j = i; i != sorted.end(); i = j) {
        j = std::find_if(i, sorted.end(), [&](const auto& sample) { return sample.first != i->first; });
        if (j - i < fewest) continue;
        const double sum = std::accumulate(i, j - left_out, 0.0,
                                           [](double total, const auto& sample) { return total + sample.second; });
        out.rms.emplace_back(i->first, std::sqrt(sum / static_cast<double>(j - i - left_out)));
    }
    return out;
}

namespace {

// Every n-th vertex, and the centre of every n-th triangle.
SurfaceSamples sparse_samples_of(std::span<const Point3f> points, std::span<const Point3f> normals,
                                 std::span<const Triangle> triangles) {
    constexpr std::size_t wanted = 2000;  // of each
    SurfaceSamples out;
    for (std::size_t v = 0, every = 1 + points.size() / wanted; v < points.size(); v += every) {
        out.points.push_back(points[v]);
        out.normals.push_back(normals[v]);
    }
    for (std::size_t t = 0, every = 1 + triangles.size() / wanted; t < triangles.size(); t += every)
        add_middle(out, points, normals, triangles[t]);
    return out;
}

TrackedFit summed_up(const std::vector<Point3f>& points, const std::vector<double>& squared,
                     const TrackedFitOptions& options) {
    // One sample that found the wrong sheet does not mean that a region is lost.
    constexpr std::ptrdiff_t fewest = 10, left_out = 2;
    if (points.empty()) return {};
    double squares = 0;
    std::size_t strays = 0;
    for (const double distance : squared) {
        squares += distance;
        if (distance > options.stray * options.stray) ++strays;
    }
    const auto count = static_cast<double>(points.size());
    return {std::sqrt(squares / count),
            static_cast<double>(strays) / count,
            cube_errors(points, squared, options.region, fewest, left_out).worst(),
            {}};
}

// The captured surface is so fine that searching the triangles around the nearest vertex suffices; its normals tell the
// two sides of, say, a sleeve apart.
std::vector<double> distances_of_decoded(const SurfaceSamples& decoded, const SurfaceIndex& captured,
                                         const TrackedFitOptions& options) {
    const auto found = closest_facing(captured, decoded.points, decoded.normals,
                                      {.reach = static_cast<float>(options.reach), .agreement = 0}, options.threads);
    std::vector<double> squared(found.size(), options.reach * options.reach);
    for (std::size_t i = 0; i < found.size(); ++i)
        if (found[i].found()) squared[i] = static_cast<double>(found[i].squared_distance);
    return squared;
}

TrackedFit fit_of_captured(const SurfaceSamples& captured, const SurfaceIndex& decoded,
                           const TrackedFitOptions& options) {
    std::vector<double> squared(captured.points.size(), options.reach * options.reach);
    if (!decoded.empty())
        parallel_for(squared.size(), options.threads, 512, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                squared[i] = static_cast<double>(decoded.closest(captured.points[i]).squared_distance);
        });
    return summed_up(captured.points, squared, options);
}

}  // namespace

TrackedFit least_of(TrackedFit fit, const TrackedFit& before) {
    fit.stray_share = std::min(fit.stray_share, before.stray_share);
    fit.worst_region = std::min(fit.worst_region, before.worst_region);
    return fit;
}

TrackedFit measure_tracked_fit(const SurfaceIndex& captured, const LatticeMesh& decoded,
                               std::span<const double> intra_squared, const TrackedFitOptions& options) {
    const auto points = points_of(decoded.positions);
    const auto forth = fit_of_captured(sparse_samples_of(captured.positions, captured.normals, captured.triangles),
                                       SurfaceIndex(points, decoded.triangles), options);
    const auto samples =
        sparse_samples_of(points, points_of(vertex_normals(decoded.positions, decoded.triangles)), decoded.triangles);
    auto squared = distances_of_decoded(samples, captured, options);
    std::vector<double> more(squared.size(), 0);
    if (intra_squared.size() == squared.size())
        for (std::size_t i = 0; i < squared.size(); ++i) more[i] = std::max(0.0, squared[i] - intra_squared[i]);
    const auto back = summed_up(samples.points, more, options);
    return {std::max(forth.rms, back.rms), std::max(forth.stray_share, back.stray_share),
            std::max(forth.worst_region, back.worst_region), std::move(squared)};
}

LatticeMesh welded(const LatticeMesh& captured) {
    LatticeMesh places;
    places.positions = captured.positions;
    const auto merging = find_duplicates(places);
    auto out = kept_vertices(captured, merging.kept);
    out.triangles = merged_triangles(captured.triangles, merging, false);
    return out;
}

namespace {

LatticeMesh with_fewer_vertices(const LatticeMesh& captured, const SimplifiedReferenceOptions& options) {
    std::vector<Eigen::Vector3d> points;
    points.reserve(captured.positions.size());
    for (const auto p : captured.positions) points.emplace_back(p.x, p.y, p.z);
    SimplificationOptions simplification;
    simplification.surface_error = options.surface_error;
    simplification.colour_error = options.colour_error;
    simplification.longest_edge = options.longest_edge;
    auto simplified = simplify(points, captured.triangles, captured.colours, simplification);
    LatticeMesh out;
    const auto whole = [](double c) { return within_lattice(std::llround(c)); };
    for (const auto& p : simplified.positions) out.positions.push_back({whole(p.x()), whole(p.y()), whole(p.z())});
    out.triangles = std::move(simplified.triangles);
    const auto level = [](double c) { return static_cast<std::uint8_t>(std::lround(std::clamp(c, 0.0, 255.0))); };
    for (const auto& c : simplified.colours) out.colours.push_back({level(c[0]), level(c[1]), level(c[2])});
    return out;
}

// Moves the vertices, and sets their colours, so that the triangles between them come as near as possible to the
// captured surface: the collapses placed each vertex for itself alone.
void fit_to_surface(LatticeMesh& mesh, const LatticeMesh& captured, const SurfaceIndex& surface,
                    const SimplifiedReferenceOptions& options) {
    const auto normals = vertex_normals(mesh.positions, mesh.triangles);
    const auto targets = find_tracked_targets({mesh.positions, normals, mesh.triangles, mesh.colours}, captured,
                                              surface, options.reach, options.threads);
    mesh.positions = displaced(mesh.positions, normals, targets.displacement);
    if (!mesh.colours.empty()) mesh.colours = recoloured(mesh.colours, targets.colours);
}

}  // namespace

LatticeMesh simplified_piece(const LatticeMesh& piece, const LatticeMesh& captured, const SurfaceIndex& surface,
                             const SimplifiedReferenceOptions& options) {
    auto out = with_fewer_vertices(piece, options);
    fit_to_surface(out, captured, surface, options);
    return out;
}

LatticeMesh simplified_reference(const LatticeMesh& captured, const SurfaceIndex& surface,
                                 const SimplifiedReferenceOptions& options) {
    if (captured.triangles.empty() || !captured.texcoords.empty()) return captured;
    auto out = simplified_piece(welded(captured), captured, surface, options);
    if (!captured.normals.empty()) out.normals = quantised_normals(vertex_normals(out.positions, out.triangles));
    return out;
}

}  // namespace htvm::internal
