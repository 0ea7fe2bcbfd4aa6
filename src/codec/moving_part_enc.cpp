#include "codec/moving_part_enc.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "geometry/surface_distance.h"

namespace htvm {
namespace {

std::vector<Point3f> points_of(std::span<const LatticePoint> positions) {
    std::vector<Point3f> out;
    out.reserve(positions.size());
    for (const auto p : positions) out.push_back(point_of(p));
    return out;
}

// The corner that the closest point is nearest to; of a mesh without triangles, the point's own vertex.
std::uint32_t nearest_corner(const SurfacePoint& point, std::span<const Triangle> triangles) {
    if (triangles.empty()) return point.triangle;
    const auto largest = std::max_element(point.barycentric.begin(), point.barycentric.end());
    return triangles[point.triangle][static_cast<std::size_t>(largest - point.barycentric.begin())];
}

struct Sums {
    double squares = 0;
    std::uint64_t count = 0;
    double rms() const { return count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0; }
};

}  // namespace

AnimationFit measure_animation(const LatticeMesh& mesh, const ReferenceMesh& reference,
                               std::span<const LatticePoint> predicted, unsigned threads) {
    constexpr std::uint32_t stride = 4;  // the way back is sampled
    const auto captured_points = points_of(mesh.positions), predicted_points = points_of(predicted);
    const std::size_t bones = reference.pivots.size();
    AnimationFit out;
    out.nearest.resize(captured_points.size());
    out.distance.resize(captured_points.size());
    const SurfaceSearch surface(predicted_points, reference.mesh.triangles);
    parallel_for(captured_points.size(), threads, 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const auto found = surface.closest(captured_points[k]);
            out.nearest[k] = nearest_corner(found, reference.mesh.triangles);
            out.distance[k] = std::sqrt(found.squared_distance);
        }
    });
    std::vector<Sums> forth(bones);
    for (std::size_t k = 0; k < captured_points.size(); ++k) {
        auto& sum = forth[reference.bone_of_vertex[out.nearest[k]]];
        sum.squares += double{out.distance[k]} * out.distance[k];
        ++sum.count;
    }
    for (const auto& sum : forth) out.rms.push_back(sum.rms());
    if (captured_points.empty()) return out;
    const SurfaceSearch captured(captured_points, mesh.triangles);
    const auto back = region_errors({predicted_points, reference.mesh.triangles, {}}, reference.bone_of_vertex, bones,
                                    {captured_points, mesh.triangles, {}}, captured, {threads, stride});
    for (std::size_t bone = 0; bone < bones; ++bone)
        if (back[bone].samples > 0)
            out.rms[bone] = std::max(out.rms[bone],
                                     std::sqrt(back[bone].squared_distance / static_cast<double>(back[bone].samples)));
    return out;
}

std::vector<bool> choose_coded_bones(std::span<const double> shifts, const AnimationFit& fit, double still_below,
                                     double largest_error) {
    std::vector<bool> out;
    for (std::size_t bone = 0; bone < shifts.size(); ++bone)
        out.push_back(shifts[bone] >= still_below || (largest_error > 0 && fit.rms[bone] > largest_error));
    return out;
}

MovingPart cut_moving_part(const LatticeMesh& mesh, std::span<const BoneIndex> bone_of_vertex,
                           const ReferenceMesh& reference, const AnimationFit& fit,
                           const std::vector<bool>& coded_bones, double stray) {
    const std::size_t n = mesh.positions.size();
    std::vector<bool> coded(n), kept(n);
    for (std::size_t k = 0; k < n; ++k)
        kept[k] = coded[k] =
            coded_bones[reference.bone_of_vertex[fit.nearest[k]]] || static_cast<double>(fit.distance[k]) > stray;
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
    }
    for (auto& t : triangles)
        for (auto& v : t) v = number[v];
    out.mesh.triangles = std::move(triangles);
    return out;
}

}  // namespace htvm
