// Decoding of I-frames: a mesh by itself, which later frames refer to.
#include "codec/decoder_state.h"
#include "codec/frame_kinds.h"
#include "codec/intra/intra_frame.h"

namespace htvm::internal {

Result<void> decode_intra(DecoderState& state, const Packet& packet, const FramePayloadView& payload) {
    const auto& header = *state.header;
    auto pose = decode_pose(payload.of(Layer::pose), header.skeleton.joint_names.size(), header.skeleton.bones.size());
    if (!pose) return tl::unexpected(pose.error());
    // What follows from the nodes takes much memory, and can be had again from the mesh: should this frame prove bad,
    // the next T-frame has it made. Else streams of many I-frames would take half as much again as those of one.
    if (state.reference) state.reference->tracked.reset();
    const auto& external = state.options.intra_coder;
    auto mesh = decode_intra_frame(payload, external ? &*external : nullptr);
    if (!mesh) return tl::unexpected(mesh.error());
    Pose shown;
    for (const auto joint : pose->joints) shown.joints.push_back(to_millimetres(joint, header.lattice));
    for (const auto& rotation : pose->orientations)
        shown.orientations.push_back(to_rotation(rotation_matrix(rotation)));
    // T-frames will want the nodes at once; who wants the bones asks for them.
    auto reference = make_reference(header, packet.frame, std::move(*mesh), std::move(*pose),
                                    static_cast<std::int32_t>(payload.header.geometry_step),
                                    {.bones = false, .nodes = true}, state.threads);
    if (!reference) return tl::unexpected(reference.error());
    const auto topology = new_topology(state);
    show(state, view_of(reference->mesh()), topology, std::move(shown));
    // From here on nothing can fail.
    state.reference = std::move(*reference);
    state.reference_topology = topology;
    state.bones = {};
    state.tracked = {};
    return {};
}

}  // namespace htvm::internal
