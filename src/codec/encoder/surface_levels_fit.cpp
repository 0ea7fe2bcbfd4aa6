#include "codec/encoder/surface_levels_fit.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace htvm::internal {
namespace {

// A rule's shares in expected_vertex(), which is linear in the vertices as long as the normals stay.
struct RuleShares {
    double tangents, butterfly;
};
RuleShares shares_of(const SubdivisionRule& rule) {
    return {static_cast<double>(rule.tangents) / 64, static_cast<double>(rule.butterfly) / 128};
}

}  // namespace

SurfaceIndex evenly_sampled(const LatticeMesh& captured, Threads threads) {
    constexpr std::size_t most_vertices = std::size_t{1} << 22;
    const double edge = std::max(1.0, mean_edge(captured.positions, captured.triangles, 8));
    const SubdivisionDepth depth{.levels = 5, .longest_edge = static_cast<std::uint32_t>(2 * edge)};
    auto points = points_of(captured.positions);
    const auto levels = subdivide(captured, depth, most_vertices);
    const bool even = levels && !levels->empty();
    if (even)
        for (const auto& level : *levels)
            for (const auto& s : level.stencils)
                points.push_back(to_floats((to_vector(points[s.a]) + to_vector(points[s.b])) * 0.5));
    return {points,
            even ? levels->back().triangles : captured.triangles,
            {.cell = static_cast<float>(2 * edge), .threads = threads}};
}

SurfaceFit::SurfaceFit(const SurfaceIndex& captured, const LatticeMesh& base,
                       std::span<const SubdivisionLevel> subdivision, const SurfaceLevels& levels,
                       std::size_t displaced, const SurfaceFitOptions& options)
    : captured_(captured),
      base_(base),
      subdivision_(subdivision),
      levels_(levels),
      displaced_(displaced),
      options_(options) {
    // Vertices and the middles of triangles, each for a part of the area beside it.
    const auto vertices = captured.positions.size();
    points_ = captured.positions;
    facing_ = captured.normals;
    areas_.assign(vertices, 0);
    for (const auto& t : captured.triangles) {
        const Vector3d across = area_vector(std::span<const Point3f>(captured.positions), t);
        const auto area = static_cast<float>(length(across) / 2);
        Vector3d middle{};
        for (const auto v : t) {
            areas_[v] += area * 0.4F / 3;
            middle = middle + to_vector(captured.positions[v]) * (1.0 / 3);
        }
        points_.push_back(to_floats(middle));
        facing_.push_back(to_floats(normalised(across)));
        areas_.push_back(area * 0.6F);
    }
    guesses_.assign(points_.size(), OrientedPoints::no_point);
    displacements_.assign(end_of(subdivision.size()), 0);
    change_.assign(displacements_.size(), 0);
}

std::size_t SurfaceFit::begin_of(std::size_t level) const { return level == 0 ? 0 : subdivision_[level - 1].first; }
std::size_t SurfaceFit::end_of(std::size_t level) const {
    return level == 0 ? base_.positions.size()
                      : subdivision_[level - 1].first + subdivision_[level - 1].stencils.size();
}

// Where all vertices are with the displacements as they are.
void SurfaceFit::rebuild() {
    positions_.clear();
    normals_.clear();
    above_.clear();
    farthest_.assign(displacements_.size(), 0);
    const std::vector<Triangle>* triangles = &base_.triangles;
    for (std::size_t k = 0; k <= subdivision_.size(); ++k) {
        const auto expected = k == 0 ? ExpectedLevel(base_)
                                     : ExpectedLevel(subdivision_[k - 1], positions_, *triangles, levels_.rules[k - 1]);
        for (std::size_t i = 0; i < expected.size(); ++i) {
            normals_.push_back(expected.normal(i));
            const Vector3d at = expected.vertex(i).at + normals_.back() * displacements_[positions_.size()];
            positions_.push_back({within_lattice(std::llround(at[0])), within_lattice(std::llround(at[1])),
                                  within_lattice(std::llround(at[2]))});
        }
        // Beyond its surroundings' own size a surface folds.
        if (k == 0) {
            const auto around = vertices_around(positions_.size(), base_.triangles);
            for (std::size_t v = 0; v < positions_.size(); ++v) {
                double sum = 0;
                for (const auto other : around.of(v))
                    sum += length(to_vector(positions_[other]) - to_vector(positions_[v]));
                if (!around.of(v).empty())
                    farthest_[v] = options_.farthest * sum / static_cast<double>(around.of(v).size());
            }
        } else {
            for (std::size_t i = 0; i < expected.size(); ++i) {
                const auto& stencil = subdivision_[k - 1].stencils[i];
                farthest_[subdivision_[k - 1].first + i] =
                    options_.farthest * length(to_vector(positions_[stencil.b]) - to_vector(positions_[stencil.a]));
            }
        }
        above_.push_back(expected.normals_above());
        if (k > 0) triangles = &subdivision_[k - 1].triangles;
    }
}

