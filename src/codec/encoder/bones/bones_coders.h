// The coder of each kind of frame of the bones strategy: turns the work of a frame into a frame of that kind. All but
// the I-frame need a reference that has a vertex and the same attributes as the frame.
#pragma once

#include <optional>
#include <vector>

#include "codec/encoder/bones/bones_work.h"

namespace htvm::internal {

Result<BonesIntra> code_intra(const BonesWork& work, const FrameSteps& steps, FrameReason reason);
// An I-frame that nothing refers to: it is quantised exactly with the steps asked for.
Result<BonesIntra> code_unreferred_intra(const BonesWork& work, const FrameSteps& steps, FrameReason reason);

BonesMoved code_predicted(const BonesWork& work);

// The first half of coding a whole EP-frame. motion: of its bones. before: the codebooks that the frame before leaves.
QuantisedWhole quantise_whole(const Configuration& configuration, const BonesReference& reference,
                              const LatticeMesh& mesh, const FrameMotion& motion, const Codebooks& before,
                              const FrameSteps& steps, std::vector<StageTime>& stages);
QuantisedWhole quantise_whole(const BonesWork& work, const FrameSteps& steps);
// A whole EP-frame. quantised: its first half, if that is done; it serves where it is of these steps.
BonesMoved code_enhanced(const BonesWork& work, const FrameSteps& steps, std::optional<QuantisedWhole> quantised);

// Motion-based coding: an EP-frame in which some bones are coded and the seams zippered, a P-frame if none is coded, a
// whole EP-frame if nothing would be left to animate. coded: one per bone.
BonesMoved code_coded_bones(const BonesWork& work, const FrameSteps& steps, const std::vector<bool>& coded,
                            std::optional<QuantisedWhole> quantised);

}  // namespace htvm::internal
