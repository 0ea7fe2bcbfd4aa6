// What the encoder's stages hand to each other. Configuration and reference never change once made; the history of each
// kind of frame is a value; the work of a frame is found once, whatever rate or error control tries; coding a candidate
// takes all of these as constants and gives a value. The sequence goes on with the candidate that is sent (advance()).
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "codec/paper/enhanced_frame_enc.h"
#include "codec/paper/moving_part_enc.h"
#include "codec/reference/reference.h"
#include "codec/stage_clock_enc.h"
#include "codec/stream/sequence.h"
#include "codec/tracked/captured_surface_enc.h"
#include "codec/tracked/tracked_frame_enc.h"
#include "core/thread.h"
#include "htvm/encoder.hpp"
#include "surface/surface_distance.h"

namespace htvm::internal {

// Settled with the first frame.
struct Configuration {
    EncoderOptions options;
    SequenceHeader header;
    Threads threads = {};
    double units = 16;             // lattice units per millimetre
    double adult_millimetre = 16;  // lattice units: what a millimetre on an adult is on this subject
    bool intra_alone = false;      // nothing refers to anything
    bool tracked() const { return options.profile == Profile::tracked; }
    double to_millimetres(double lattice_units) const { return lattice_units / units; }
};

// How coarsely a frame is quantised, as asked for.
struct FrameSteps {
    std::int32_t geometry = 32;  // lattice units
    std::int32_t colour = 6;     // levels
};

// What the encoder knows of an I-frame besides what the decoder does.
struct IntraFacts {
    std::int32_t step = 1;  // of its positions, lattice units
    FrameSteps steps;       // as asked for
    double edge = 0;        // mean edge of the captured mesh, lattice units
    TrackedFit fit;         // of the I-frame itself, where T-frames refer to it
    SurfaceErrors plain;    // choice by rate and distortion: of an I-frame at `steps` that nothing refers to
};

// The reference in force, and what the encoder derives from it.
struct ReferenceInUse {
    Reference decoded;
    IntraFacts intra;
    double bytes = 0;           // what the I-frame took
    ReferenceSearch search;     // of the bones' sub-meshes, where frames refer to bones
    DeformableMesh deformable;  // where they refer to nodes
};

// What the EP- and P-frames since the I-frame leave for the next.
struct BoneHistory {
    std::vector<RigidMotion> motion;  // of each bone in the frame before; empty behind the I-frame
    Codebooks codebooks;
    double least_bytes = 0;   // of the cheapest whole EP-frame; 0: none yet
    double excess_bytes = 0;  // what the others cost above it
    double plain_intra_bytes =
        0;  // choice of the cheaper: of an I-frame that nothing refers to, per vertex; 0: unknown
};

// What the T-frames since the I-frame leave for the next.
struct NodeHistory {
    std::optional<std::uint32_t> frame;          // number of the last one
    std::vector<RigidMotion> last, before_last;  // of each node, as registered; empty where there is none
    TrackedState state;                          // of the last one
    double best_fit = 0;                         // root mean square, of the best so far; 0: none yet
};

// Where EP-frames are tried against I-frames: when next, and how often in a row they lost.
struct EnhancedTrial {
    std::uint32_t next = 0;  // number of the first frame that may be one
    int losses = 0;
};

// A frame coded in one way.
struct Candidate {
    FrameType type = FrameType::intra;
    std::vector<Packet> packets;  // new codebooks first, the frame last; numbered when they are sent
    std::uint32_t reference = 0;  // number of the frame that it refers to; an I-frame's own
    LatticeMesh decoded;          // what the decoder will have
    double quality = 50;          // under rate or error control: of the quality knob
    bool stands_in = false;       // P or T of motion alone, where nothing better fits the buffer
    // What it leaves for the sequence: one of the first three.
    std::optional<IntraFacts> intra;                   // I
    std::optional<BoneHistory> bones;                  // P, EP
    std::optional<NodeHistory> nodes;                  // T
    std::optional<EnhancedTrial> trial;                // where EP- and I-frame were compared
    CodedPose pose;                                    // I
    std::vector<std::uint32_t> distance_order_counts;  // EP
    std::size_t bytes() const;
};

// Where the sequence stands between two frames.
struct Sequence {
    std::uint32_t next_frame = 0;
    std::shared_ptr<const ReferenceInUse> reference;  // none before the first I-frame
    BoneHistory bones;
    NodeHistory nodes;
    EnhancedTrial trial;
};

// The sequence behind a candidate that is sent, which loses what the sequence takes over. Errors: as of
// make_reference().
Result<Sequence> advance(const Configuration& configuration, const Sequence& before, Candidate& sent);

// What is found of one frame, each when first asked for, and kept. Lengths in lattice units.
class FrameWork {
public:
    FrameWork(const Configuration& settled, const Sequence& before, LatticeMesh captured, CodedPose captured_pose,
              std::vector<StageTime>& times)
        : configuration(settled),
          sequence(before),
          mesh(std::move(captured)),
          pose(std::move(captured_pose)),
          stages(times) {}

    const Configuration& configuration;
    const Sequence& sequence;
    const LatticeMesh mesh;  // as captured
    const CodedPose pose;
    std::vector<StageTime>& stages;

    // The reference in force; there must be one.
    const ReferenceInUse& reference() const { return *sequence.reference; }
    std::int64_t frames_since_intra() const { return std::int64_t{sequence.next_frame} - reference().decoded.number; }
    double edge();                 // mean edge of the captured mesh
    const SurfaceIndex& target();  // the captured surface, to be registered to
    // Of each bone, and each node, against the reference.
    const FrameMotion& bone_motion();
    const std::vector<RigidMotion>& node_motion();
    const AnimationFit& animation_fit();  // how well the bones' motion alone stands for the frame
    // How far a decoded mesh is from the captured one, both ways.
    SurfaceErrors errors_of(const LatticeMesh& decoded);
    // Whether a tracked mesh still stands for the captured one. intra_squared: see measure_tracked_fit().
    TrackedFit tracked_fit(const LatticeMesh& decoded, double reference_edge, std::span<const double> intra_squared);

private:
    struct CapturedSurface {
        std::vector<Point3f> points;
        SurfaceIndex search;
    };
    std::optional<double> edge_;
    std::optional<SurfaceIndex> target_;
    std::optional<FrameMotion> bone_motion_;
    std::optional<std::vector<RigidMotion>> node_motion_;
    std::optional<AnimationFit> animation_fit_;
    std::optional<CapturedSurface> captured_;
};

// The registration's options on this subject.
DeformationOptions deformation_options(const Configuration& configuration);

}  // namespace htvm::internal
