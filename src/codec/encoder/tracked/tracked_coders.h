// The coder of each kind of frame of the tracked strategy: turns the work of a frame into a frame of that kind.
#pragma once

#include <optional>
#include <span>

#include "codec/encoder/tracked/tracked_work.h"
#include "codec/tracked/surface_patch.h"

namespace htvm::internal {

// How T-frames are coded at these steps.
TrackedFrameOptions tracked_frame_options(const Configuration& configuration, const FrameSteps& steps);

// How far an I-frame that T-frames refer to, or a patch, may be simplified.
SimplifiedReferenceOptions simplification_options(const Configuration& configuration, const FrameSteps& steps);

// An I-frame of the capture, simplified, for T-frames to refer to; or one that nothing refers to, which is quantised
// with exactly the steps asked for.
Result<TrackedIntra> code_intra(const TrackedWork& work, const FrameSteps& steps, FrameReason reason);
Result<TrackedIntra> code_unreferred_intra(const TrackedWork& work, const FrameSteps& steps, FrameReason reason);
// An I-frame of the tracked mesh instead of the capture: who starts here, or has lost something, gets what the others
// see, and these see no change. What was not seen for long is left out. tracked: the T-frame.
Result<TrackedIntra> code_renewal(const TrackedWork& work, const FrameSteps& steps, const EncodedTrackedFrame& tracked,
                                  FrameReason reason);

// A T-frame before it is chosen.
struct CodedMotion {
    EncodedTrackedFrame encoded;
    Packet packet;
    FrameSteps steps;
    bool of_reference = false;  // whether it refers to the reference alone, not to the frame before
    std::size_t bytes() const { return packet.payload.size() + packet_overhead; }
};
// What of a T-frame is sent: all, or the motion of the nodes without displacement and colours.
enum class MotionParts : std::uint8_t { all, motion_alone };
Result<CodedMotion> code_motion(const TrackedWork& work, const NodeRegistration& registered, const FrameSteps& steps,
                                MotionParts parts);
// The T-frame as it is sent. best_fit: what it leaves as such.
TrackedMotion chosen_motion(const TrackedWork& work, const NodeRegistration& registered, CodedMotion coded,
                            LatticeUnits best_fit);

// A T-frame of the reference alone, on which patches are planned: whoever joins later needs the references alone.
// near: of a T-frame that was tried.
Result<EncodedTrackedFrame> code_for_patches(const TrackedWork& work, const NodeRegistration& registered,
                                             const FrameSteps& steps, std::span<const std::uint32_t> near);
// That T-frame with a patch: see surface_patch.h. Nothing where the texture's picture has no room for the patch's
// charts.
Result<std::optional<TrackedPatch>> code_patch(const TrackedWork& work, const NodeRegistration& registered,
                                               const FrameSteps& steps, const EncodedTrackedFrame& tracked,
                                               const SurfacePatch& patch, FrameReason reason);

}  // namespace htvm::internal
