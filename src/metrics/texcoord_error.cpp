#include "metrics/texcoord_error.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/parallel.h"
#include "metrics/mesh_measures.h"
#include "metrics/triangle_index.h"

namespace htvm {

using namespace internal;
namespace {

std::array<Point3, 3> corners_of(const Mesh& mesh, std::size_t triangle) {
    const auto& t = mesh.triangles[triangle];
    return {to_point(mesh.positions[t[0]]), to_point(mesh.positions[t[1]]), to_point(mesh.positions[t[2]])};
}

std::array<double, 2> texcoord_at(const Mesh& mesh, std::size_t triangle, const Vector3d& shares) {
    const auto& t = mesh.triangles[triangle];
    const std::array<double, 3> weights = {shares[0], shares[1], shares[2]};
    std::array<double, 2> out{};
    for (std::size_t corner = 0; corner < 3; ++corner)
        for (std::size_t axis = 0; axis < 2; ++axis) out[axis] += weights[corner] * mesh.texcoords[t[corner]][axis];
    return out;
}

}  // namespace

TexcoordError& operator+=(TexcoordError& sums, const TexcoordError& frame) {
    sums.area += frame.area;
    sums.in_place += frame.in_place;
    sums.squared += frame.squared;
    return sums;
}

Result<TexcoordError> texcoord_error(const Mesh& original, const Mesh& decoded, Threads threads) {
    TexcoordError out;
    if (original.texcoords.empty() || decoded.texcoords.empty()) return out;
    if (original.triangles.empty() || decoded.triangles.empty()) return out;
    const auto index = TriangleIndex::build(decoded, threads);
    if (!index) return tl::unexpected(index.error());
    std::vector<double> errors(original.triangles.size());
    constexpr std::size_t block = 512;
    parallel_for(errors.size(), threads, block, [&](std::size_t begin, std::size_t end) {
        std::uint32_t hint = 0;
        for (std::size_t t = begin; t < end; ++t) {
            const auto [a, b, c] = corners_of(original, t);
            const Vector3d middle = {1.0 / 3, 1.0 / 3, 1.0 / 3};
            const Point3 sample = point_at(middle, a, b, c);
            hint = index->closest(sample, hint).triangle;
            const auto [p, q, r] = corners_of(decoded, hint);
            const auto there = texcoord_at(decoded, hint, closest_on_triangle(sample, p, q, r).shares);
            const auto here = texcoord_at(original, t, middle);
            errors[t] = std::hypot(there[0] - here[0], there[1] - here[1]);
        }
    });
    for (std::size_t t = 0; t < errors.size(); ++t) {
        const auto [a, b, c] = corners_of(original, t);
        const double area = length(cross(b - a, c - a)) / 2;
        const bool elsewhere = errors[t] > elsewhere_beyond;
        out += {area, elsewhere ? 0 : area, elsewhere ? 0 : area * errors[t] * errors[t]};
    }
    return out;
}

double rms_texcoord(const TexcoordError& error) {
    return error.in_place > 0 ? std::sqrt(error.squared / error.in_place) : 0;
}

double share_elsewhere(const TexcoordError& error) { return error.area > 0 ? 1 - error.in_place / error.area : 0; }

}  // namespace htvm
