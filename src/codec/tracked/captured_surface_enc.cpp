#include "codec/tracked/captured_surface_enc.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
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

// Where within a triangle samples lie, and how much of its area each stands for. Both rules integrate the square of a
// linear function exactly.
struct InnerSample {
    std::array<double, 3> shares{};  // of the corners
    double weight = 0;
};
struct SampleRule {
    double corner_weight = 0;  // of the vertices, per triangle
    std::span<const InnerSample> inner;
};

SampleRule rule_of(TargetSamples samples) {
    static constexpr std::array<InnerSample, 1> middle = {{{{1.0 / 3, 1.0 / 3, 1.0 / 3}, 3.0 / 4}}};
    static constexpr std::array<InnerSample, 3> three = {{{{2.0 / 3, 1.0 / 6, 1.0 / 6}, 1.0 / 3},
                                                          {{1.0 / 6, 2.0 / 3, 1.0 / 6}, 1.0 / 3},
                                                          {{1.0 / 6, 1.0 / 6, 2.0 / 3}, 1.0 / 3}}};
    if (samples == TargetSamples::middles) return {1.0 / 12, middle};
    return {0, three};
}

// The samples at which the captured surface is examined: the moved reference's vertices, then those within each of its
// triangles.
SurfaceSamples samples_of(const MovedReference& moved, const SampleRule& rule) {
    SurfaceSamples out;
    const auto count = moved.positions.size() + rule.inner.size() * moved.triangles.size();
    out.points.reserve(count);
    out.normals.reserve(count);
    out.points = points_of(moved.positions);
    out.normals = points_of(moved.normals);
    for (const auto& t : moved.triangles)
        for (const auto& sample : rule.inner) {
            Vector3d point{}, normal{};
            for (std::size_t i = 0; i < 3; ++i) {
                point = point + to_vector(moved.positions[t[i]]) * sample.shares[i];
                normal = normal + moved.normals[t[i]] * sample.shares[i];
            }
            out.points.push_back(to_floats(point));
            out.normals.push_back(to_floats(normalised(normal)));
        }
    return out;
}

// Finds the function on the mesh, linear within each triangle, that is nearest to the values at the samples: least
// squares by conjugate gradients, with the weights that integrate squares exactly.
struct SurfaceFit {
    std::span<const Triangle> triangles;
    SampleRule rule;
    std::vector<double> corner_weight, inner_weight;  // zero if the sample has no value
    std::vector<double> diagonal;

    // Two functions at a time, which takes vector instructions no longer than one.
    using Both = std::array<double, 2>;
    std::vector<Both> times(const std::vector<Both>& x) const;
    std::array<std::vector<double>, 2> fitted(const std::vector<Both>& seen) const;
};

SurfaceFit make_surface_fit(const MovedReference& moved, const SampleRule& rule,
                            const std::vector<SurfacePoint>& targets) {
    const std::size_t vertices = moved.positions.size(), inner = rule.inner.size();
    SurfaceFit out;
    out.triangles = moved.triangles;
    out.rule = rule;
    out.corner_weight.assign(vertices, 0);
    out.inner_weight.assign(inner * moved.triangles.size(), 0);
    for (std::size_t t = 0; t < moved.triangles.size(); ++t) {
        const auto& corners = moved.triangles[t];
        const double area = length(area_vector(moved.positions, corners)) / 2;
        for (const auto v : corners)
            if (targets[v].found()) out.corner_weight[v] += area * rule.corner_weight;
        for (std::size_t k = 0; k < inner; ++k)
            if (targets[vertices + inner * t + k].found())
                out.inner_weight[inner * t + k] = area * rule.inner[k].weight;
    }
    out.diagonal = out.corner_weight;
    for (std::size_t t = 0; t < moved.triangles.size(); ++t)
        for (std::size_t k = 0; k < inner; ++k)
            for (std::size_t i = 0; i < 3; ++i)
                out.diagonal[moved.triangles[t][i]] +=
                    out.inner_weight[inner * t + k] * rule.inner[k].shares[i] * rule.inner[k].shares[i];
    return out;
}

std::vector<SurfaceFit::Both> SurfaceFit::times(const std::vector<Both>& x) const {
    std::vector<Both> out(x.size());
    for (std::size_t v = 0; v < x.size(); ++v)
        for (std::size_t i = 0; i < 2; ++i) out[v][i] = corner_weight[v] * x[v][i];
    const double* weight = inner_weight.data();
    for (const auto& [a, b, c] : triangles)
        for (const auto& sample : rule.inner) {
            const auto& s = sample.shares;
            Both value{};
            for (std::size_t i = 0; i < 2; ++i) value[i] = *weight * (s[0] * x[a][i] + s[1] * x[b][i] + s[2] * x[c][i]);
            for (std::size_t i = 0; i < 2; ++i) out[a][i] += s[0] * value[i];
            for (std::size_t i = 0; i < 2; ++i) out[b][i] += s[1] * value[i];
            for (std::size_t i = 0; i < 2; ++i) out[c][i] += s[2] * value[i];
            ++weight;
        }
    return out;
}

