// Decodes EP- and P-frames: the I-frame's mesh, moved by its bones and corrected.
#include "codec/bones/animated_frame.h"
#include "codec/bones/enhanced_frame.h"
#include "codec/decoder/frame_decoders.h"
#include "codec/format/frame_kinds.h"

namespace htvm::internal {
namespace {

// Builds what is derived from the bones when the first frame asks for it.
const ReferenceMesh& skinned(DecoderState& state) {
    derive_bones(*state.reference, *state.header, state.threads);
    return state.reference->skinned;
}

// The I-frame's joints, each moved by the first bone it belongs to.
Pose moved_pose(const DecoderState& state, std::span<const QuantisedTransform> transforms) {
    const auto& reference = state.reference->skinned;
    const auto& bones = state.header->skeleton.bones;
    Pose pose;
    std::vector<LatticePoint> joints = reference.joints;
    std::vector<bool> moved(joints.size(), false);
    for (std::size_t i = 0; i < bones.size(); ++i) {
        const auto matrix = rotation_matrix(transforms[i].rotation);
        for (const auto joint : {bones[i].first, bones[i].second}) {
            if (moved[joint]) continue;
            joints[joint] = move(reference.joints[joint], matrix, reference.pivots[i], transforms[i].shift);
            moved[joint] = true;
        }
        pose.orientations.push_back(
            product(to_rotation(matrix), to_rotation(rotation_matrix(reference.orientations[i]))));
    }
    for (const auto joint : joints) pose.joints.push_back(to_millimetres(joint, state.header->lattice));
    return pose;
}

const FilmProjection* projection_of(const DecoderState& state) {
    return state.reference->projection ? &*state.reference->projection : nullptr;
}

// Connectivity, colours and texture coordinates are those of the I-frame, and so are what is there, the detail and the
// camera's place.
void show_animated(DecoderState& state, const AnimatedFrame& frame) {
    const auto& mesh = state.reference->mesh();
    const auto& presence = state.reference->presence;
    show(state,
         {frame.positions, mesh.triangles, mesh.colours, frame.normals, mesh.texcoords, &state.reference->textured,
          presence, &state.reference->detail, projection_of(state)},
         state.reference_topology, moved_pose(state, frame.transforms));
}

const Codebook* named(const std::optional<NumberedCodebook>& codebook, std::uint32_t number) {
    return codebook && codebook->number == number ? &codebook->codebook : nullptr;
}

}  // namespace

Result<void> decode_enhanced(DecoderState& state, const Packet& packet, const FramePayloadView& payload) {
    const auto& reference = skinned(state);
    auto& history = state.bones;
    const EnhancedFrameContext context{reference, named(history.geometry_codebook, payload.header.geometry_codebook),
                                       named(history.colour_codebook, payload.header.colour_codebook),
                                       state.header->nearest_vertices, state.threads};
    auto decoded = decode_enhanced_frame(payload, context);
    if (!decoded) {
        // The transforms alone may still help to conceal the frame.
        if (auto moved = decode_transforms(payload.of(Layer::transforms), reference.pivots.size()))
            history.transforms = std::move(*moved);
        return tl::unexpected(decoded.error());
    }
    history.transforms = std::move(decoded->transforms);
    // Headers of zippered frames count only what the frame codes.
    if (decoded->mesh.positions.size() > state.options.max_vertices ||
        decoded->mesh.triangles.size() > state.options.max_triangles)
        return fail(ErrorKind::limit, "frame " + std::to_string(packet.frame) +
                                          " has more vertices or triangles than this decoder accepts; raise its "
                                          "max_vertices or max_triangles");
    auto shown = view_of(decoded->mesh);
    shown.projection = projection_of(state);
    show(state, shown, new_topology(state), moved_pose(state, history.transforms));
    state.shown.own = std::move(decoded->mesh);
    return {};
}

Result<void> decode_predicted(DecoderState& state, const Packet&, const FramePayloadView& payload) {
    auto decoded = decode_predicted_frame(payload, skinned(state), state.threads);
    if (!decoded) return tl::unexpected(decoded.error());
    show_animated(state, *decoded);
    state.bones.transforms = std::move(decoded->transforms);
    return {};
}

bool show_moved_by_bones(DecoderState& state) {
    if (!state.reference) return false;
    const auto& reference = skinned(state);
    auto transforms = state.bones.transforms;
    transforms.resize(reference.pivots.size());  // no frame since the I-frame: leave the bones where they were
    show_animated(state, animated_frame(reference, std::move(transforms), state.threads));
    return true;
}

}  // namespace htvm::internal
