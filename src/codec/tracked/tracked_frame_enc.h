// Tracked frames, encoding side: the group's reference is registered to the captured surface, its nodes' motion
// quantised, and what remains along the normals and in the colours coded as fields.
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
    DeformationOptions deformation;
    Threads threads = {};
};

// What the encoder needs of a group besides what the decoder has.
struct TrackedGroup {
    TrackedReference reference;
    DeformableMesh deformable;
    // Of each node, in the last frame and the one before that, as registered; empty where there is none.
    std::vector<RigidMotion> last, before_last;
    TrackedState state;  // of the last frame, empty behind the I-frame
};
TrackedGroup make_tracked_group(TrackedReference reference, const DeformationOptions& options);

// The captured mesh, ready to be registered to.
TargetSurface captured_surface(const LatticeMesh& mesh, const DeformationOptions& options);

struct EncodedTrackedFrame {
    FramePayload payload;  // header and layers
    LatticeMesh mesh;      // what the decoder will have
    TrackedState state;
    std::vector<RigidMotion> motion;  // of each node, as registered
};

// refer_to_last: predict from the frame before (group.state must be of it), else from the I-frame alone.
// skeletal: where the skeleton moves each node, or empty: one of the starts that the registration chooses from.
// surface: of `mesh`, see captured_surface().
Result<EncodedTrackedFrame> encode_tracked_frame(const LatticeMesh& mesh, const TargetSurface& surface,
                                                 const TrackedGroup& group, bool refer_to_last,
                                                 std::span<const RigidMotion> skeletal,
                                                 const TrackedFrameOptions& options, std::vector<StageTime>& stages);

}  // namespace htvm::internal
