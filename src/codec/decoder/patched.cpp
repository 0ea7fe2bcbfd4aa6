// Decodes TP-frames: a T-frame of which a part is replaced. The patched mesh is the reference of what follows.
#include "codec/decoder/frame_decoders.h"
#include "codec/format/frame_kinds.h"
#include "codec/tracked/presence.h"
#include "codec/tracked/surface_patch.h"

namespace htvm::internal {

Result<void> decode_patched(DecoderState& state, const Packet& packet, const FramePayloadView& payload) {
    const auto& header = *state.header;
    if (header.node_spacing == 0)
        return fail(ErrorKind::corrupt_stream, "a patched frame in a stream whose header says that it has none");
    if (!is_referred(packet, rules_of(FrameType::patched)))
        return fail(ErrorKind::corrupt_stream, "a patched frame that nothing may refer to");
    auto pose = decode_pose(payload.of(Layer::pose), header.skeleton.joint_names.size(), header.skeleton.bones.size());
    if (!pose) return tl::unexpected(pose.error());
    const bool derives_for_itself = !state.reference->by_nodes;
    if (auto ok = derive_nodes(*state.reference, header, state.threads); !ok) return tl::unexpected(ok.error());
    const auto& reference = *state.reference->by_nodes;
    if (!reference.mesh.texcoords.empty())
        return fail(ErrorKind::corrupt_stream, "a patched frame whose reference has texture coordinates");
    auto& history = state.nodes;
    if (history.newest == &history.next)
        history.newest = history.frame ? &history.last : nullptr;  // it is written over
    auto& tracked = history.next;
    if (auto ok = decode_tracked_frame(payload.of(Layer::tracked), reference, nullptr, state.threads, tracked); !ok)
        return ok;
    const auto& triangles = reference.mesh.triangles;
    auto patched = decode_patch(payload, {tracked.positions, triangles, tracked.colours}, reference.hierarchy);
    if (!patched) return tl::unexpected(patched.error());
    smooth_what_is_new(*patched, static_cast<std::int32_t>(payload.header.geometry_step),
                       !reference.mesh.normals.empty());
    auto& mesh = patched->mesh;
    // With what the patch added, the mesh may be larger than its header says, and than its reference.
    if (auto ok = check_limits({}, {mesh.positions.size(), mesh.triangles.size()}, {}, 0, state.options); !ok)
        return fail(ok.error().kind, "frame " + std::to_string(packet.frame) + ": " + ok.error().message);
    auto detail = detail_that_stays(state.reference->detail, reference.mesh.positions.size(), patched->stays, mesh);
    const auto& before = state.reference->textured;
    auto textured = before.empty() ? Result<TexturedSurface>()
                                   : read_charts(state, payload, mesh, detail,
                                                 corners_that_stay(before.corners, triangles,
                                                                   reference.mesh.positions.size(), patched->stays));
    if (!textured) return tl::unexpected(textured.error());
    Presence presence;
    if (reference.has_presence)
        presence = presence_of_patched(tracked.state.presence, patched->stays, mesh.positions.size());
    ReferenceFacts facts{.number = packet.frame,
                         .captured = {payload.header.source_vertices, payload.header.source_triangles},
                         .kept = keep_nodes(reference.nodes, patched->stays),
                         .textured = std::move(*textured),
                         .presence = std::move(presence),
                         .detail = std::move(detail)};
    if (reference.projection) facts.projection = tracked.state.head.projection;
    auto shown = to_pose(*pose, header.lattice);
    const auto topology = new_topology(state);
    // Its nodes are for the next frame to derive, or for the time between, so that no frame has to do the work of two.
    // A part is done here by a frame that found its own reference's nodes derived.
    auto renewed = make_reference(header, std::move(facts), std::move(mesh), std::move(*pose),
                                  {.bones = false, .nodes = false}, state.threads);
    if (!renewed) return tl::unexpected(renewed.error());
    if (!derives_for_itself && !state.prepares) derive_hierarchy(*renewed, header);
    show(state, view_of(*renewed), topology, std::move(shown));
    // Nothing can fail from here on.
    state.reference = std::move(*renewed);
    state.reference_topology = topology;
    state.bones = {};
    state.nodes = {};
    return {};
}

}  // namespace htvm::internal
