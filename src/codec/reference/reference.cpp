#include "codec/reference/reference.h"

#include <utility>

#include "codec/reference/quantiser_cells.h"

namespace htvm::internal {

std::int32_t smooth_as_shown(LatticeMesh& mesh, std::int32_t step, bool settled, const SequenceHeader& header) {
    if (header.version < shown_smoothed_version || header.node_spacing == 0) return step;
    const QuantiserCells cells{.step = step, .at_seams = !mesh.texcoords.empty()};
    if (!settled) mesh.positions = smoothed_within_cells(mesh.positions, mesh.triangles, cells);
    return 1;
}

void derive_bones(Reference& reference, const SequenceHeader& header, Threads threads) {
    if (reference.has_bones) return;
    skin_reference(reference.skinned, header.skeleton.bones, header.radii, header.weight_width, threads);
    reference.has_bones = true;
}

void derive_hierarchy(Reference& reference, const SequenceHeader& header) {
    if (header.node_spacing == 0 || reference.step != 1 || reference.by_nodes || reference.ahead) return;
    const auto& mesh = reference.mesh();
    auto around = vertices_around(mesh.positions.size(), mesh.triangles);
    auto hierarchy = build_vertex_hierarchy(mesh.positions, mesh.triangles, &around);
    if (hierarchy)
        reference.ahead =
            NodesAhead{std::move(around), std::move(*hierarchy)};  // else derive_nodes() says what is wrong
}

Result<void> derive_nodes(Reference& reference, const SequenceHeader& header, Threads threads) {
    if (reference.by_nodes) return {};
    auto nodes = make_node_reference(reference.mesh(), header.node_spacing, reference.step, threads, reference.kept,
                                     std::exchange(reference.ahead, std::nullopt));
    if (!nodes) return tl::unexpected(nodes.error());
    reference.by_nodes = std::move(*nodes);
    auto& by_nodes = *reference.by_nodes;
    by_nodes.captured = reference.captured;
    by_nodes.projection = reference.projection;
    if (header.version >= presence_version) {
        by_nodes.has_presence = true;
        by_nodes.presence = reference.presence;
        by_nodes.around = vertices_around(by_nodes.mesh.positions.size(), by_nodes.mesh.triangles);
    }
    return {};
}

Result<Reference> make_reference(const SequenceHeader& header, ReferenceFacts facts, LatticeMesh mesh, CodedPose pose,
                                 Derived derived, Threads threads) {
    Reference out;
    out.number = facts.number;
    out.step = facts.step;
    out.captured = facts.captured;
    out.kept = std::move(facts.kept);
    out.textured = std::move(facts.textured);
    out.projection = facts.projection;
    out.presence = std::move(facts.presence);
    out.detail = std::move(facts.detail);
    out.skinned.mesh = std::move(mesh);
    out.skinned.joints = std::move(pose.joints);
    out.skinned.orientations = std::move(pose.orientations);
    out.skinned.frame = facts.number;
    if (derived.nodes && header.node_spacing > 0)
        if (auto ok = derive_nodes(out, header, threads); !ok) return tl::unexpected(ok.error());
    if (derived.bones) derive_bones(out, header, threads);
    return out;
}

}  // namespace htvm::internal