// What lies nearest to each sample of the captured surface.
void SurfaceFit::find_samples() {
    const auto& triangles = subdivision_.empty() ? base_.triangles : subdivision_.back().triangles;
    const double edge = mean_edge(positions_, triangles, 8);
    const SurfaceIndex shown(
        points_of(positions_), triangles,
        {.cell = static_cast<float>(std::max(2 * edge, options_.reach.value / 24)), .threads = options_.threads});
    const auto found = closest_facing(shown, points_, facing_, {.reach = reach_, .agreement = options_.agreement},
                                      options_.threads, guesses_);
    samples_.clear();
    for (std::size_t i = 0; i < points_.size(); ++i) {
        if (!found[i].found()) continue;
        const auto& t = triangles[found[i].triangle];
        const Vector3d normal = normalised(area_vector(std::span<const LatticePoint>(positions_), t));
        const double residual = dot(to_vector(points_[i]) - to_vector(found[i].point), normal);
        samples_.push_back({t, found[i].shares, to_floats(normal), static_cast<float>(residual), areas_[i]});
    }
    find_samples_back(triangles);
    weigh();
}

// What of the captured surface lies nearest to each vertex: where these are closer than the captured ones, they would
// not be held otherwise.
void SurfaceFit::find_samples_back(std::span<const Triangle> triangles) {
    std::vector<double> area(positions_.size(), 0);
    for (const auto& t : triangles) {
        const double part = length(area_vector(std::span<const LatticePoint>(positions_), t)) / 6;
        for (const auto v : t) area[v] += part;
    }
    const auto normals = vertex_normals(positions_, triangles);
    samples_back_.clear();
    guesses_back_.resize(positions_.size(), OrientedPoints::no_point);
    const auto found =
        closest_facing(captured_, points_of(positions_), points_of(normals),
                       {.reach = reach_, .agreement = options_.agreement}, options_.threads, guesses_back_);
    for (std::uint32_t v = 0; v < positions_.size(); ++v) {
        if (!found[v].found()) continue;
        const double residual = dot(to_vector(found[v].point) - to_vector(positions_[v]), normals[v]);
        samples_back_.push_back({v, normals[v], residual, options_.back * area[v]});
    }
}

// How much of the surface each displacement moves.
void SurfaceFit::weigh() {
    mass_.assign(displacements_.size(), 0);
    for (const auto& s : samples_)
        for (std::size_t i = 0; i < 3; ++i) mass_[s.corners[i]] += s.weight * s.shares[i];
    for (const auto& s : samples_back_) mass_[s.vertex] += s.weight;
    for (std::size_t k = subdivision_.size(); k > 0; --k)
        for (std::size_t i = subdivision_[k - 1].stencils.size(); i-- > 0;) {
            const auto& stencil = subdivision_[k - 1].stencils[i];
            const double half = mass_[subdivision_[k - 1].first + i] / 2;
            mass_[stencil.a] += half;
            mass_[stencil.b] += half;
        }
    double sum = 0, count = 0;
    for (std::size_t v = begin_of(subdivision_.size()); v < mass_.size(); ++v)
        if (mass_[v] > 0) sum += mass_[v], ++count;
    finest_mass_ = count > 0 ? sum / count : 1;
    constexpr double overlap = 0.6;  // of the squared share in place of the share
    for (auto& m : mass_) m *= overlap;
    finest_mass_ *= overlap;
    weights_.resize(mass_.size());
    for (std::size_t v = 0; v < mass_.size(); ++v) weights_[v] = mass_[v] / finest_mass_;
}

