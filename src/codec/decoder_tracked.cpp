// Decodes T-frames: the I-frame's mesh, moved by the nodes of a deformation graph and displaced.
#include "codec/decoder_state.h"
#include "codec/frame_kinds.h"

namespace htvm::internal {
namespace {

// The I-frame's joints, each moved like the node nearest to it.
Pose tracked_pose(const DecoderState& state, std::span<const QuantisedTransform> transforms) {
    const auto& reference = state.reference->skinned;
    const auto& pivots = state.reference->tracked->graph.pivots;
    const auto& bones = state.header->skeleton.bones;
    std::vector<std::size_t> node_of_joint;
    Pose pose;
    for (const auto joint : reference.joints) {
        std::size_t nearest = 0;
        for (std::size_t i = 1; i < pivots.size(); ++i)
            if (squared_distance(joint, pivots[i]) < squared_distance(joint, pivots[nearest])) nearest = i;
        node_of_joint.push_back(nearest);
        const auto moved = pivots.empty() ? joint
                                          : move(joint, rotation_matrix(transforms[nearest].rotation), pivots[nearest],
                                                 transforms[nearest].shift);
        pose.joints.push_back(to_millimetres(moved, state.header->lattice));
    }
    for (std::size_t i = 0; i < bones.size(); ++i) {
        const auto rest = to_rotation(rotation_matrix(reference.orientations[i]));
        const auto node = node_of_joint[bones[i].first];
        pose.orientations.push_back(
            pivots.empty() ? rest : product(to_rotation(rotation_matrix(transforms[node].rotation)), rest));
    }
    return pose;
}

void show_tracked(DecoderState& state, const DecodedTrackedFrame& frame, Pose pose) {
    const auto& mesh = state.reference->mesh();
    show(state, {frame.positions, mesh.triangles, frame.colours, frame.normals, mesh.texcoords},
         state.reference_topology, std::move(pose));
}

}  // namespace

Result<void> decode_tracked(DecoderState& state, const Packet& packet, const FramePayloadView& payload) {
    if (state.header->node_spacing == 0)
        return fail(ErrorKind::corrupt_stream, "a tracked frame in a stream whose header says that it has none");
    auto& history = state.tracked;
    const bool of_frame_before = history.frame && *history.frame == packet.reference;
    if (!of_frame_before)
        if (auto ok = check_reference(state, packet); !ok) return tl::unexpected(ok.error());
    if (auto ok = derive_nodes(*state.reference, *state.header, state.threads); !ok) return tl::unexpected(ok.error());
    using enum DecodedNodes::Newest;
    if (history.newest == next) history.newest = history.frame ? last : none;  // its arrays are written over
    const auto& reference = *state.reference->tracked;
    const auto* before = of_frame_before ? &history.last.state : nullptr;
    if (auto ok = state.header->version >= tracked_run_version
                      ? decode_tracked_frame(packet.payload, reference, before, state.threads, history.next)
                      : decode_tracked_layers(payload, reference, before, state.threads, history.next);
        !ok)
        return tl::unexpected(ok.error());
    auto pose = tracked_pose(state, history.next.state.transforms);
    show_tracked(state, history.next, pose);
    history.pose = std::move(pose);
    history.newest = next;
    if (!is_referred(packet, rules_of(FrameType::tracked))) return {};
    std::swap(history.last, history.next);
    history.newest = last;
    history.frame = packet.frame;
    return {};
}

bool show_last_tracked(DecoderState& state) {
    const auto& history = state.tracked;
    using enum DecodedNodes::Newest;
    if (history.newest == none) return false;
    show_tracked(state, history.of_newest(), history.pose);
    return true;
}

}  // namespace htvm::internal
