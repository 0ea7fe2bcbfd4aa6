// The ways to code a frame: by itself, moved, moved and corrected, or corrected where it moves.
#pragma once

#include "codec/encoder_state.h"
#include "codec/paper/moving_part_enc.h"

namespace htvm::internal {

// The captured surface, ready for measuring decoded ones against it.
struct CapturedSurface {
    std::vector<Point3f> points;
    SurfaceSearch search;
};

// A frame on its way through the encoder; what several candidates need is found once.
struct FrameUnderWay {
    const LatticeMesh& mesh;
    const CodedPose& pose;
    std::optional<FrameMotion> motion;
    std::optional<AnimationFit> fit;
    std::optional<CapturedSurface> surface;
    std::optional<TargetSurface> target;  // likewise, for tracking
};

// Needs state.group, and the attributes of its reference.
const FrameMotion& motion_of(EncoderState& state, FrameUnderWay& frame);
const AnimationFit& fit_of(EncoderState& state, FrameUnderWay& frame);

Result<FrameCandidate> encode_intra(EncoderState& state, FrameUnderWay& frame, const FrameSteps& steps);
FrameCandidate encode_predicted(EncoderState& state, FrameUnderWay& frame);
FrameCandidate encode_enhanced(EncoderState& state, FrameUnderWay& frame, const FrameSteps& steps);
// Motion-based: coded_bones has one entry a bone, at least one true whose sub-mesh in the reference has a vertex.
FrameCandidate encode_moving(EncoderState& state, FrameUnderWay& frame, const FrameSteps& steps,
                             const std::vector<bool>& coded_bones);

// Motion-based coding where some bones are coded and some not; else an EP-frame of all, or a P-frame.
FrameCandidate encode_coded_bones(EncoderState& state, FrameUnderWay& frame, const FrameSteps& steps,
                                  const std::vector<bool>& coded);

// How well a decoded mesh stands for the frame. edge: mean edge of the I-frame's captured mesh, lattice units.
// intra_squared: see measure_tracked_fit().
TrackedFit tracked_fit(EncoderState& state, FrameUnderWay& frame, const LatticeMesh& decoded, double edge,
                       std::span<const double> intra_squared);

// Needs options.tracked.
Result<FrameCandidate> encode_tracked(EncoderState& state, FrameUnderWay& frame, const FrameSteps& steps);

// The state after the frame: a new reference after an I-frame, the motion and codebooks after the others.
void adopt(EncoderState& state, const FrameCandidate& candidate);

}  // namespace htvm::internal
