#include "surface/target_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace htvm::internal {
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

// The closest point of a triangle, by the region that the point is in: beyond a corner, a side, or above the inside.
Vector closest_on_triangle(const Vector& p, const Vector& a, const Vector& b, const Vector& c) {
    const Vector ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
    const float ab_a = ab.dot(ap), ac_a = ac.dot(ap), ab_b = ab.dot(bp), ac_b = ac.dot(bp), ab_c = ab.dot(cp),
                ac_c = ac.dot(cp);
    if (ab_a <= 0 && ac_a <= 0) return a;
    if (ab_b >= 0 && ac_b <= ab_b) return b;
    if (ac_c >= 0 && ab_c <= ac_c) return c;
    // The shares of the corners, but for a common factor.
    const float of_c = ab_a * ac_b - ab_b * ac_a;
    if (of_c <= 0 && ab_a >= 0 && ab_b <= 0) return a + ab * (ab_a / (ab_a - ab_b));
    const float of_b = ab_c * ac_a - ab_a * ac_c;
    if (of_b <= 0 && ac_a >= 0 && ac_c <= 0) return a + ac * (ac_a / (ac_a - ac_c));
    const float of_a = ab_b * ac_c - ab_c * ac_b, to_c = ac_b - ab_b, to_b = ab_c - ac_c;
    if (of_a <= 0 && to_c >= 0 && to_b >= 0) return b + (c - b) * (to_c / (to_c + to_b));
    const float sum = of_a + of_b + of_c;
    return sum > 0 ? Vector(a + ab * (of_b / sum) + ac * (of_c / sum)) : a;
}

// guess: the vertex to begin with, OrientedPoints::no_point for none; becomes the one that was found.
SurfaceTarget target_of(const Point3f& moved, const Point3f& normal, const TargetSurface& target,
                        const SurfaceTargetOptions& options, std::uint32_t& guess) {
    SurfaceTarget out;
    const auto match = target.fine.nearest(moved, normal, options.reach, options.agreement, guess);
    if (!match.found) return out;
    guess = match.index;
    const Vector p = vector_of(moved), n = vector_of(normal);
    float best = std::numeric_limits<float>::max();
    for (std::uint32_t i = target.first_around[match.index]; i < target.first_around[match.index + 1]; ++i) {
        const std::uint32_t triangle = target.around[i];
        const Vector across = vector_of(target.triangle_normals[triangle]);
        if (across.dot(n) < options.agreement || across == Vector::Zero()) continue;
        const auto& t = target.triangles[triangle];
        const Vector a = vector_of(target.positions[t[0]]);
        const float height = across.dot(p - a);
        if (height * height > best) continue;
        const Vector q =
            closest_on_triangle(p, a, vector_of(target.positions[t[1]]), vector_of(target.positions[t[2]]));
        const float d = (q - p).squaredNorm();
        if (!(d < best)) continue;
        best = d;
        out = {point_of(q), target.triangle_normals[triangle], triangle, true};
    }
    return out;
}

// Of all triangles.
struct TriangleNormals {
    std::vector<Point3f> normals;  // unit length; zero where there is no area
    std::vector<Vector> sum;       // by vertex, weighted by twice the area
    double area = 0;               // of all together
};

TriangleNormals normals_of_triangles(std::span<const Point3f> positions, std::span<const Triangle> triangles) {
    TriangleNormals out;
    out.normals.resize(triangles.size());
    out.sum.assign(positions.size(), Vector::Zero());
    double doubled = 0;
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const auto& t = triangles[i];
        const Vector a = vector_of(positions[t[0]]);
        const Vector across = (vector_of(positions[t[1]]) - a).cross(vector_of(positions[t[2]]) - a);
        const float length = across.norm();
        if (length > 0) out.normals[i] = point_of(Vector(across / length));
        doubled += static_cast<double>(length);
        for (const std::uint32_t v : t) out.sum[v] += across;
    }
    out.area = 0.5 * doubled;
    return out;
}

std::vector<Point3f> unit_vectors(const std::vector<Vector>& vectors) {
    std::vector<Point3f> out(vectors.size());
    for (std::size_t v = 0; v < vectors.size(); ++v) {
        const float length = vectors[v].norm();
        if (length > 0 && std::isfinite(length)) out[v] = point_of(Vector(vectors[v] / length));
    }
    return out;
}

// Between so many points that are spread over so much surface.
float gap_of(double area, std::size_t count) {
    const double gap = count > 0 ? std::sqrt(area / static_cast<double>(count)) : 0;
    return std::isfinite(gap) ? static_cast<float>(gap) : 0.0f;
}

}  // namespace

std::vector<Point3f> vertex_normals(std::span<const Point3f> positions, std::span<const Triangle> triangles,
                                    Threads threads) {
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
    return gap_of(area, count);
}

TargetSurface make_target_surface(std::span<const Point3f> positions, std::span<const Triangle> triangles, float cell,
                                  std::size_t samples, Threads threads) {
    TriangleNormals of_triangles;
    std::vector<Point3f> normals;
    Around around;
    parallel_invoke(
        threads, [&] { around = triangles_around(positions.size(), triangles); },
        [&] {
            of_triangles = normals_of_triangles(positions, triangles);
            normals = unit_vectors(of_triangles.sum);
        });
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
            std::move(of_triangles.normals),
            std::move(around.first),
            std::move(around.triangles),
            std::move(chosen),
            gap_of(of_triangles.area, positions.size()),
            gap_of(of_triangles.area, count),
            std::move(fine),
            std::move(coarse)};
}

void add_middle(SurfaceSamples& samples, std::span<const Point3f> points, std::span<const Point3f> normals,
                const Triangle& triangle) {
    Point3f point{}, normal{};
    for (const auto corner : triangle)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            point[axis] += points[corner][axis] / 3;
            normal[axis] += normals[corner][axis];
        }
    const float length = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    if (length > 0)
        for (auto& c : normal) c /= length;
    samples.points.push_back(point);
    samples.normals.push_back(normal);
}

std::vector<SurfaceTarget> surface_targets(std::span<const Point3f> moved, std::span<const Point3f> normals,
                                           const TargetSurface& target, const SurfaceTargetOptions& options) {
    std::vector<SurfaceTarget> out(moved.size());
    parallel_for(moved.size(), options.threads, 1024, [&](std::size_t begin, std::size_t end) {
        std::uint32_t guess = OrientedPoints::no_point;  // neighbours in order are mostly neighbours in space
        for (std::size_t v = begin; v < end; ++v) out[v] = target_of(moved[v], normals[v], target, options, guess);
    });
    return out;
}

}  // namespace htvm::internal
