// The bones strategy's values: what its frames refer to, what is found of a frame, and what coding it in one way gives.
// Frames are I, EP, EP in part, or P, as published: docs/published_method.md. Lengths are in lattice units.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "codec/encoder/bones/enhanced_frame.h"
#include "codec/encoder/bones/motion.h"
#include "codec/encoder/bones/moving_part.h"
#include "codec/encoder/coded_frame.h"
#include "codec/reference/reference.h"
#include "core/on_demand.h"

namespace htvm::internal {

// The current reference, an I-frame, and what the encoder knows of it or derives from it.
struct BonesReference {
    Reference decoded;
    FrameSteps steps;        // asked for
    double edge = 0;         // mean edge of the captured mesh
    double bytes = 0;        // size of the frame
    SurfaceErrors plain;     // for choice by rate and distortion: the errors of an I-frame at `steps` that nothing
                             // refers to
    ReferenceSearch search;  // over the bones' sub-meshes
};

// What the EP- and P-frames since the I-frame leave for the next one.
struct BonesHistory {
    std::vector<RigidMotion> motion;  // of each bone in the previous frame; empty after the I-frame
    Codebooks codebooks;
    double least_bytes = 0;        // size of the cheapest whole EP-frame; 0: none yet
    double excess_bytes = 0;       // how much more the others took, in total
    double plain_intra_bytes = 0;  // bytes per vertex of an I-frame that nothing refers to; 0: unknown
};

// Trials of EP-frames against I-frames: when the next is due, and how often in a row EP-frames lost.
struct EnhancedTrial {
    std::uint32_t next = 0;  // number of the first frame that may be a trial
    int losses = 0;
};

// The strategy's state between two frames.
struct BonesSequence {
    std::uint32_t next_frame = 0;
    std::shared_ptr<const BonesReference> reference;  // null before the first I-frame
    BonesHistory history;
    EnhancedTrial trial;
};

// A whole frame's vertices as an EP-frame at these steps.
struct QuantisedWhole {
    FrameSteps steps;
    QuantisedFrame frame;
};

// What was found of a frame that waits, while others were coded.
struct BonesAhead {
    std::optional<FrameMotion> motion;        // as if the frame before had been an EP- or P-frame
    std::optional<QuantisedWhole> quantised;  // as if it had been an EP-frame
};

// What attempts at coding a frame leave for each other.
struct BonesProgress {
    std::optional<QuantisedWhole>
        quantised;  // as an EP-frame; the first attempt that codes one at these steps uses it up
};

// An EP- or P-frame.
struct BonesMoved {
    CodedFrame frame;
    BonesHistory history;                              // that it leaves
    std::optional<EnhancedTrial> trial;                // set if EP- and I-frame were compared
    std::vector<std::uint32_t> distance_order_counts;  // EP
};
// An I-frame. It becomes the reference if it is referred to.
struct BonesIntra {
    CodedFrame frame;
    FrameSteps steps;       // asked for
    double edge = 0;        // BonesReference::edge
    SurfaceErrors plain;    // BonesReference::plain
    std::int32_t step = 1;  // Reference::step
    CodedPose pose;
    std::optional<EnhancedTrial> trial;
};

// The frame that is coded, and what is found of it: once, when it is asked for. Attempts share it and leave it as it
// is.
struct BonesWork {
    using Progress = BonesProgress;
    using Frame = std::variant<BonesIntra, BonesMoved>;

    BonesWork(const Configuration& configuration, const BonesSequence& sequence, CapturedFrame captured,
              std::optional<FrameMotion> motion, std::vector<StageTime>& stages);
    BonesWork(const BonesWork&) = delete;
    BonesWork& operator=(const BonesWork&) = delete;

    const Configuration& configuration;
    const BonesSequence& sequence;
    std::vector<StageTime>& stages;  // where times are added
    const CapturedFrame captured;
    const OnDemand<FrameMotion> motion;      // of the bones, relative to the reference
    const OnDemand<AnimationFit> animation;  // how well that alone represents the frame
    const OnDemand<SurfaceIndex> surface;    // the captured surface

    const LatticeMesh& mesh() const { return captured.mesh; }
    const BonesReference& reference() const { return *sequence.reference; }  // there must be one
};

// Whether later frames may refer to a frame of this mesh. If not, it leaves the reference as it was.
bool may_be_referred_to(const LatticeMesh& captured);
// Whether the bones of the reference can move it to this captured frame, by what both have.
bool can_be_moved(const BonesSequence& sequence, const LatticeMesh& captured);
inline bool can_be_moved(const BonesWork& work) { return can_be_moved(work.sequence, work.mesh()); }
// Whether it must be an I-frame: it is asked for, there is nothing to refer to, or the longest key interval has passed.
bool intra_is_due(const BonesWork& work);
// Whether the shortest key interval has passed: an I-frame is allowed if it saves bits.
bool may_be_intra(const BonesWork& work);

inline CodedFrame& coded_frame(BonesWork::Frame& frame) {
    return std::visit([](auto& of_kind) -> CodedFrame& { return of_kind.frame; }, frame);
}

// before: the motion of the bones in the frame before; empty after an I-frame.
FrameMotion motion_of_bones(const Configuration& configuration, const BonesReference& reference,
                            const CapturedFrame& captured, std::span<const RigidMotion> before,
                            std::vector<StageTime>& stages);

}  // namespace htvm::internal
