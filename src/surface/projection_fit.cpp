#include "surface/projection_fit.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace htvm::internal {
namespace {

constexpr std::size_t fewest_pairs = 24;  // with less than about that many, many things look like a projection
constexpr std::size_t most_fitted = 4000;
constexpr int rounds = 10;

struct Pair {
    Eigen::Vector3d position;
    Eigen::Vector2d place;  // pixels
};

// Those that tell where the camera saw a point.
std::vector<Pair> telling_pairs(const FilmPairs& pairs) {
    constexpr double border = 0.51;  // pixels: half of one, and what coordinates are rounded to
    std::vector<Pair> out;
    const std::size_t count = std::min(pairs.positions.size(), pairs.texcoords.size());
    out.reserve(count);
    for (std::size_t v = 0; v < count; ++v) {
        const Eigen::Vector2d place(static_cast<double>(pairs.texcoords[v][0]) * pairs.width,
                                    static_cast<double>(pairs.texcoords[v][1]) * pairs.height);
        const auto inside = [](double x, double side) { return x > border && x < side - border; };
        if (!inside(place[0], pairs.width) || !inside(place[1], pairs.height) || !pairs.positions[v].allFinite())
            continue;
        out.push_back({pairs.positions[v], place});
    }
    return out;
}

std::vector<Pair> evenly_chosen(const std::vector<Pair>& pairs, std::size_t most) {
    if (pairs.size() <= most) return pairs;
    std::vector<Pair> out;
    for (std::size_t i = 0; i < most; ++i) out.push_back(pairs[i * pairs.size() / most]);
    return out;
}

Eigen::Vector4d homogeneous(const Eigen::Vector3d& p) { return {p[0], p[1], p[2], 1}; }

// Pixels; infinity behind the camera.
double error_of(const ProjectionMatrix& m, const Pair& pair) {
    const Eigen::Vector3d at = m * homogeneous(pair.position);
    if (!(at[2] > 0)) return std::numeric_limits<double>::infinity();
    return (at.head<2>() / at[2] - pair.place).norm();
}

std::vector<double> errors_of(const ProjectionMatrix& m, const std::vector<Pair>& pairs) {
    std::vector<double> out;
    out.reserve(pairs.size());
    for (const auto& pair : pairs) out.push_back(error_of(m, pair));
    return out;
}

double median_of(std::vector<double> values) {
    if (values.empty()) return std::numeric_limits<double>::infinity();
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

// Solves for these pairs, about the origin and of about unit size, the homogeneous equations in least squares, each
// divided by what the depth was before, so that what is made small is about the error on the film.
ProjectionMatrix solved(const std::vector<Pair>& pairs, const std::vector<bool>& is_used,
                        const ProjectionMatrix& before) {
    Eigen::Matrix<double, 12, 12> normal = Eigen::Matrix<double, 12, 12>::Zero();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        if (!is_used[i]) continue;
        const auto p = homogeneous(pairs[i].position);
        const double depth = before.row(2).dot(p);
        const double weight = std::abs(depth) > 1e-3 ? 1 / depth : 0;
        for (int axis = 0; axis < 2; ++axis) {
            Eigen::Matrix<double, 12, 1> row = Eigen::Matrix<double, 12, 1>::Zero();
            row.segment<4>(4 * axis) = weight * p;
            row.segment<4>(8) = -weight * pairs[i].place[axis] * p;
            normal.selfadjointView<Eigen::Lower>().rankUpdate(row);
        }
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 12, 12>> solver(normal);
    const Eigen::Matrix<double, 12, 1> least = solver.eigenvectors().col(0);
    ProjectionMatrix out;
    for (int row = 0; row < 3; ++row) out.row(row) = least.segment<4>(4 * row).transpose();
    double front = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i)
        if (is_used[i]) front += out.row(2).dot(homogeneous(pairs[i].position)) > 0 ? 1 : -1;
    if (front < 0) out = -out;
    // The depth in the middle of the pairs, which is the origin, is 1.
    return out(2, 3) != 0 ? ProjectionMatrix(out / std::abs(out(2, 3))) : out;
}

// What brings points about the origin and to unit size.
struct Normalisation {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    double size = 1;
};

Normalisation normalisation_of(const std::vector<Pair>& pairs) {
    Normalisation out;
    for (const auto& pair : pairs) out.middle += pair.position / static_cast<double>(pairs.size());
    double squared = 0;
    for (const auto& pair : pairs)
        squared += (pair.position - out.middle).squaredNorm() / static_cast<double>(pairs.size());
    if (squared > 0) out.size = std::sqrt(squared);
    return out;
}

ProjectionMatrix from_afar() {
    ProjectionMatrix out = ProjectionMatrix::Zero();
    out(2, 3) = 1;
    return out;
}

std::vector<bool> within(const std::vector<double>& errors, double most) {
    std::vector<bool> out(errors.size());
    for (std::size_t i = 0; i < errors.size(); ++i) out[i] = errors[i] <= most;
    return out;
}

// At least what single precision rounds to stays in use.
double most_in_use(const std::vector<double>& errors) { return std::max(3 * median_of(errors), 1e-7); }

// Begun with the pairs in use, which change from round to round.
ProjectionMatrix refined(const std::vector<Pair>& unit, std::vector<bool> is_used) {
    auto m = from_afar();
    for (int round = 0; round < rounds; ++round) {
        m = solved(unit, is_used, m);
        const auto errors = errors_of(m, unit);
        auto next = within(errors, most_in_use(errors));
        if (next == is_used && round > 1) break;
        is_used = std::move(next);
    }
    return m;
}

// The pairs that lie about where the best of several projections through a few of them puts them: where some are so far
// off that all together lead nowhere.
std::vector<bool> agreeing(const std::vector<Pair>& unit) {
    constexpr int tries = 60, few = 10;
    double best = std::numeric_limits<double>::infinity();
    std::vector<bool> out(unit.size(), true);
    std::uint64_t random = 1;
    for (int k = 0; k < tries; ++k) {
        std::vector<bool> chosen(unit.size(), false);
        for (int i = 0; i < few; ++i) {
            random = random * 6364136223846793005u + 1442695040888963407u;
            chosen[static_cast<std::size_t>((random >> 33) % unit.size())] = true;
        }
        auto m = solved(unit, chosen, from_afar());
        m = solved(unit, chosen, m);
        const auto errors = errors_of(m, unit);
        const double median = median_of(errors);
        if (!(median < best)) continue;
        best = median;
        out = within(errors, most_in_use(errors));
    }
    return out;
}

// In pixels, of pairs as they are. all: begun with all of them, else with those that agree.
ProjectionMatrix fitted(const std::vector<Pair>& pairs, const FilmPairs& film, bool all) {
    const auto of_positions = normalisation_of(pairs);
    const double scale = std::max(film.width, film.height) / 2;
    std::vector<Pair> unit;
    for (const auto& pair : pairs)
        unit.push_back({(pair.position - of_positions.middle) / of_positions.size,
                        (pair.place - Eigen::Vector2d(film.width, film.height) / 2) / scale});
    const auto m = refined(unit, all ? std::vector<bool>(unit.size(), true) : agreeing(unit));
    Eigen::Matrix4d to_unit = Eigen::Matrix4d::Identity();
    to_unit.topLeftCorner<3, 3>() /= of_positions.size;
    to_unit.topRightCorner<3, 1>() = -of_positions.middle / of_positions.size;
    Eigen::Matrix3d to_pixels = Eigen::Matrix3d::Identity();
    to_pixels(0, 0) = to_pixels(1, 1) = scale;
    to_pixels(0, 2) = film.width / 2;
    to_pixels(1, 2) = film.height / 2;
    return to_pixels * m * to_unit;
}

ProjectionMatrix to_pixels(ProjectionMatrix m, const FilmPairs& film) {
    m.row(0) *= film.width;
    m.row(1) *= film.height;
    return m;
}

ProjectionMatrix of_pixels(ProjectionMatrix m, const FilmPairs& film) {
    m.row(0) /= film.width;
    m.row(1) /= film.height;
    return m;
}

ProjectionErrors errors_between(const ProjectionMatrix& in_pixels, const std::vector<Pair>& pairs) {
    if (pairs.empty()) return {};
    const auto errors = errors_of(in_pixels, pairs);
    const auto within = std::count_if(errors.begin(), errors.end(), [](double error) { return error <= 1; });
    return {median_of(errors), static_cast<double>(within) / static_cast<double>(errors.size())};
}

}  // namespace

ProjectionErrors projection_errors(const ProjectionMatrix& projection, const FilmPairs& pairs) {
    return errors_between(to_pixels(projection, pairs), telling_pairs(pairs));
}

std::optional<ProjectionMatrix> fit_projection(const FilmPairs& pairs) {
    const auto telling = telling_pairs(pairs);
    if (telling.size() < fewest_pairs) return std::nullopt;
    const auto chosen = evenly_chosen(telling, most_fitted);
    for (const bool all : {true, false}) {
        const auto found = fitted(chosen, pairs, all);
        if (found.allFinite() && is_projection(errors_between(found, telling))) return of_pixels(found, pairs);
    }
    return std::nullopt;
}

std::optional<ProjectionMatrix> follow_projection(const ProjectionMatrix& before, const FilmPairs& pairs) {
    constexpr double good = 0.1, nearly_as_good = 1.5;  // pixels; times the error of a new one
    const auto of_before = projection_errors(before, pairs);
    if (is_projection(of_before) && of_before.median <= good) return before;
    auto out = fit_projection(pairs);
    if (out && is_projection(of_before) && of_before.median <= nearly_as_good * projection_errors(*out, pairs).median)
        return before;
    return out;
}

}  // namespace htvm::internal
