#include "geometry/target_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace htvm {
namespace {

using Vector = Eigen::Vector3f;

Vector vector_of(const Point3f& p) { return {p[0], p[1], p[2]}; }
Point3f point_of(const Vector& v) { return {v.x(), v.y(), v.z()}; }

struct Around {
    std::vector<std::uint32_t> first, triangles;
};

Around triangles_around(std::size_t vertices, std::span<const Triangle> triangles) {
    Around out;
    out.first.assign(vertices + 1, 0);
    for (const auto& t : triangles)
        for (const std::uint32_t v : t) ++out.first[v + std::size_t{1}];
    for (std::size_t v = 0; v < vertices; ++v) out.first[v + 1] += out.first[v];
    out.triangles.resize(out.first.back());
    std::vector<std::uint32_t> next(out.first.begin(), out.first.end() - 1);
    for (std::uint32_t i = 0; i < triangles.size(); ++i)
        for (const std::uint32_t v : triangles[i]) out.triangles[next[v]++] = i;
    return out;
}

// Closest point of a segment.
Vector closest_on_side(const Vector& p, const Vector& a, const Vector& b) {
    const Vector side = b - a;
    const float length = side.squaredNorm();
    return length > 0 ? Vector(a + std::clamp((p - a).dot(side) / length, 0.0f, 1.0f) * side) : a;
}

// The foot of the perpendicular where it falls inside the triangle, else the closest point of the sides.
Vector closest_on_triangle(const Vector& p, const Vector& a, const Vector& b, const Vector& c, const Vector& across) {
    const float area = across.squaredNorm();
    const bool inside = area > 0 && across.dot((b - a).cross(p - a)) >= 0 && across.dot((c - b).cross(p - b)) >= 0 &&
                        across.dot((a - c).cross(p - c)) >= 0;
    if (inside) return p - across * (across.dot(p - a) / area);
    const Vector on[3] = {closest_on_side(p, a, b), closest_on_side(p, b, c), closest_on_side(p, c, a)};
    return *std::min_element(
        on, on + 3, [&](const Vector& x, const Vector& y) { return (x - p).squaredNorm() < (y - p).squaredNorm(); });
}

SurfaceTarget target_of(const Point3f& moved, const Point3f& normal, const TargetSurface& target,
                        const SurfaceTargetOptions& options) {
    SurfaceTarget out;
    const auto match = target.fine.nearest(moved, normal, options.reach, options.agreement);
    if (!match.found) return out;
    const Vector p = vector_of(moved), n = vector_of(normal);
    float best = std::numeric_limits<float>::max();
    for (std::uint32_t i = target.first_around[match.index]; i < target.first_around[match.index + 1]; ++i) {
        const auto& t = target.triangles[target.around[i]];
        const Vector a = vector_of(target.positions[t[0]]), b = vector_of(target.positions[t[1]]),
                     c = vector_of(target.positions[t[2]]);
        const Vector across = (b - a).cross(c - a);
        const float area = across.norm();
        if (!(area > 0) || across.dot(n) < options.agreement * area) continue;
        const Vector q = closest_on_triangle(p, a, b, c, across);
        const float d = (q - p).squaredNorm();
        if (d >= best) continue;
        best = d;
        out = {point_of(q), point_of(across / area), target.around[i], true};
    }
    return out;
}

}  // namespace

std::vector<Point3f> vertex_normals(std::span<const Point3f> positions, std::span<const Triangle> triangles,
                                    unsigned threads) {
    std::vector<Vector> sum(positions.size(), Vector::Zero());
    for (const auto& t : triangles) {
        const Vector a = vector_of(positions[t[0]]);
        const Vector across = (vector_of(positions[t[1]]) - a).cross(vector_of(positions[t[2]]) - a);
        for (const std::uint32_t v : t) sum[v] += across;
    }
    std::vector<Point3f> out(positions.size());
    parallel_for(positions.size(), threads, 8192, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
            const float length = sum[v].norm();
            if (length > 0 && std::isfinite(length)) out[v] = point_of(Vector(sum[v] / length));
        }
    });
    return out;
}

float point_gap(std::span<const Point3f> positions, std::span<const Triangle> triangles, std::size_t count) {
    double area = 0;
    for (const auto& t : triangles) {
        const Vector a = vector_of(positions[t[0]]);
        area += 0.5 * (vector_of(positions[t[1]]) - a).cross(vector_of(positions[t[2]]) - a).norm();
    }
    const double gap = count > 0 ? std::sqrt(area / static_cast<double>(count)) : 0;
    return std::isfinite(gap) ? static_cast<float>(gap) : 0.0f;
}

TargetSurface make_target_surface(std::span<const Point3f> positions, std::span<const Triangle> triangles, float cell,
                                  std::size_t samples, unsigned threads) {
    std::vector<Point3f> normals;
    Around around;
    parallel_invoke(
        threads, [&] { around = triangles_around(positions.size(), triangles); },
        [&] { normals = vertex_normals(positions, triangles); });
    const std::size_t count = std::min(samples, positions.size());
    std::vector<std::uint32_t> chosen(count);
    std::vector<Point3f> chosen_points(count), chosen_normals(count);
    for (std::size_t i = 0; i < count; ++i) {
        chosen[i] = static_cast<std::uint32_t>(i * positions.size() / count);
        chosen_points[i] = positions[chosen[i]];
        chosen_normals[i] = normals[chosen[i]];
    }
    // Samples are further apart than vertices by the root of how many fewer they are.
    const float wider = count == 0 ? 1.0f : std::sqrt(static_cast<float>(positions.size()) / static_cast<float>(count));
    OrientedPoints fine(positions, normals, cell);
    OrientedPoints coarse(chosen_points, chosen_normals, cell * wider);
    return {{positions.begin(), positions.end()},
            std::move(normals),
            {triangles.begin(), triangles.end()},
            std::move(around.first),
            std::move(around.triangles),
            std::move(chosen),
            point_gap(positions, triangles, positions.size()),
            point_gap(positions, triangles, count),
            std::move(fine),
            std::move(coarse)};
}

std::vector<SurfaceTarget> surface_targets(std::span<const Point3f> moved, std::span<const Point3f> normals,
                                           const TargetSurface& target, const SurfaceTargetOptions& options) {
    std::vector<SurfaceTarget> out(moved.size());
    parallel_for(moved.size(), options.threads, 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) out[v] = target_of(moved[v], normals[v], target, options);
    });
    return out;
}

}  // namespace htvm
