#include "codec/reference/reference.h"

#include <utility>

namespace htvm::internal {

Result<Reference> make_reference(const SequenceHeader& header, std::uint32_t number, LatticeMesh mesh, CodedPose pose,
                                 std::int32_t step, Derived derived, Threads threads) {
    Reference out;
    out.number = number;
    out.step = step;
    if (derived.nodes && header.node_spacing > 0) {
        auto tracked = make_tracked_reference(mesh, header.node_spacing, step);
        if (!tracked) return tl::unexpected(tracked.error());
        out.tracked = std::move(*tracked);
    }
    out.skinned.mesh = std::move(mesh);
    out.skinned.joints = std::move(pose.joints);
    out.skinned.orientations = std::move(pose.orientations);
    out.skinned.frame = number;
    if (derived.bones) skin_reference(out.skinned, header.skeleton.bones, header.radii, header.weight_width, threads);
    return out;
}

}  // namespace htvm::internal