// How far each vertex moves if displacements change by these.
std::vector<Vector3d> SurfaceFit::moved_by(std::span<const double> change) const {
    std::vector<Vector3d> out(change.size());
    for (std::size_t v = 0; v < base_.positions.size(); ++v) out[v] = normals_[v] * change[v];
    for (std::size_t k = 1; k <= subdivision_.size(); ++k) {
        const auto& level = subdivision_[k - 1];
        const auto& above = above_[k];
        const auto [tangents, butterfly] = shares_of(levels_.rules[k - 1]);
        for (std::size_t i = 0; i < level.stencils.size(); ++i) {
            const auto& s = level.stencils[i];
            const std::size_t v = level.first + i;
            const Vector3d edge = out[s.b] - out[s.a];
            Vector3d moved = (out[s.a] + out[s.b]) * 0.5 + normals_[v] * change[v];
            moved = moved + (above[s.b] * dot(edge, above[s.b]) - above[s.a] * dot(edge, above[s.a])) * tangents;
            if (butterfly > 0 && s.across[0] != no_element)
                for (std::size_t side = 0; side < 2; ++side) {
                    const Vector3d& c = out[s.across[side]];
                    Vector3d sum = c * 2;
                    for (std::size_t end = 0; end < 2; ++end) {
                        const auto wing = s.wings[side][end];
                        const Vector3d &near = out[end == 0 ? s.a : s.b], &far = out[end == 0 ? s.b : s.a];
                        sum = sum - (wing != no_element ? out[wing] : near + c - far);
                    }
                    moved = moved + sum * butterfly;
                }
            out[v] = moved;
        }
    }
    return out;
}

// How much half the squared distance shrinks with each displacement, where vertices have moved so far; residuals: false
// for what the move alone makes of it.
std::vector<double> SurfaceFit::gradient(std::span<const Vector3d> moved, bool residuals) const {
    // Parts of the samples are added up each for itself, always the same ones, so that sums do not depend on threads.
    constexpr std::size_t parts = 4;
    std::array<std::vector<Vector3d>, parts> pulls;
    parallel_for(parts, options_.threads, 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t part = begin; part < end; ++part) {
            auto& own = pulls[part];
            own.assign(moved.size(), Vector3d{});
            for (std::size_t k = samples_.size() * part / parts; k < samples_.size() * (part + 1) / parts; ++k) {
                const auto& s = samples_[k];
                const Vector3d normal = to_vector(s.normal);
                Vector3d there{};
                for (std::size_t i = 0; i < 3; ++i)
                    there = there + moved[s.corners[i]] * static_cast<double>(s.shares[i]);
                const double residual = (residuals ? static_cast<double>(s.residual) : 0) - dot(there, normal);
                const Vector3d force = normal * (residual * static_cast<double>(s.weight));
                for (std::size_t i = 0; i < 3; ++i)
                    own[s.corners[i]] = own[s.corners[i]] + force * static_cast<double>(s.shares[i]);
            }
        }
    });
    auto& pull = pulls[0];
    for (std::size_t v = 0; v < pull.size(); ++v) pull[v] = (pull[v] + pulls[1][v]) + (pulls[2][v] + pulls[3][v]);
    for (const auto& s : samples_back_) {
        const double residual = (residuals ? s.residual : 0) - dot(moved[s.vertex], s.normal);
        pull[s.vertex] = pull[s.vertex] + s.normal * (residual * s.weight);
    }
    std::vector<double> out(moved.size());
    for (std::size_t k = subdivision_.size(); k > 0; --k) {
        const auto& level = subdivision_[k - 1];
        const auto& above = above_[k];
        const auto [tangents, butterfly] = shares_of(levels_.rules[k - 1]);
        for (std::size_t i = 0; i < level.stencils.size(); ++i) {
            const auto& s = level.stencils[i];
            const std::size_t v = level.first + i;
            const Vector3d& own = pull[v];
            out[v] = dot(own, normals_[v]);
            const Vector3d apart = (above[s.b] * dot(own, above[s.b]) - above[s.a] * dot(own, above[s.a])) * tangents;
            pull[s.a] = pull[s.a] + own * 0.5 - apart;
            pull[s.b] = pull[s.b] + own * 0.5 + apart;
            if (!(butterfly > 0) || s.across[0] == no_element) continue;
            const Vector3d part = own * butterfly;
            for (std::size_t side = 0; side < 2; ++side) {
                auto& c = pull[s.across[side]];
                c = c + part * 2;
                for (std::size_t end = 0; end < 2; ++end) {
                    const auto wing = s.wings[side][end];
                    if (wing != no_element) {
                        pull[wing] = pull[wing] - part;
                        continue;
                    }
                    auto &near = pull[end == 0 ? s.a : s.b], &far = pull[end == 0 ? s.b : s.a];
                    near = near - part;
                    c = c - part;
                    far = far + part;
                }
            }
        }
    }
    for (std::size_t v = 0; v < base_.positions.size(); ++v) out[v] = dot(pull[v], normals_[v]);
    return out;
}