std::array<std::vector<double>, 2> SurfaceFit::fitted(const std::vector<Both>& seen) const {
    constexpr int rounds = 4;  // two more change the bytes by nothing that can be told from chance
    const std::size_t vertices = diagonal.size();
    std::vector<Both> x(vertices), residual(vertices);
    for (std::size_t v = 0; v < vertices; ++v)
        for (std::size_t i = 0; i < 2; ++i) {
            x[v][i] = seen[v][i];  // zero if there is none
            residual[v][i] = corner_weight[v] * seen[v][i];
        }
    const std::size_t inner = rule.inner.size();
    for (std::size_t place = 0; place < inner_weight.size(); ++place)
        for (std::size_t corner = 0; corner < 3; ++corner)
            for (std::size_t i = 0; i < 2; ++i)
                residual[triangles[place / inner][corner]][i] +=
                    inner_weight[place] * rule.inner[place % inner].shares[corner] * seen[vertices + place][i];
    const auto product = times(x);
    std::vector<Both> direction(vertices);
    Both product_before{};
    for (std::size_t v = 0; v < vertices; ++v)
        for (std::size_t i = 0; i < 2; ++i) {
            residual[v][i] -= product[v][i];
            direction[v][i] = diagonal[v] > 0 ? residual[v][i] / diagonal[v] : 0;
            product_before[i] += residual[v][i] * direction[v][i];
        }
    for (int round = 0; round < rounds && (product_before[0] > 0 || product_before[1] > 0); ++round) {
        const auto image = times(direction);
        Both along{}, step{}, product_after{}, turn{};
        for (std::size_t v = 0; v < vertices; ++v)
            for (std::size_t i = 0; i < 2; ++i) along[i] += direction[v][i] * image[v][i];
        // A function that is done stays as it is.
        for (std::size_t i = 0; i < 2; ++i)
            step[i] = along[i] > 0 && product_before[i] > 0 ? product_before[i] / along[i] : 0;
        for (std::size_t v = 0; v < vertices; ++v) {
            const double per_weight = diagonal[v] > 0 ? 1 / diagonal[v] : 0;
            for (std::size_t i = 0; i < 2; ++i) {
                x[v][i] += step[i] * direction[v][i];
                residual[v][i] -= step[i] * image[v][i];
                product_after[i] += residual[v][i] * residual[v][i] * per_weight;
            }
        }
        for (std::size_t i = 0; i < 2; ++i) turn[i] = step[i] > 0 ? product_after[i] / product_before[i] : 0;
        for (std::size_t v = 0; v < vertices; ++v) {
            const double per_weight = diagonal[v] > 0 ? 1 / diagonal[v] : 0;
            for (std::size_t i = 0; i < 2; ++i)
                direction[v][i] = residual[v][i] * per_weight + turn[i] * direction[v][i];
        }
        for (std::size_t i = 0; i < 2; ++i) product_before[i] = step[i] > 0 ? product_after[i] : 0;
    }
    std::vector<bool> known(vertices);
    for (std::size_t v = 0; v < vertices; ++v) known[v] = diagonal[v] > 0;
    std::array<std::vector<double>, 2> out;
    for (std::size_t i = 0; i < 2; ++i) {
        out[i].resize(vertices);
        for (std::size_t v = 0; v < vertices; ++v) out[i][v] = x[v][i];
        fill_gaps(out[i], known, triangles);
    }
    return out;
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
std::array<std::vector<double>, 3> colour_changes(const MovedReference& moved, const SampleRule& rule,
                                                  const LatticeMesh& captured, const std::vector<SurfacePoint>& targets,
                                                  Threads threads) {
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
                const auto& corners = moved.triangles[(i - vertices) / rule.inner.size()];
                const auto& shares = rule.inner[(i - vertices) % rule.inner.size()].shares;
                for (std::size_t corner = 0; corner < 3; ++corner)
                    level -= shares[corner] * moved.colours[corners[corner]][c];
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
                                    const SurfaceIndex& surface, const TargetSearch& how) {
    const auto& threads = how.threads;
    const auto rule = rule_of(how.samples);
    const auto samples = samples_of(moved, rule);
    const auto targets = closest_facing(surface, samples.points, samples.normals,
                                        {.reach = static_cast<float>(how.reach), .along = true}, threads);
    const auto fit = make_surface_fit(moved, rule, targets);
    std::vector<std::vector<double>> seen(1);
    seen[0] = distances(samples, targets);
    if (!moved.colours.empty())
        for (auto& component : colour_changes(moved, rule, captured, targets, threads))
            seen.push_back(std::move(component));
    parallel_for((seen.size() + 1) / 2, threads, 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t pair = begin; pair < end; ++pair) {
            const bool two = 2 * pair + 1 < seen.size();
            std::vector<SurfaceFit::Both> both(targets.size());
            for (std::size_t i = 0; i < both.size(); ++i)
                both[i] = {seen[2 * pair][i], two ? seen[2 * pair + 1][i] : 0};
            auto fitted = fit.fitted(both);
            seen[2 * pair] = std::move(fitted[0]);
            if (two) seen[2 * pair + 1] = std::move(fitted[1]);
        }
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
    // Neighbouring samples mostly lie in the same cube.
    std::map<CubeErrors::Cube, std::vector<double>> in_cubes;
    std::vector<double>* values = nullptr;
    CubeErrors::Cube last{};
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const auto cube = cube_of(samples[i], side);
        if (!values || cube != last) values = &in_cubes[last = cube];
        values->push_back(squared[i]);
    }
    CubeErrors out{side};
    for (auto& [cube, of_cube] : in_cubes) {
        const auto count = std::ssize(of_cube);
        if (count < fewest) continue;
        const auto end = of_cube.end() - left_out;
        if (left_out > 0) std::nth_element(of_cube.begin(), end, of_cube.end());
        out.rms.emplace_back(
            cube, std::sqrt(std::accumulate(of_cube.begin(), end, 0.0) / static_cast<double>(count - left_out)));
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
    const auto reach = static_cast<float>(options.reach);
    std::vector<double> squared(captured.points.size(), options.reach * options.reach);
    parallel_for(squared.size(), options.threads, 512, [&](std::size_t begin, std::size_t end) {
        std::uint32_t guess = OrientedPoints::no_point;
        for (std::size_t i = begin; i < end; ++i) {
            const auto found = decoded.closest_within(captured.points[i], reach, guess);
            if (found.found()) squared[i] = std::min(squared[i], static_cast<double>(found.squared_distance));
        }
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
    const double edge = mean_edge(decoded.positions, decoded.triangles, 8);
    const SurfaceIndex index(
        points_of(decoded.positions), decoded.triangles,
        {.cell = static_cast<float>(std::max(2 * edge, options.reach / 24)), .threads = options.threads});
    const auto forth =
        fit_of_captured(sparse_samples_of(captured.positions, captured.normals, captured.triangles), index, options);
    const auto samples = sparse_samples_of(index.positions, index.normals, index.triangles);
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

LatticeMesh with_fewer_vertices(const LatticeMesh& captured, bool keep_tips,
                                const SimplifiedReferenceOptions& options) {
    std::vector<Eigen::Vector3d> points;
    points.reserve(captured.positions.size());
    for (const auto p : captured.positions) points.emplace_back(p.x, p.y, p.z);
    SimplificationOptions simplification;
    simplification.surface_error = options.surface_error;
    simplification.colour_error = options.colour_error;
    simplification.longest_edge = options.longest_edge;
    simplification.keep_tips = keep_tips;
    simplification.threads = options.threads;
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
                                              surface, {.reach = options.reach, .threads = options.threads});
    mesh.positions = displaced(mesh.positions, normals, targets.displacement);
    if (!mesh.colours.empty()) mesh.colours = recoloured(mesh.colours, targets.colours);
}

}  // namespace

LatticeMesh simplified_piece(const LatticeMesh& piece, const LatticeMesh& captured, const SurfaceIndex& surface,
                             const SimplifiedReferenceOptions& options) {
    // Its border is met by a strip of triangles, which is found more often where it has no tips.
    auto out = with_fewer_vertices(piece, false, options);
    fit_to_surface(out, captured, surface, options);
    return out;
}

LatticeMesh simplified_reference(const LatticeMesh& captured, const SurfaceIndex& surface,
                                 const SimplifiedReferenceOptions& options) {
    if (captured.triangles.empty() || !captured.texcoords.empty()) return captured;
    auto out = with_fewer_vertices(welded(captured), true, options);
    fit_to_surface(out, captured, surface, options);
    if (!captured.normals.empty()) out.normals = quantised_normals(vertex_normals(out.positions, out.triangles));
    return out;
}

}  // namespace htvm::internal
