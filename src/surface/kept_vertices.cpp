#include "surface/kept_vertices.h"

#include <algorithm>

#include "core/parallel.h"
#include "surface/tracked_registration.h"

namespace htvm::internal {
namespace {

using Eigen::Vector3d;

Vector3d vector_of(const Point3f& p) { return {p[0], p[1], p[2]}; }

// The vertex beside each sample of the reference as it was moved; OrientedPoints::no_point where none is near.
std::vector<std::uint32_t> vertices_beside(const DeformableMesh& mesh, std::span<const RigidMotion> last,
                                           const KeptVertices& vertices, const KeptVerticesOptions& options) {
    const auto moved = deform(mesh, last, options.threads);
    const auto normals = points_of(vertex_normals(std::span<const Point3f>(moved), mesh.triangles));
    const auto reach = static_cast<float>(options.scale.on_lattice(options.reach).value);
    const OrientedPoints near(vertices.before, points_of(vertex_normals(vertices.before, vertices.triangles)),
                              std::max(1.0F, reach / 8));
    std::vector<std::uint32_t> out(mesh.samples.size(), OrientedPoints::no_point);
    parallel_for(out.size(), options.threads, 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const auto v = mesh.samples[i];
            const auto found = near.nearest(moved[v], normals[v], reach, options.agreement);
            if (found.found) out[i] = found.index;
        }
    });
    return out;
}

RigidMotion step_of(const KeptVertices& vertices, std::span<const std::uint32_t> which) {
    std::vector<Vector3d> from, to;
    for (const auto v : which) {
        from.push_back(vector_of(vertices.before[v]));
        to.push_back(vector_of(vertices.now[v]));
    }
    return align(from, to);
}

}  // namespace

std::vector<RigidMotion> carried_by_vertices(const DeformableMesh& mesh, std::span<const RigidMotion> last,
                                             const KeptVertices& vertices, const KeptVerticesOptions& options) {
    constexpr float least_weight = 0.2F;  // of a handle at a sample that says something about it
    const auto beside = vertices_beside(mesh, last, vertices, options);
    std::vector<std::vector<std::uint32_t>> of_handle(mesh.handles.size());
    std::vector<std::uint32_t> all;
    for (std::size_t i = 0; i < beside.size(); ++i) {
        if (beside[i] == OrientedPoints::no_point) continue;
        all.push_back(beside[i]);
        const auto& blend = mesh.blends[mesh.samples[i]];
        for (std::size_t k = 0; k < blend.count; ++k)
            if (blend.weight[k] >= least_weight) of_handle[blend.handle[k]].push_back(beside[i]);
    }
    if (all.empty()) return {};
    const RigidMotion of_all = step_of(vertices, all);
    std::vector<RigidMotion> out(mesh.handles.size());
    parallel_for(out.size(), options.threads, 8, [&](std::size_t begin, std::size_t end) {
        for (std::size_t h = begin; h < end; ++h) {
            const RigidMotion step = of_handle[h].size() < options.fewest ? of_all : step_of(vertices, of_handle[h]);
            out[h] = last.empty() ? step : step * last[h];
        }
    });
    return out;
}

}  // namespace htvm::internal
