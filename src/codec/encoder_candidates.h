// The ways to code a frame: by itself, moved, moved and corrected, or corrected where it moves.
#pragma once

#include "codec/encoder_state.h"
#include "codec/moving_part_enc.h"

namespace htvm {

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
const FrameMotion& motion_of(Encoder::State& state, FrameUnderWay& frame);
const AnimationFit& fit_of(Encoder::State& state, FrameUnderWay& frame);

Result<FrameCandidate> encode_intra(Encoder::State& state, FrameUnderWay& frame, const FrameSteps& steps);
FrameCandidate encode_predicted(Encoder::State& state, FrameUnderWay& frame);
FrameCandidate encode_enhanced(Encoder::State& state, FrameUnderWay& frame, const FrameSteps& steps);
// Motion-based: coded_bones has one entry a bone, at least one true whose sub-mesh in the reference has a vertex.
FrameCandidate encode_moving(Encoder::State& state, FrameUnderWay& frame, const FrameSteps& steps,
                             const std::vector<bool>& coded_bones);

// Motion-based coding where some bones are coded and some not; else an EP-frame of all, or a P-frame.
FrameCandidate encode_coded_bones(Encoder::State& state, FrameUnderWay& frame, const FrameSteps& steps,
                                  const std::vector<bool>& coded);

// How well a decoded mesh stands for the frame. edge: mean edge of the I-frame's captured mesh, lattice units.
// intra_squared: see measure_tracked_fit().
TrackedFit tracked_fit(Encoder::State& state, FrameUnderWay& frame, const LatticeMesh& decoded, double edge,
                       std::span<const double> intra_squared);

// Needs options.tracked.
Result<FrameCandidate> encode_tracked(Encoder::State& state, FrameUnderWay& frame, const FrameSteps& steps);

// The state after the frame: a new reference after an I-frame, the motion and codebooks after the others.
void adopt(Encoder::State& state, const FrameCandidate& candidate);

}  // namespace htvm