// What a displacement must at least be to be worth its bits.
double SurfaceFit::least(std::size_t v) const {
    if (v < base_.positions.size()) return 0;
    const double step = static_cast<double>(levels_.step) / (1 << displacement_bits);
    return options_.least_moved * step * std::sqrt(finest_mass_ / mass_[v]);
}

// Finds the changes of those that are free that fit best, by conjugate gradients. rest: the gradient where they are.
void SurfaceFit::solve(std::span<const std::uint8_t> is_free, std::vector<double> rest) {
    const auto restricted = [&](std::vector<double> x) {
        for (std::size_t v = 0; v < x.size(); ++v)
            if (is_free[v] == 0) x[v] = 0;
        return x;
    };
    const auto preconditioned = [&](std::span<const double> x) {
        std::vector<double> out(x.size(), 0);
        for (std::size_t v = 0; v < x.size(); ++v)
            if (is_free[v] != 0) out[v] = x[v] / (mass_[v] + options_.held * finest_mass_);
        return out;
    };
    const auto product = [](std::span<const double> x, std::span<const double> y) {
        double sum = 0;
        for (std::size_t v = 0; v < x.size(); ++v) sum += x[v] * y[v];
        return sum;
    };
    const double held = options_.held * finest_mass_;
    for (std::size_t v = 0; v < rest.size(); ++v) rest[v] -= held * (displacements_[v] + change_[v]);
    rest = restricted(std::move(rest));
    auto along = preconditioned(rest);
    double before = product(rest, along);
    for (int i = 0; i < options_.iterations && before > 0; ++i) {
        auto bent = gradient(moved_by(along), false);
        for (std::size_t v = 0; v < bent.size(); ++v) bent[v] -= held * along[v];
        bent = restricted(std::move(bent));
        const double curvature = -product(along, bent);
        if (!(curvature > 0)) break;
        const double far = before / curvature;
        for (std::size_t v = 0; v < change_.size(); ++v) {
            change_[v] += far * along[v];
            rest[v] += far * bent[v];
        }
        const auto next = preconditioned(rest);
        const double now = product(rest, next);
        for (std::size_t v = 0; v < along.size(); ++v) along[v] = next[v] + now / before * along[v];
        before = now;
    }
}

// Fits the displacements from a vertex on, with as few as are worth it: those that are not zero, and those that would
// be large enough by themselves, are fitted together, and then the small ones of them taken out.
void SurfaceFit::choose_and_solve(std::size_t first) {
    std::vector<std::uint8_t> is_free(displacements_.size(), 0);
    auto wanted = gradient(moved_by(change_), true);
    for (std::size_t v = first; v < end_of(displaced_); ++v) {
        if (!(mass_[v] > 0)) continue;
        const double now = displacements_[v] + change_[v];
        is_free[v] = now != 0 || v < base_.positions.size() || std::abs(now + wanted[v] / mass_[v]) >= least(v);
    }
    solve(is_free, std::move(wanted));
    for (std::size_t v = first; v < is_free.size(); ++v) {
        if (is_free[v] == 0) continue;
        double now = displacements_[v] + change_[v];
        if (std::abs(now) < least(v)) now = 0;
        now = std::clamp(now, -farthest_[v], farthest_[v]);
        change_[v] = now - displacements_[v];
    }
}

void SurfaceFit::improve(std::size_t first, int rounds) {
    for (int round = 0; round < rounds; ++round) {
        rebuild();
        reach_ = static_cast<float>(
            std::max(options_.reach.value / (1 << std::min(rounds_++, 8)), options_.last_reach.value));
        find_samples();
        std::fill(change_.begin(), change_.end(), 0);
        for (int i = 0; i < options_.choices; ++i) choose_and_solve(begin_of(first));
        for (std::size_t v = 0; v < displacements_.size(); ++v) displacements_[v] += change_[v];
    }
}

}  // namespace htvm::internal
