#include "codec/encoder/bones/moving_part.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "surface/surface_index.h"

namespace htvm::internal {
namespace {

// Distances to the surface of a mesh, estimated by the plane through its nearest vertex: fast, and accurate enough for
// a choice.
struct Planes {
    NearestPoints tree;
    std::vector<Point3f> normals;
    float reach = 0;  // points farther than this from the nearest vertex are beyond the end of the surface

    Planes(std::span<const Point3f> points, std::span<const Triangle> triangles, double edge)
        : tree(points), normals(points_of(vertex_normals(points, triangles))), reach(static_cast<float>(3 * edge)) {}
    float distance(const Point3f& query, const Neighbour& nearest) const {
        const auto &point = tree.point(nearest.index), &normal = normals[nearest.index];
        const float far = std::sqrt(nearest.squared_distance);
        if (far > reach || normal == Point3f{}) return far;
        return std::abs((query[0] - point[0]) * normal[0] + (query[1] - point[1]) * normal[1] +
                        (query[2] - point[2]) * normal[2]);
    }
};

struct Sums {
    double squares = 0;
    std::uint64_t count = 0;
    void add(float distance) {
        squares += double{distance} * distance;
        ++count;
    }
    double rms() const { return count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0; }
};

}  // namespace

AnimationFit measure_animation(const LatticeMesh& mesh, const ReferenceMesh& reference,
                               std::span<const LatticePoint> predicted, bool both_ways, Threads threads) {
    constexpr std::size_t stride = 4;  // in this direction, only every n-th vertex is measured
    const auto captured_points = points_of(mesh.positions), predicted_points = points_of(predicted);
    const double edge = mean_edge(reference.mesh.positions, reference.mesh.triangles);
    const std::size_t bones = reference.pivots.size();
    AnimationFit out;
    out.nearest.resize(captured_points.size());
    out.distance.resize(captured_points.size());
    const Planes surface(predicted_points, reference.mesh.triangles, edge);
    parallel_for(captured_points.size(), threads, 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const auto found = surface.tree.nearest(captured_points[k]);
            out.nearest[k] = found.index;
            out.distance[k] = surface.distance(captured_points[k], found);
        }
    });
    std::vector<Sums> forth(bones), back(bones);
    for (std::size_t k = 0; k < captured_points.size(); ++k)
        forth[reference.bone_of_vertex[out.nearest[k]]].add(out.distance[k]);
    if (both_ways && !captured_points.empty()) {
        const Planes captured(captured_points, mesh.triangles, edge);
        std::vector<float> distance((predicted_points.size() + stride - 1) / stride);
        parallel_for(distance.size(), threads, 512, [&](std::size_t begin, std::size_t end) {
            for (std::size_t k = begin; k < end; ++k) {
                const auto& query = predicted_points[k * stride];
                distance[k] = captured.distance(query, captured.tree.nearest(query));
            }
        });
        for (std::size_t k = 0; k < distance.size(); ++k) back[reference.bone_of_vertex[k * stride]].add(distance[k]);
    }
    for (std::size_t bone = 0; bone < bones; ++bone) out.rms.push_back(std::max(forth[bone].rms(), back[bone].rms()));
    return out;
}

std::vector<bool> choose_coded_bones(std::span<const double> shifts, const AnimationFit& fit, LatticeUnits still_below,
                                     LatticeUnits largest_error) {
    std::vector<bool> out;
    for (std::size_t bone = 0; bone < shifts.size(); ++bone)
        out.push_back(shifts[bone] >= still_below.value ||
                      (largest_error.value > 0 && fit.rms[bone] > largest_error.value));
    return out;
}

MovingPart cut_moving_part(const LatticeMesh& mesh, std::span<const BoneIndex> bone_of_vertex,
                           const ReferenceMesh& reference, const AnimationFit& fit,
                           const std::vector<bool>& coded_bones, LatticeUnits stray) {
    const std::size_t n = mesh.positions.size();
    std::vector<bool> coded(n), kept(n);
    for (std::size_t k = 0; k < n; ++k)
        kept[k] = coded[k] =
            coded_bones[reference.bone_of_vertex[fit.nearest[k]]] || static_cast<double>(fit.distance[k]) > stray.value;
    std::vector<Triangle> triangles;
    for (const auto& t : mesh.triangles) {
        if (!coded[t[0]] && !coded[t[1]] && !coded[t[2]]) continue;
        triangles.push_back(t);
        for (const auto v : t) kept[v] = true;
    }
    MovingPart out;
    std::vector<std::uint32_t> number(n);
    for (std::size_t k = 0; k < n; ++k) {
        if (!kept[k]) continue;
        number[k] = static_cast<std::uint32_t>(out.mesh.positions.size());
        out.mesh.positions.push_back(mesh.positions[k]);
        if (!mesh.colours.empty()) out.mesh.colours.push_back(mesh.colours[k]);
        if (!mesh.normals.empty()) out.mesh.normals.push_back(mesh.normals[k]);
        if (!mesh.texcoords.empty()) out.mesh.texcoords.push_back(mesh.texcoords[k]);
        out.bone_of_vertex.push_back(bone_of_vertex[k]);
        out.nearest.push_back(fit.nearest[k]);
    }
    for (auto& t : triangles)
        for (auto& v : t) v = number[v];
    out.mesh.triangles = std::move(triangles);
    return out;
}

}  // namespace htvm::internal
