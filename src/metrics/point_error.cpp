#include "metrics/point_error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>

#include "core/parallel.h"
#include "metrics/mesh_measures.h"

namespace htvm {

using namespace internal;
namespace {

struct Cloud {
    std::span<const Vector3f> points;
    std::size_t kdtree_get_point_count() const { return points.size(); }
    double kdtree_get_pt(std::uint32_t i, std::size_t axis) const { return points[i][axis]; }
    template <class BoundingBox>
    bool kdtree_get_bbox(BoundingBox&) const {
        return false;
    }
};

using Tree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud, double>, Cloud, 3, std::uint32_t>;

// Keeps the nearest point seen and, of equally near ones, the lowest index. The radius that it gives the tree search is
// slightly wider than the best distance, so that branches with an equally near point are not pruned.
struct NearestWithLowestIndex {
    using DistanceType = double;
    using IndexType = std::uint32_t;
    double squared_distance = std::numeric_limits<double>::infinity();
    std::uint32_t index = std::numeric_limits<std::uint32_t>::max();

    bool addPoint(double candidate_distance, std::uint32_t candidate) {
        if (candidate_distance < squared_distance || (candidate_distance == squared_distance && candidate < index)) {
            squared_distance = candidate_distance;
            index = candidate;
        }
        return true;
    }
    double worstDist() const { return squared_distance * (1 + 1e-9) + std::numeric_limits<double>::min(); }
    bool full() const { return true; }
    void sort() {}  // nanoflann from 1.5 on asks for it
};

}  // namespace

std::vector<std::uint32_t> nearest_vertices(std::span<const Vector3f> from, std::span<const Vector3f> to,
                                            Threads threads) {
    if (from.empty() || to.empty()) return {};
    const Cloud cloud{to};
    Tree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(12));
    tree.buildIndex();
    std::vector<std::uint32_t> nearest(from.size());
    parallel_for(from.size(), threads, 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const std::array<double, 3> query{from[i][0], from[i][1], from[i][2]};
            NearestWithLowestIndex best;
            tree.findNeighbors(best, query.data(), {});
            nearest[i] = best.index;
        }
    });
    return nearest;
}

PointErrorSums& operator+=(PointErrorSums& sums, const PointErrorSums& frame) {
    sums.vertices += frame.vertices;
    sums.squared_distance += frame.squared_distance;
    sums.largest_distance = std::max(sums.largest_distance, frame.largest_distance);
    sums.colour_vertices += frame.colour_vertices;
    sums.squared_colour += frame.squared_colour;
    return sums;
}

PointError& operator+=(PointError& sums, const PointError& frame) {
    sums.forward += frame.forward;
    sums.backward += frame.backward;
    return sums;
}

PointErrorSums sum_point_errors(const Mesh& from, const Mesh& to, std::span<const std::uint32_t> nearest) {
    PointErrorSums sums;
    sums.vertices = from.positions.size();
    if (from.positions.empty()) return sums;
    if (to.positions.empty()) {
        sums.squared_distance = sums.largest_distance = std::numeric_limits<double>::infinity();
        return sums;
    }
    double largest = 0;
    for (std::size_t v = 0; v < from.positions.size(); ++v) {
        const Point3 d = to_point(from.positions[v]) - to_point(to.positions[nearest[v]]);
        sums.squared_distance += dot(d, d);
        largest = std::max(largest, dot(d, d));
    }
    sums.largest_distance = std::sqrt(largest);
    if (from.colours.empty() || to.colours.empty()) return sums;
    sums.colour_vertices = from.positions.size();
    std::uint64_t squared_colour = 0;  // exact: at most 3 * 255^2 per vertex
    for (std::size_t v = 0; v < from.colours.size(); ++v)
        for (std::size_t c = 0; c < 3; ++c) {
            const int d = int{from.colours[v][c]} - int{to.colours[nearest[v]][c]};
            squared_colour += static_cast<std::uint64_t>(d * d);
        }
    sums.squared_colour = static_cast<double>(squared_colour);
    return sums;
}

PointError point_error(const Mesh& original, const Mesh& decoded, Threads threads) {
    const auto first = without_hidden_vertices(original), second = without_hidden_vertices(decoded);
    const Mesh &from = first ? *first : original, &to = second ? *second : decoded;
    const auto forward = nearest_vertices(from.positions, to.positions, threads);
    const auto backward = nearest_vertices(to.positions, from.positions, threads);
    return {sum_point_errors(from, to, forward), sum_point_errors(to, from, backward)};
}

double rms_distance(const PointErrorSums& sums) {
    return sums.vertices > 0 ? std::sqrt(sums.squared_distance / static_cast<double>(sums.vertices)) : 0;
}

double rms_colour(const PointErrorSums& sums) {
    return sums.colour_vertices > 0 ? std::sqrt(sums.squared_colour / static_cast<double>(sums.colour_vertices)) : 0;
}

double m1_geometry(const PointError& sums) { return std::max(rms_distance(sums.forward), rms_distance(sums.backward)); }

double m1_colour(const PointError& sums) { return std::max(rms_colour(sums.forward), rms_colour(sums.backward)); }

}  // namespace htvm
