// The coder of each kind of frame: turns the work of a frame into a candidate of that kind.
#pragma once

#include <optional>
#include <vector>

#include "codec/encoder/frame_work.h"
#include "codec/tracked/surface_patch.h"

namespace htvm::internal {

// A whole frame of this kind, to which later frames may refer as far as the kind allows: the coder column of the table
// of frame kinds (frame_kinds.h), but for TP-frames. All but the I-frame need a reference that has a vertex and the
// same attributes as the frame.
Result<Candidate> code_frame(FrameType type, FrameWork& work, const FrameSteps& steps);

// The first half of coding a whole EP-frame. The second takes it from FrameWork::quantised where that is of its steps.
// motion: of its bones. before: the codebooks that the frame before leaves.
QuantisedWork quantise_whole(const Configuration& configuration, const ReferenceInUse& reference,
                             const LatticeMesh& mesh, const FrameMotion& motion, const Codebooks& before,
                             const FrameSteps& steps, std::vector<StageTime>& stages);
QuantisedWork quantise_whole(FrameWork& work, const FrameSteps& steps);

// How T-frames are coded at these steps.
TrackedFrameOptions tracked_frame_options(const Configuration& configuration, const FrameSteps& steps);

// How far an I-frame that T-frames refer to, or a patch, may be simplified.
SimplifiedReferenceOptions simplification_options(const Configuration& configuration, const FrameSteps& steps);

// Variants that the choice of frames tries.
// An I-frame that nothing refers to: it is quantised exactly with the steps asked for.
Result<Candidate> code_lone_intra(FrameWork& work, const FrameSteps& steps);
// An I-frame of the tracked mesh instead of the capture: who starts here, or has lost something, gets what the others
// see, and these see no change. tracked: the T-frame's mesh.
Result<Candidate> code_renewed_intra(FrameWork& work, const FrameSteps& steps, const LatticeMesh& tracked);
// Motion-based coding: an EP-frame in which some bones are coded and the seams zippered, a P-frame if none is coded, a
// whole EP-frame if nothing would be left to animate. coded: one per bone.
Result<Candidate> code_coded_bones(FrameWork& work, const FrameSteps& steps, const std::vector<bool>& coded);
// A T-frame of the reference alone, on which patches are planned: whoever joins later needs the references alone.
// near: of the T-frame that was tried, Candidate::near.
Result<EncodedTrackedFrame> code_for_patches(FrameWork& work, const FrameSteps& steps,
                                             std::span<const std::uint32_t> near);
// This T-frame with a patch: see surface_patch.h. Nothing where the texture's picture has no room for the patch's
// charts.
Result<std::optional<Candidate>> code_patched(FrameWork& work, const FrameSteps& steps,
                                              const EncodedTrackedFrame& tracked, const SurfacePatch& patch);
// A T-frame that has the motion of the nodes, but neither displacement nor colours.
Result<Candidate> code_motion_alone(FrameWork& work, const FrameSteps& steps);

}  // namespace htvm::internal
