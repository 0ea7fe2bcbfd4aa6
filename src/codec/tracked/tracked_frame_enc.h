// Tracked frames, encoding side: the reference is registered to the captured surface, which depends on no quantiser
// step and is done once for a frame; then its nodes' motion is quantised, and what remains along the normals and in the
// colours coded as fields.
#pragma once

#include <span>
#include <vector>

#include "codec/tracked/tracked_frame.h"
#include "core/thread.h"
#include "htvm/encoder.hpp"
#include "surface/tracked_registration.h"

namespace htvm::internal {

struct TrackedFrameOptions {
    double geometry_step = 32;  // lattice units: of the displacement along the normal
    double colour_step = 11;    // levels
    double lambda = 0.12;       // squared steps that a bit is worth
    double reach = 480;         // lattice units: how far from the moved reference the captured surface is looked for
    bool motion_alone = false;  // displacement and colours stay as predicted: the fewest bits that a frame can take
    Threads threads = {};
};

// The reference, ready to be registered; made once for an I-frame.
DeformableMesh make_tracked_deformable(const TrackedReference& reference, const DeformationOptions& options);

// Where a registration may start: each one motion per node, or empty. last, before_last: of the two frames before.
// skeletal: where the skeleton moves each node.
struct NodeStarts {
    std::span<const RigidMotion> last, before_last, skeletal;
};
// The motion of each node, reference -> frame, from the start whose surface lies nearest.
std::vector<RigidMotion> register_nodes(const DeformableMesh& deformable, const SurfaceIndex& surface,
                                        const NodeStarts& starts, const DeformationOptions& options);

struct EncodedTrackedFrame {
    FramePayload payload;  // header and layers
    LatticeMesh mesh;      // what the decoder will have
    TrackedState state;
};

// mesh: as captured; surface: of it, see captured_surface(). motion: of each node, as registered. before: of the frame
// that this one refers to; null where that is the I-frame.
Result<EncodedTrackedFrame> encode_tracked_frame(const LatticeMesh& mesh, const SurfaceIndex& surface,
                                                 const TrackedReference& reference, std::span<const RigidMotion> motion,
                                                 const TrackedState* before, const TrackedFrameOptions& options,
                                                 std::vector<StageTime>& stages);

}  // namespace htvm::internal
