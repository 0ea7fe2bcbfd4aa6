// Decodes I-frames: complete meshes that later frames refer to unless the packet tells otherwise.
#include <algorithm>

#include "codec/decoder/frame_decoders.h"
#include "codec/format/decoder_limits.h"
#include "codec/format/frame_kinds.h"
#include "codec/intra/intra_frame.h"
#include "codec/intra/leveled_frame.h"
#include "codec/tracked/presence.h"

namespace htvm::internal {
namespace {

struct IntraMesh {
    LatticeMesh mesh;
    SurfaceDetail detail;
    std::int32_t step = 1;  // of the reference that it becomes: Reference::step
};

Result<IntraMesh> decode_mesh(const DecoderState& state, const Packet& packet, const FramePayloadView& payload) {
    if (payload.header.intra_coder == intra_coder_levels) {
        const auto most = std::min<std::uint64_t>(
            state.options.max_vertices, payload.header.vertices + state.spare_memory / memory_of_detail_vertex);
        auto leveled = decode_leveled_frame(payload, static_cast<std::size_t>(most), state.threads);
        if (!leveled) return tl::unexpected(leveled.error());
        return IntraMesh{std::move(leveled->mesh), std::move(leveled->detail)};
    }
    const auto& external = state.options.intra_coder;
    auto mesh = decode_intra_frame(payload, external ? &*external : nullptr, state.threads);
    if (!mesh) return tl::unexpected(mesh.error());
    const bool settled = packet.has(packet_flag::flags_valid) && packet.has(packet_flag::of_tracked_mesh);
    const auto step =
        smooth_as_shown(*mesh, static_cast<std::int32_t>(payload.header.geometry_step), settled, *state.header);
    return IntraMesh{std::move(*mesh), {}, step};
}

LatticeMeshView view_of(const UnreferredIntra& intra) {
    auto out = view_of(intra.mesh, &intra.textured);
    out.detail = &intra.detail;
    if (intra.projection) out.projection = &*intra.projection;
    return out;
}

}  // namespace

Result<void> decode_intra(DecoderState& state, const Packet& packet, const FramePayloadView& payload) {
    const auto& header = *state.header;
    auto pose = decode_pose(payload.of(Layer::pose), header.skeleton.joint_names.size(), header.skeleton.bones.size());
    if (!pose) return tl::unexpected(pose.error());
    const bool referred = is_referred(packet, rules_of(*frame_type(packet.kind)));
    // What is derived for T-frames takes much memory, so it is freed before the next I-frame is decoded; without this,
    // a stream of many I-frames would need half as much memory again as a stream with one. It can be rebuilt from the
    // mesh: if this frame turns out to be bad, the next T-frame does so.
    if (state.reference && referred) state.reference->by_nodes.reset(), state.reference->ahead.reset();
    auto decoded = decode_mesh(state, packet, payload);
    if (!decoded) return tl::unexpected(decoded.error());
    auto& [mesh, detail, step] = *decoded;
    auto textured = read_charts(state, payload, mesh, detail);
    if (!textured) return tl::unexpected(textured.error());
    const auto projection = read_projection(state, payload, mesh);
    if (!projection) return tl::unexpected(projection.error());
    if (!detail.empty() && !mesh.texcoords.empty())
        return fail(ErrorKind::corrupt_stream, "I-frame: a mesh with detail that has texture coordinates");
    Presence presence;
    if (referred && header.version >= presence_version && payload.has(Layer::presence)) {
        auto read = read_presence_layer(payload.of(Layer::presence), mesh.positions.size(), mesh.triangles);
        if (!read) return tl::unexpected(read.error());
        presence = std::move(*read);
    }
    auto shown = to_pose(*pose, header.lattice);
    const auto topology = new_topology(state);
    if (!referred) {
        UnreferredIntra unreferred{packet.frame,         topology,    std::move(mesh), std::move(detail),
                                   std::move(*textured), *projection, std::move(shown)};
        show(state, view_of(unreferred), topology, unreferred.pose);
        state.unreferred = std::move(unreferred);
        return {};
    }
    // What depends on bones or nodes is built when a frame asks for it, so that no frame has to do the work of two. Of
    // the nodes, a third of the work is done at once, which makes this frame and the next take about the same time,
    // unless the caller has time between them.
    ReferenceFacts facts{.number = packet.frame,
                         .step = step,
                         .captured = {payload.header.source_vertices, payload.header.source_triangles},
                         .textured = std::move(*textured),
                         .presence = std::move(presence),
                         .detail = std::move(detail),
                         .projection = *projection};
    auto reference = make_reference(header, std::move(facts), std::move(mesh), std::move(*pose),
                                    {.bones = false, .nodes = false}, state.threads);
    if (!reference) return tl::unexpected(reference.error());
    if (!state.prepares) derive_hierarchy(*reference, header);
    show(state, view_of(*reference), topology, std::move(shown));
    // Nothing can fail from here on.
    state.reference = std::move(*reference);
    state.reference_topology = topology;
    state.bones = {};
    state.nodes = {};
    state.unreferred.reset();
    return {};
}

bool show_unreferred_intra(DecoderState& state) {
    if (!state.unreferred) return false;
    show(state, view_of(*state.unreferred), state.unreferred->topology, state.unreferred->pose);
    return true;
}

}  // namespace htvm::internal
