#include "codec/encoder/tracked/captured_surface.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>

#include "core/disjoint_sets.h"
#include "core/parallel.h"
#include "surface/hole_filling.h"
#include "surface/open_border.h"
#include "surface/simplification.h"
#include "surface/surface_index.h"

namespace htvm::internal {

namespace {

// The values of four functions at one place: the distance, then three components of colour. Floats do, since what comes
// of them is rounded to whole lattice units and levels; four of them are one vector.
using Four = std::array<float, 4>;

// Fills in values where nothing is known with the mean of the neighbours, from the rim inwards; zero if no neighbour is
// ever known.
void fill_gaps(std::vector<Four>& values, std::vector<bool> known, std::span<const Triangle> triangles) {
    constexpr int rounds = 24;
    if (std::find(known.begin(), known.end(), false) == known.end()) return;
    std::vector<Triangle> open;
    const auto is_known = [&](const Triangle& t) { return known[t[0]] && known[t[1]] && known[t[2]]; };
    std::copy_if(triangles.begin(), triangles.end(), std::back_inserter(open),
                 [&](const auto& t) { return !is_known(t); });
    std::vector<Four> sum(values.size());
    std::vector<float> count(values.size());
    for (int round = 0; round < rounds && !open.empty(); ++round) {
        for (const auto& t : open)
            for (const auto to : t) {
                if (known[to]) continue;
                for (const auto from : t) {
                    if (!known[from]) continue;
                    for (std::size_t i = 0; i < 4; ++i) sum[to][i] += values[from][i];
                    ++count[to];
                }
            }
        bool any = false;
        for (const auto& t : open)
            for (const auto v : t) {
                if (known[v] || count[v] == 0) continue;
                for (std::size_t i = 0; i < 4; ++i) values[v][i] = sum[v][i] / count[v];
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

// A sample within a triangle of the reference.
struct InnerSample {
    Triangle corners{};
    std::array<float, 3> shares{};  // of the corners
    float weight = 0;               // the area that it stands for, by the largest triangle's
};

// The samples at which the captured surface is examined: the moved reference's vertices, then those within its
// triangles.
struct TargetPlaces {
    SurfaceSamples samples;
    std::vector<float> corner_weight;  // of each vertex, as InnerSample::weight
    std::vector<InnerSample> inner;
    std::vector<Colour> colours;  // that are shown at these; none: what the corners' shares make
};

// Where within a triangle samples lie, and how much of its area each stands for. Both rules integrate the square of a
// linear function exactly.
struct SampleRule {
    float corner_weight = 0;  // of the vertices, per triangle
    std::span<const InnerSample> inner;
};

SampleRule rule_of(TargetSamples samples) {
    constexpr float third = 1.0F / 3, sixth = 1.0F / 6;
    static constexpr std::array<InnerSample, 1> middle = {{{{}, {third, third, third}, 0.75F}}};
    static constexpr std::array<InnerSample, 3> three = {{{{}, {2 * third, sixth, sixth}, third},
                                                          {{}, {sixth, 2 * third, sixth}, third},
                                                          {{}, {sixth, sixth, 2 * third}, third}}};
    if (samples == TargetSamples::middles) return {1.0F / 12, middle};
    return {0, three};
}

// Twice the area of each triangle, by the largest.
std::vector<float> relative_areas(std::span<const LatticePoint> positions, std::span<const Triangle> triangles) {
    std::vector<float> out;
    out.reserve(triangles.size());
    for (const auto& t : triangles) out.push_back(static_cast<float>(length(area_vector(positions, t))));
    const float largest = out.empty() ? 1 : std::max(*std::max_element(out.begin(), out.end()), 1e-6F);
    for (auto& area : out) area /= largest;
    return out;
}

// In flat triangles, by a rule.
TargetPlaces places_in_triangles(const MovedReference& moved, const SampleRule& rule) {
    TargetPlaces out;
    const auto count = moved.positions.size() + rule.inner.size() * moved.triangles.size();
    auto& [points, normals] = out.samples;
    points.reserve(count);
    normals.reserve(count);
    points = points_of(moved.positions);
    normals = points_of(moved.normals);
    out.corner_weight.assign(moved.positions.size(), 0);
    out.inner.reserve(rule.inner.size() * moved.triangles.size());
    const auto areas = relative_areas(moved.positions, moved.triangles);
    for (std::size_t triangle = 0; triangle < moved.triangles.size(); ++triangle) {
        const auto& t = moved.triangles[triangle];
        for (const auto v : t) out.corner_weight[v] += areas[triangle] * rule.corner_weight;
        for (const auto& sample : rule.inner) {
            Vector3d point{}, normal{};
            for (std::size_t i = 0; i < 3; ++i) {
                point = point + to_vector(moved.positions[t[i]]) * static_cast<double>(sample.shares[i]);
                normal = normal + moved.normals[t[i]] * static_cast<double>(sample.shares[i]);
            }
            points.push_back(to_floats(point));
            normals.push_back(to_floats(normalised(normal)));
            out.inner.push_back({t, sample.shares, areas[triangle] * sample.weight});
        }
    }
    return out;
}

// The middle between two places on the reference, which lie on one of its triangles.
InnerSample middle_of(const InnerSample& a, const InnerSample& b) {
    InnerSample out = a;
    for (auto& share : out.shares) share /= 2;
    for (std::size_t i = 0; i < 3; ++i) {
        if (b.shares[i] <= 0) continue;
        std::size_t at = 0;
        while (at < 3 && !(out.shares[at] > 0 && out.corners[at] == b.corners[i])) ++at;
        if (at == 3)
            at = static_cast<std::size_t>(std::min_element(out.shares.begin(), out.shares.end()) - out.shares.begin());
        out.corners[at] = b.corners[i];
        out.shares[at] += b.shares[i] / 2;
    }
    return out;
}

// Where each vertex of the first levels of detail lies on the reference's triangles, behind those of its own vertices.
std::vector<InnerSample> places_of_detail(const SurfaceDetail& detail, std::size_t levels, std::size_t vertices) {
    std::vector<InnerSample> out;
    for (std::uint32_t v = 0; v < vertices; ++v) out.push_back({{v, v, v}, {1, 0, 0}, 0});
    for (std::size_t k = 0; k < levels; ++k)
        for (const auto& s : detail.levels[k].stencils) out.push_back(middle_of(out[s.a], out[s.b]));
    return out;
}

// On the surface as it is shown: at the vertices of its detail. The captured surface is met all over a large triangle,
// so that what the detail leaves off in one place is not taken for all of it.
TargetPlaces places_on_detail(const MovedReference& moved) {
    const auto& detail = *moved.detail;
    const std::size_t vertices = moved.positions.size(), levels = levels_to_sample(detail, vertices);
    const std::span<const Triangle> triangles = detail.triangles(levels);
    std::vector<LatticePoint> shown(moved.positions.begin(), moved.positions.end());
    add_detail(detail, levels, moved.triangles, shown);
    TargetPlaces out;
    out.samples = {points_of(shown), points_of(vertex_normals(shown, triangles))};
    std::vector<float> weight(shown.size(), 0);
    const auto areas = relative_areas(shown, triangles);
    for (std::size_t t = 0; t < triangles.size(); ++t)
        for (const auto v : triangles[t]) weight[v] += areas[t] / 3;
    const auto places = places_of_detail(detail, levels, vertices);
    out.corner_weight.assign(weight.begin(), weight.begin() + static_cast<std::ptrdiff_t>(vertices));
    for (std::size_t v = vertices; v < shown.size(); ++v)
        out.inner.push_back({places[v].corners, places[v].shares, weight[v]});
    if (moved.colours.empty()) return out;
    out.colours.assign(moved.colours.begin(), moved.colours.end());
    add_detail(detail, levels, out.colours);
    out.colours.erase(out.colours.begin(), out.colours.begin() + static_cast<std::ptrdiff_t>(vertices));
    return out;
}

// Finds the functions on the mesh, linear within each triangle, that are nearest to the values at the samples: least
// squares by conjugate gradients, with the weights that integrate squares exactly.
struct SurfaceFit {
    std::span<const Triangle> triangles;
    std::vector<float> corner_weight;  // zero if the sample has no value
    std::vector<InnerSample> inner;    // likewise their weights
    std::vector<float> per_diagonal;   // 1 / the matrix's diagonal; 0 where that is 0

    std::vector<Four> times(const std::vector<Four>& x) const;
    std::vector<Four> fitted(std::span<const Four> seen) const;
};

SurfaceFit make_surface_fit(const MovedReference& moved, const TargetPlaces& places,
                            const std::vector<SurfacePoint>& targets) {
    const std::size_t vertices = moved.positions.size();
    SurfaceFit out{moved.triangles, places.corner_weight, places.inner, {}};
    std::vector<float> diagonal(vertices, 0);
    for (std::size_t i = 0; i < out.inner.size(); ++i) {
        auto& sample = out.inner[i];
        if (!targets[vertices + i].found()) sample.weight = 0;
        for (std::size_t c = 0; c < 3; ++c)
            diagonal[sample.corners[c]] += sample.weight * sample.shares[c] * sample.shares[c];
    }
    for (std::size_t v = 0; v < vertices; ++v) {
        if (!targets[v].found()) out.corner_weight[v] = 0;
        diagonal[v] += out.corner_weight[v];
        out.per_diagonal.push_back(diagonal[v] > 0 ? 1 / diagonal[v] : 0);
    }
    return out;
}

std::vector<Four> SurfaceFit::times(const std::vector<Four>& x) const {
    std::vector<Four> out(x.size());
    for (std::size_t v = 0; v < x.size(); ++v)
        for (std::size_t i = 0; i < 4; ++i) out[v][i] = corner_weight[v] * x[v][i];
    for (const auto& sample : inner) {
        const auto& [a, b, c] = sample.corners;
        const auto& s = sample.shares;
        Four value{};
        for (std::size_t i = 0; i < 4; ++i)
            value[i] = sample.weight * (s[0] * x[a][i] + s[1] * x[b][i] + s[2] * x[c][i]);
        for (std::size_t i = 0; i < 4; ++i) out[a][i] += s[0] * value[i];
        for (std::size_t i = 0; i < 4; ++i) out[b][i] += s[1] * value[i];
        for (std::size_t i = 0; i < 4; ++i) out[c][i] += s[2] * value[i];
    }
    return out;
}

// seen: zero at samples that have no value.
std::vector<Four> SurfaceFit::fitted(std::span<const Four> seen) const {
    constexpr int rounds = 4;  // two more change the bytes by nothing that can be told from chance
    const std::size_t vertices = corner_weight.size();
    std::vector<Four> x(seen.begin(), seen.begin() + static_cast<std::ptrdiff_t>(vertices)), residual(vertices);
    for (std::size_t v = 0; v < vertices; ++v)
        for (std::size_t i = 0; i < 4; ++i) residual[v][i] = corner_weight[v] * seen[v][i];
    for (std::size_t place = 0; place < inner.size(); ++place)
        for (std::size_t corner = 0; corner < 3; ++corner) {
            auto& sum = residual[inner[place].corners[corner]];
            const float weight = inner[place].weight * inner[place].shares[corner];
            for (std::size_t i = 0; i < 4; ++i) sum[i] += weight * seen[vertices + place][i];
        }
    const auto product = times(x);
    std::vector<Four> direction(vertices);
    // Sums over all vertices are in doubles.
    using Sums = std::array<double, 4>;
    Sums product_before{};
    for (std::size_t v = 0; v < vertices; ++v)
        for (std::size_t i = 0; i < 4; ++i) {
            residual[v][i] -= product[v][i];
            direction[v][i] = residual[v][i] * per_diagonal[v];
            product_before[i] += static_cast<double>(residual[v][i] * direction[v][i]);
        }
    const auto goes_on = [&] {
        return std::any_of(product_before.begin(), product_before.end(), [](double p) { return p > 0; });
    };
    for (int round = 0; round < rounds && goes_on(); ++round) {
        const auto image = times(direction);
        Sums along{}, product_after{};
        Four step{}, turn{};
        for (std::size_t v = 0; v < vertices; ++v)
            for (std::size_t i = 0; i < 4; ++i) along[i] += static_cast<double>(direction[v][i] * image[v][i]);
        // A function that is done stays as it is.
        for (std::size_t i = 0; i < 4; ++i)
            step[i] = along[i] > 0 && product_before[i] > 0 ? static_cast<float>(product_before[i] / along[i]) : 0;
        for (std::size_t v = 0; v < vertices; ++v)
            for (std::size_t i = 0; i < 4; ++i) {
                x[v][i] += step[i] * direction[v][i];
                residual[v][i] -= step[i] * image[v][i];
                product_after[i] += static_cast<double>(residual[v][i] * residual[v][i] * per_diagonal[v]);
            }
        for (std::size_t i = 0; i < 4; ++i)
            turn[i] = step[i] > 0 ? static_cast<float>(product_after[i] / product_before[i]) : 0;
        for (std::size_t v = 0; v < vertices; ++v)
            for (std::size_t i = 0; i < 4; ++i)
                direction[v][i] = residual[v][i] * per_diagonal[v] + turn[i] * direction[v][i];
        for (std::size_t i = 0; i < 4; ++i) product_before[i] = step[i] > 0 ? product_after[i] : 0;
    }
    std::vector<bool> known(vertices);
    for (std::size_t v = 0; v < vertices; ++v) known[v] = per_diagonal[v] > 0;
    fill_gaps(x, std::move(known), triangles);
    return x;
}

// What of the surface is nearest to each sample: first to the vertices, then to what lies within the triangles,
// beginning where their first corners were found. near: a captured vertex that may be beside each vertex; set to those
// that are.
std::vector<SurfacePoint> targets_of(const TargetPlaces& places, const SurfaceIndex& surface, const TargetSearch& how,
                                     std::span<std::uint32_t> near) {
    const FacingReach within{.reach = static_cast<float>(how.reach.value), .along = true};
    const auto points = std::span(places.samples.points), normals = std::span(places.samples.normals);
    auto out =
        closest_facing(surface, points.first(near.size()), normals.first(near.size()), within, how.threads, near);
    std::vector<std::uint32_t> near_inner(points.size() - near.size());
    for (std::size_t i = 0; i < near_inner.size(); ++i) near_inner[i] = near[places.inner[i].corners[0]];
    const auto inner = closest_facing(surface, points.subspan(near.size()), normals.subspan(near.size()), within,
                                      how.threads, near_inner);
    out.insert(out.end(), inner.begin(), inner.end());
    return out;
}

// Whether a point of a surface lies on its border, and so far from the query along the surface that this may go on
// unseen. from_border: of the surface's vertices.
bool is_beyond_border(const SurfacePoint& found, const Triangle& corners, std::span<const std::uint8_t> from_border,
                      const Point3f& query, const Point3f& normal, float slip) {
    constexpr float none_of_it = 1e-3F;
    bool on_side = false;
    for (std::size_t i = 0; i < 3; ++i) {
        if (found.shares[i] <= none_of_it)
            on_side = true;
        else if (from_border[corners[i]] != 0)
            return false;
    }
    if (!on_side) return false;
    float across = 0, squared = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const float apart = found.point[axis] - query[axis];
        across += apart * normal[axis];
        squared += apart * apart;
    }
    return squared - across * across > slip * slip;
}

// What lies beyond the captured surface's border is not found.
void leave_out_what_is_beyond(const SurfaceSamples& samples, const SurfaceIndex& surface,
                              std::vector<SurfacePoint>& targets) {
    const float slip = 0.7F * surface.fine_gap;
    for (std::size_t i = 0; i < targets.size(); ++i)
        if (targets[i].found() && is_beyond_border(targets[i], surface.triangles[targets[i].triangle],
                                                   surface.from_border, samples.points[i], samples.normals[i], slip))
            targets[i] = {};
}

// At each sample, how far the surface is along its normal, in lattice units, and what its colour is less that of the
// reference, in levels.
std::vector<Four> seen_at(const TargetPlaces& places, const MovedReference& moved, const LatticeMesh& captured,
                          const std::vector<SurfacePoint>& targets, Threads threads) {
    std::vector<Four> out(targets.size());
    const auto& samples = places.samples;
    const std::size_t vertices = moved.positions.size();
    const auto look_at = [&](std::size_t i) {
        auto& [distance, red, green, blue] = out[i];
        for (std::size_t axis = 0; axis < 3; ++axis)
            distance += (targets[i].point[axis] - samples.points[i][axis]) * samples.normals[i][axis];
        if (moved.colours.empty()) return;
        std::array<float, 3> colour{};
        const auto add = [&](const Colour& level, float share) {
            for (std::size_t c = 0; c < 3; ++c) colour[c] += share * static_cast<float>(level[c]);
        };
        const auto& t = captured.triangles[targets[i].triangle];
        for (std::size_t corner = 0; corner < 3; ++corner) add(captured.colours[t[corner]], targets[i].shares[corner]);
        if (i < vertices) {
            add(moved.colours[i], -1);
        } else if (!places.colours.empty()) {
            add(places.colours[i - vertices], -1);
        } else {
            const auto& sample = places.inner[i - vertices];
            for (std::size_t c = 0; c < 3; ++c) add(moved.colours[sample.corners[c]], -sample.shares[c]);
        }
        red = colour[0], green = colour[1], blue = colour[2];
    };
    parallel_for(targets.size(), threads, 4096, [&](std::size_t begin, std::size_t end) {
        constexpr std::size_t ahead = 8;
        for (std::size_t i = begin; i < end; ++i) {
            if (i + ahead < end && targets[i + ahead].found())
                __builtin_prefetch(&captured.triangles[targets[i + ahead].triangle]);
            if (targets[i].found()) look_at(i);
        }
    });
    return out;
}

}  // namespace

std::size_t levels_to_sample(const SurfaceDetail& detail, std::size_t vertices) {
    constexpr std::size_t most_often = 4;
    std::size_t out = 0, all = vertices;
    while (out < detail.levels.size() && all < most_often * vertices) all += detail.levels[out++].stencils.size();
    return out;
}

SurfaceIndex captured_surface(const LatticeMesh& mesh, const DeformationOptions& options) {
    // The cells must not be too fine for the search to go through, as for captures with tiny triangles, or none. Every
    // eighth triangle gives a good enough estimate of the edges.
    const double coarsest = options.scale.on_lattice(options.far_reach).value / 48;
    const double edge = std::max({mean_edge(mesh.positions, mesh.triangles, 8), coarsest, 1.0});
    SurfaceIndex out(
        points_of(mesh.positions), mesh.triangles,
        {.cell = static_cast<float>(2 * edge), .samples = options.back_samples, .threads = options.threads});
    out.colours = mesh.colours;
    if (options.open) out.from_border = edges_from_border(out.positions, out.triangles);
    return out;
}

TrackedTargets find_tracked_targets(const MovedReference& moved, const LatticeMesh& captured,
                                    const SurfaceIndex& surface, const TargetSearch& how,
                                    std::vector<std::uint32_t> near) {
    const auto& threads = how.threads;
    const bool detailed = moved.detail && !moved.detail->empty();
    const auto places = detailed ? places_on_detail(moved) : places_in_triangles(moved, rule_of(how.samples));
    const std::size_t vertices = moved.positions.size();
    near.resize(vertices, OrientedPoints::no_point);
    auto targets = targets_of(places, surface, how, near);
    TrackedTargets out;
    if (!surface.from_border.empty()) {
        leave_out_what_is_beyond(places.samples, surface, targets);
        out.seen.resize(vertices);
        const auto far = static_cast<float>(how.far.value);
        for (std::size_t v = 0; v < vertices; ++v)
            if (targets[v].found()) out.seen[v] = targets[v].squared_distance > far * far ? 2 : 1;
    }
    const auto fit = make_surface_fit(moved, places, targets);
    const auto fitted = fit.fitted(seen_at(places, moved, captured, targets, threads));
    out.near = std::move(near);
    out.displacement.resize(vertices);
    // A field cannot code more than this: 16 mm on the finest lattice. The surface then lags behind by the rest.
    constexpr float most = field_limit, most_colour = 255;
    for (std::size_t v = 0; v < vertices; ++v)
        out.displacement[v] = static_cast<std::int32_t>(std::lround(std::clamp(fitted[v][0], -most, most)));
    if (moved.colours.empty()) return out;
    out.colours.resize(3 * vertices);
    for (std::size_t v = 0; v < vertices; ++v)
        for (std::size_t c = 0; c < 3; ++c)
            out.colours[3 * v + c] =
                static_cast<std::int32_t>(std::lround(std::clamp(fitted[v][1 + c], -most_colour, most_colour)));
    return out;
}

namespace {

CubeErrors::Cube cube_of(const Point3f& point, LatticeUnits side) {
    CubeErrors::Cube out{};
    for (std::size_t axis = 0; axis < 3; ++axis)
        out[axis] = static_cast<std::int32_t>(std::floor(static_cast<double>(point[axis]) / side.value));
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

CubeErrors cube_errors(std::span<const Point3f> samples, std::span<const double> squared, LatticeUnits side,
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

// Every n-th vertex, and the centre of every n-th triangle; of each the corners, or the vertex three times.
struct SparseSamples {
    SurfaceSamples samples;
    std::vector<Triangle> corners;
    // What is known of these vertices; no_point where nothing is.
    std::vector<std::uint32_t> at_vertices(std::span<const std::uint32_t> known) const {
        std::vector<std::uint32_t> out(corners.size(), OrientedPoints::no_point);
        for (std::size_t i = 0; i < out.size() && !known.empty(); ++i) out[i] = known[corners[i][0]];
        return out;
    }
    // Without those of which a corner is refused.
    template <class Refused>
    void leave_out(const Refused& refused) {
        std::size_t kept = 0;
        for (std::size_t i = 0; i < corners.size(); ++i) {
            if (std::ranges::any_of(corners[i], refused)) continue;
            corners[kept] = corners[i];
            samples.points[kept] = samples.points[i];
            samples.normals[kept++] = samples.normals[i];
        }
        corners.resize(kept);
        samples.points.resize(kept);
        samples.normals.resize(kept);
    }
};

SparseSamples sparse_samples_of(const SurfaceIndex& surface) {
    constexpr std::size_t wanted = 2000;  // of each
    const auto& points = surface.positions;
    const auto& triangles = surface.triangles;
    SparseSamples out;
    for (std::uint32_t v = 0, every = static_cast<std::uint32_t>(1 + points.size() / wanted); v < points.size();
         v += every) {
        out.samples.points.push_back(points[v]);
        out.samples.normals.push_back(surface.normals[v]);
        out.corners.push_back({v, v, v});
    }
    for (std::size_t t = 0, every = 1 + triangles.size() / wanted; t < triangles.size(); t += every) {
        add_middle(out.samples, points, surface.normals, triangles[t]);
        out.corners.push_back(triangles[t]);
    }
    return out;
}

TrackedFit summed_up(const std::vector<Point3f>& points, const std::vector<double>& squared,
                     const TrackedFitOptions& options) {
    // One sample that found the wrong sheet does not mean that a region is lost.
    constexpr std::ptrdiff_t fewest = 10, left_out = 2;
    if (points.empty()) return {};
    const double stray = options.stray.value * options.stray.value;
    double squares = 0;
    std::size_t strays = 0;
    for (const double distance : squared) {
        squares += distance;
        if (distance >= stray) ++strays;  // what is not found is as far as `reach`, which may be no farther
    }
    const auto count = static_cast<double>(points.size());
    return {LatticeUnits(std::sqrt(squares / count)),
            static_cast<double>(strays) / count,
            LatticeUnits(cube_errors(points, squared, options.region, fewest, left_out).worst()),
            {},
            0,
            {}};
}

// The captured surface's normals tell the two sides of, say, a sleeve apart. near: of each sample a captured vertex
// that may be beside it.
std::vector<double> distances_of_decoded(const SurfaceSamples& decoded, std::vector<std::uint32_t> near,
                                         const SurfaceIndex& captured, const TrackedFitOptions& options) {
    const auto found = closest_facing(captured, decoded.points, decoded.normals,
                                      {.reach = static_cast<float>(options.reach.value), .agreement = 0, .along = true},
                                      options.threads, near);
    std::vector<double> squared(found.size(), options.reach.value * options.reach.value);
    for (std::size_t i = 0; i < found.size(); ++i)
        if (found[i].found()) squared[i] = static_cast<double>(found[i].squared_distance);
    return squared;
}

// The captured surface as it lies from the decoded one: the distances, and which samples nothing is tracked beside.
struct FromCaptured {
    std::vector<double> squared;
    std::vector<std::uint8_t> uncovered;  // none where the decoded mesh's borders are not known
};

// Searched among all of the decoded mesh: found along it, what is lost is noticed later, and a dancer takes 7 to 10 %
// more bits. near: of each sample a decoded vertex that may be beside it.
FromCaptured distances_of_captured(const SurfaceSamples& captured, std::span<const std::uint32_t> near,
                                   const SurfaceIndex& decoded, const TrackedFitOptions& options) {
    const auto reach = static_cast<float>(options.reach.value);
    FromCaptured out;
    out.squared.assign(captured.points.size(), options.reach.value * options.reach.value);
    const bool open = !decoded.from_border.empty();
    out.uncovered.assign(open ? captured.points.size() : 0, 0);
    const auto look = [&](std::size_t i, std::uint32_t& guess) {
        if (near[i] != OrientedPoints::no_point) guess = near[i];
        const auto found = decoded.closest_within(captured.points[i], reach, guess);
        if (found.found()) out.squared[i] = std::min(out.squared[i], static_cast<double>(found.squared_distance));
        if (open)
            out.uncovered[i] =
                !found.found() || is_beyond_border(found, decoded.triangles[found.triangle], decoded.from_border,
                                                   captured.points[i], captured.normals[i], decoded.fine_gap);
    };
    // Guesses may decide what is found, so they must not depend on how the threads cut the range.
    constexpr std::size_t in_a_row = 256;
    parallel_for(
        (out.squared.size() + in_a_row - 1) / in_a_row, options.threads, 2, [&](std::size_t begin, std::size_t end) {
            for (std::size_t row = begin; row < end; ++row) {
                std::uint32_t guess = OrientedPoints::no_point;
                for (std::size_t i = row * in_a_row; i < std::min(out.squared.size(), (row + 1) * in_a_row); ++i)
                    look(i, guess);
            }
        });
    return out;
}

// How much of the captured surface is uncovered, in all and in the fullest cube. area: of the captured surface.
void measure_uncovered(std::span<const Point3f> points, std::span<const std::uint8_t> uncovered, double area,
                       LatticeUnits side, TrackedFit& fit) {
    std::map<CubeErrors::Cube, std::size_t> in_cubes;
    std::size_t all = 0, most = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (uncovered[i] == 0) continue;
        ++all;
        most = std::max(most, ++in_cubes[cube_of(points[i], side)]);
    }
    if (all == 0) return;
    const auto count = static_cast<double>(points.size());
    fit.uncovered_share = static_cast<double>(all) / count;
    fit.widest_uncovered = LatticeUnits(std::sqrt(area * static_cast<double>(most) / count));
}

double area_of(const SurfaceIndex& surface) {
    double out = 0;
    for (const auto& t : surface.triangles)
        out += length(area_vector(std::span<const Point3f>(surface.positions), t)) / 2;
    return out;
}

template <class Value>
void keep_covered(std::vector<Value>& values, std::span<const std::uint8_t> uncovered) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < uncovered.size(); ++i)
        if (uncovered[i] == 0) values[kept++] = values[i];
    values.resize(kept);
}

}  // namespace

TrackedFit least_of(TrackedFit fit, const TrackedFit& before) {
    fit.stray_share = std::min(fit.stray_share, before.stray_share);
    fit.worst_region = std::min(fit.worst_region, before.worst_region);
    return fit;
}

TrackedFit measure_tracked_fit(const SurfaceIndex& captured, const LatticeMesh& decoded,
                               std::span<const std::uint32_t> near, std::span<const double> intra_squared,
                               const TrackedFitOptions& options) {
    const double edge = mean_edge(decoded.positions, decoded.triangles, 8);
    SurfaceIndex index(
        points_of(decoded.positions), decoded.triangles,
        {.cell = static_cast<float>(std::max(2 * edge, options.reach.value / 24)), .threads = options.threads});
    std::vector<std::uint32_t> beside(captured.positions.size(), OrientedPoints::no_point);
    for (std::uint32_t v = 0; v < near.size(); ++v)
        if (near[v] != OrientedPoints::no_point) beside[near[v]] = v;
    if (!captured.from_border.empty()) index.from_border = edges_from_border(index.positions, index.triangles);
    auto of_captured = sparse_samples_of(captured), of_decoded = sparse_samples_of(index);
    if (!captured.from_border.empty())
        of_captured.leave_out([&](std::uint32_t v) { return captured.from_border[v] == 0; });
    auto from_captured = distances_of_captured(of_captured.samples, of_captured.at_vertices(beside), index, options);
    TrackedFit out;
    if (!from_captured.uncovered.empty()) {
        measure_uncovered(of_captured.samples.points, from_captured.uncovered, area_of(captured), options.region, out);
        keep_covered(of_captured.samples.points, from_captured.uncovered);
        keep_covered(from_captured.squared, from_captured.uncovered);
    }
    const auto forth = summed_up(of_captured.samples.points, from_captured.squared, options);
    auto squared = distances_of_decoded(of_decoded.samples, of_decoded.at_vertices(near), captured, options);
    std::vector<double> more(squared.size(), 0);
    if (intra_squared.size() == squared.size())
        for (std::size_t i = 0; i < squared.size(); ++i) more[i] = std::max(0.0, squared[i] - intra_squared[i]);
    if (!options.seen.empty()) {
        std::vector<std::uint8_t> unseen;
        for (const auto& t : of_decoded.corners)
            unseen.push_back(options.seen[t[0]] == 0 || options.seen[t[1]] == 0 || options.seen[t[2]] == 0);
        keep_covered(of_decoded.samples.points, unseen);
        keep_covered(more, unseen);
    }
    const auto back = summed_up(of_decoded.samples.points, more, options);
    out.rms = std::max(forth.rms, back.rms);
    out.stray_share = std::max(forth.stray_share, back.stray_share);
    out.worst_region = std::max(forth.worst_region, back.worst_region);
    out.squared = std::move(squared);
    return out;
}

namespace {

LatticeMesh with_fewer_vertices(const LatticeMesh& captured, bool keep_tips,
                                const SimplifiedReferenceOptions& options) {
    SimplificationOptions simplification;
    simplification.surface_error = options.surface_error.value;
    simplification.colour_error = options.colour_error;
    simplification.longest_edge = options.longest_edge.value;
    simplification.keep_tips = keep_tips;
    simplification.threads = options.threads;
    return simplified_mesh(captured, simplification);
}

// Takes away parts that are smaller than a square of this side.
void leave_out_specks(LatticeMesh& mesh, LatticeUnits side) {
    DisjointSets parts(mesh.positions.size());
    std::vector<double> area(mesh.positions.size(), 0);
    for (const auto& t : mesh.triangles) parts.join(t[0], t[1]), parts.join(t[1], t[2]);
    for (const auto& t : mesh.triangles)
        area[parts.of(t[0])] += length(area_vector(std::span<const LatticePoint>(mesh.positions), t)) / 2;
    const double least = side.value * side.value;
    if (std::ranges::all_of(mesh.triangles, [&](const Triangle& t) { return area[parts.of(t[0])] < least; })) return;
    std::erase_if(mesh.triangles, [&](const Triangle& t) { return area[parts.of(t[0])] < least; });
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
    auto whole = welded(captured, at_same_place(captured));
    if (options.specks.value > 0) leave_out_specks(whole, options.specks);
    if (options.filled_holes.value > 0) {
        whole.normals.clear();
        fill_small_holes(whole, {.longest = options.filled_holes});
    }
    auto out = with_fewer_vertices(whole, true, options);
    fit_to_surface(out, captured, surface, options);
    if (!captured.normals.empty()) out.normals = quantised_normals(vertex_normals(out.positions, out.triangles));
    return out;
}

}  // namespace htvm::internal
