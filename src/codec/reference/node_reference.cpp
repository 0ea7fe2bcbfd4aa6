#include "codec/reference/node_reference.h"

#include <algorithm>
#include <utility>

#include "codec/reference/quantiser_cells.h"
#include "core/parallel.h"

namespace htvm::internal {
namespace {

NodeGraph graph_of(const DeformationNodes& nodes, const LatticeMesh& mesh) {
    NodeGraph out;
    out.lower.resize(nodes.vertex.size());
    for (const auto& pair : nodes.neighbours) out.lower[pair.second].push_back(pair.first);  // the pairs ascend
    const auto normals = vertex_normals(mesh.positions, mesh.triangles);
    for (const auto v : nodes.vertex) {
        out.pivots.push_back(mesh.positions[v]);
        out.normals.push_back(normals[v]);
    }
    return out;
}

}  // namespace

Result<NodeReference> make_node_reference(const LatticeMesh& mesh, std::int32_t node_spacing, std::int32_t step,
                                          Threads threads, const KeptNodes& kept, std::optional<NodesAhead> ahead) {
    NodeReference out;
    out.mesh = mesh;
    out.mesh.positions = averaged_within_cells(mesh.positions, mesh.triangles, step);
    DeformationNodeOptions options;
    options.spacing = node_spacing;
    options.link_reach = std::max(node_spacing / 10, 1);
    Result<VertexHierarchy> hierarchy;
    const VerticesAround around =
        ahead ? std::move(ahead->around) : vertices_around(out.mesh.positions.size(), out.mesh.triangles);
    parallel_invoke(
        threads,
        [&] {
            if (ahead)
                hierarchy = std::move(ahead->hierarchy);
            else
                hierarchy = build_vertex_hierarchy(out.mesh.positions, out.mesh.triangles, &around);
        },
        [&] { out.nodes = choose_deformation_nodes(out.mesh.positions, out.mesh.triangles, options, kept, &around); });
    out.graph = graph_of(out.nodes, out.mesh);
    if (!hierarchy) return tl::unexpected(hierarchy.error());
    out.hierarchy = std::move(*hierarchy);
    return out;
}

}  // namespace htvm::internal
