#include "metrics/cloud_psnr.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "metrics/mesh_measures.h"
#include "metrics/point_error.h"

namespace htvm {

CloudErrorSums& operator+=(CloudErrorSums& sums, const CloudErrorSums& frame) {
    sums.vertices += frame.vertices;
    sums.squared_point += frame.squared_point;
    sums.squared_plane += frame.squared_plane;
    return sums;
}

CloudError& operator+=(CloudError& sums, const CloudError& frame) {
    sums.forward += frame.forward;
    sums.backward += frame.backward;
    return sums;
}

CloudErrorSums sum_cloud_errors(const Mesh& from, const Mesh& to, std::span<const std::uint32_t> nearest) {
    CloudErrorSums sums;
    sums.vertices = from.positions.size();
    if (from.positions.empty()) return sums;
    if (to.positions.empty()) {
        sums.squared_point = sums.squared_plane = std::numeric_limits<double>::infinity();
        return sums;
    }
    const auto computed = to.normals.empty() ? welded_normals(to) : std::vector<Vector3f>{};
    const auto& normals = to.normals.empty() ? computed : to.normals;
    for (std::size_t v = 0; v < from.positions.size(); ++v) {
        const Point3 d = to_point(from.positions[v]) - to_point(to.positions[nearest[v]]);
        const Point3 n = normalised(to_point(normals[nearest[v]]));
        const double across = dot(d, n);
        sums.squared_point += dot(d, d);
        sums.squared_plane += dot(n, n) > 0 ? across * across : dot(d, d);
    }
    return sums;
}

CloudError cloud_error(const Mesh& original, const Mesh& decoded, internal::Threads threads) {
    const auto first = without_hidden_vertices(original), second = without_hidden_vertices(decoded);
    const Mesh &from = first ? *first : original, &to = second ? *second : decoded;
    const auto forward = nearest_vertices(from.positions, to.positions, threads);
    const auto backward = nearest_vertices(to.positions, from.positions, threads);
    return {sum_cloud_errors(from, to, forward), sum_cloud_errors(to, from, backward)};
}

double psnr(double peak, double mean_squared_error) {
    if (!(mean_squared_error > 0)) return std::numeric_limits<double>::infinity();
    return 10 * std::log10(peak * peak / mean_squared_error);
}

namespace {

double mean(double sum, std::uint64_t count) { return count > 0 ? sum / static_cast<double>(count) : 0; }

}  // namespace

double d1_error(const CloudError& sums) {
    return std::max(mean(sums.forward.squared_point, sums.forward.vertices),
                    mean(sums.backward.squared_point, sums.backward.vertices));
}

double d2_error(const CloudError& sums) {
    return std::max(mean(sums.forward.squared_plane, sums.forward.vertices),
                    mean(sums.backward.squared_plane, sums.backward.vertices));
}

double d1_psnr(const CloudError& sums, double peak) { return psnr(peak, d1_error(sums)); }
double d2_psnr(const CloudError& sums, double peak) { return psnr(peak, d2_error(sums)); }

}  // namespace htvm
