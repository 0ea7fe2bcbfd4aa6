// What the encoder's stages hand to each other. Configuration and reference never change once made. The history of each
// kind of frame is a value. The work of a frame is found once, however often rate or error control tries. Coding a
// candidate takes all of these as constants and returns a value. The sequence goes on with the candidate that is sent
// (advance()).
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "codec/encoder/bones/enhanced_frame.h"
#include "codec/encoder/bones/moving_part.h"
#include "codec/encoder/stage_clock.h"
#include "codec/encoder/tracked/captured_surface.h"
#include "codec/encoder/tracked/tracked_frame.h"
#include "codec/encoder/tracked/tracking_effort.h"
#include "codec/format/sequence.h"
#include "codec/reference/reference.h"
#include "core/thread.h"
#include "htvm/encoder.hpp"
#include "surface/surface_distance.h"

namespace htvm::internal {

// Fixed with the first frame.
struct Configuration {
    EncoderOptions options;
    SequenceHeader header;
    Threads threads = {};
    double units = 16;             // lattice units per millimetre
    double adult_millimetre = 16;  // the length on this subject that corresponds to a millimetre on an adult, in
                                   // lattice units
    bool tracked() const { return options.profile == Profile::tracked; }
    bool intra_alone() const { return options.key_interval == 1; }  // nothing refers to anything
    double to_millimetres(double lattice_units) const { return lattice_units / units; }
};

// How coarsely a frame is quantised, as asked for.
struct FrameSteps {
    std::int32_t geometry = 32;  // lattice units
    std::int32_t colour = 6;     // levels
    bool operator==(const FrameSteps&) const = default;
};

// What the encoder knows about an I-frame and the decoder does not.
struct IntraFacts {
    std::int32_t step = 1;     // of the reference that it becomes: Reference::step
    FrameSteps steps;          // the steps asked for
    double edge = 0;           // mean edge of the captured mesh, in lattice units
    std::size_t vertices = 0;  // of the last I-frame that was made of the capture; later ones may be the tracked mesh
    std::uint32_t chart_scale = 0;  // ChartLayout::scale, if the stream has charts
    std::vector<Colour> colours;    // of the reference's vertices, for tracking alone: where frames have none; or none
    TrackedFit fit;                 // of the I-frame itself, if T-frames refer to it
    SurfaceErrors plain;  // for choice by rate and distortion: the errors of an I-frame at `steps` that nothing
                          // refers to
};

// The current reference, and what the encoder derives from it.
struct ReferenceInUse {
    Reference decoded;
    IntraFacts intra;               // of the I-frame, patched since or not
    std::uint32_t intra_frame = 0;  // number of the I-frame; patched since, the reference has another
    double bytes = 0;               // size of the I-frame
    int patches = 0;                // how many TP-frames led from the I-frame to this reference
    double patch_bytes = 0;         // their size
    ReferenceSearch search;         // over the bones' sub-meshes, if frames refer to bones
    DeformableMesh deformable;      // if frames refer to nodes
};

// What the EP- and P-frames since the I-frame leave for the next one.
struct BoneHistory {
    std::vector<RigidMotion> motion;  // of each bone in the previous frame; empty after the I-frame
    Codebooks codebooks;
    double least_bytes = 0;        // size of the cheapest whole EP-frame; 0: none yet
    double excess_bytes = 0;       // how much more the others took, in total
    double plain_intra_bytes = 0;  // bytes per vertex of an I-frame that nothing refers to; 0: unknown
};

// What the T-frames since the I-frame leave for the next one.
struct NodeHistory {
    std::optional<std::uint32_t> frame;          // number of the last one
    std::optional<std::uint32_t> access;         // number of the last one that refers to the reference alone
    std::vector<RigidMotion> last, before_last;  // of each node, as registered; empty if there is none
    TrackedState state;                          // of the last one
    TargetHistory targets;                       // what filtering left of the last one
    std::vector<RigidMotion> gone_on;  // where each node goes next if it goes on as it did before a patch made
                                       // it; empty but after a TP-frame
    double best_fit = 0;               // RMS of the best so far; 0: none yet
};

// Trials of EP-frames against I-frames: when the next is due, and how often in a row EP-frames lost.
struct EnhancedTrial {
    std::uint32_t next = 0;  // number of the first frame that may be a trial
    int losses = 0;
};

// A frame, coded in one way.
struct Candidate {
    FrameType type = FrameType::intra;
    std::vector<Packet> packets;  // new codebooks first, the frame last; numbered when sent
    std::uint32_t reference = 0;  // number of the frame that it refers to; of an I-frame, its own
    bool referred = false;        // whether later frames may refer to it; an I- or TP-frame then becomes the reference
    bool access = true;           // whether it is an I-frame or refers to a reference
    LatticeMesh decoded;          // the mesh that the decoder will have, without the seams of charts
    TexturedSurface textured;     // I, TP: of `decoded`, if the stream has charts
    CapturedCounts captured;      // of the mesh that it was made of
    LayerBytes shares;            // T: its layers' of its bytes, which its packet does not tell
    FrameSteps steps;             // T: the steps asked for
    RemovedNoise noise;           // T that is to be coded again in a group: what filtering took off
    std::vector<std::uint32_t> near;  // T: of each vertex, the captured vertex beside it
    bool renewal = false;             // I: whether it was made of the tracked mesh, not of the capture
    double renewed = 0;               // TP: the share of its vertices that are new
    double quality = 50;              // the quality setting used, under rate or error control
    bool stands_in = false;           // a P- or T-frame of motion alone, because nothing better fits the buffer
    // What it leaves for the sequence; one of the first three is set.
    std::optional<IntraFacts> intra;     // I, TP; used only if it is referred to
    std::optional<BoneHistory> bones;    // P, EP
    std::optional<NodeHistory> nodes;    // T; TP: what its T-frame would have left
    std::optional<EnhancedTrial> trial;  // set if EP- and I-frame were compared
    CodedPose pose;                      // I, TP
    KeptNodes kept;                      // TP: what the reference that it becomes takes over
    TargetHistory targets;               // TP: on the reference that it becomes
    double best_fit = 0;  // I, TP: NodeHistory::best_fit, which lasts as long as tracking does; 0: it begins anew
    std::vector<std::uint32_t> distance_order_counts;  // EP
    std::size_t bytes() const;
};

// The state of the sequence between two frames.
struct Sequence {
    std::uint32_t next_frame = 0;
    std::shared_ptr<const ReferenceInUse> reference;  // null before the first I-frame
    BoneHistory bones;
    NodeHistory nodes;
    EnhancedTrial trial;
};

// The sequence after this candidate was sent; parts of the candidate are moved into it. Errors: those of
// make_reference().
Result<Sequence> advance(const Configuration& configuration, const Sequence& before, Candidate& sent);

// What of a frame's work it takes to code it again as a T-frame, in a group.
struct TrackedWork {
    LatticeMesh mesh;  // as captured
    SurfaceIndex surface;
    NodeRegistration registered;
};

// A whole frame's vertices as an EP-frame at these steps.
struct QuantisedWork {
    FrameSteps steps;
    QuantisedFrame frame;
};

// What of a frame's work does not need the frame before to be coded: frames_in_flight_enc.h.
struct AheadWork {
    std::optional<SurfaceIndex> surface;
    std::optional<NodeRegistration> registered;  // as if the frame before had been a T-frame
    std::optional<FrameMotion> bone_motion;      // as if it had been an EP- or P-frame
    std::optional<QuantisedWork> quantised;      // as if it had been an EP-frame
};

// Whether the bones or nodes of the reference can move it to this captured frame, by what both have.
bool can_be_moved(const Configuration& configuration, const Sequence& sequence, const LatticeMesh& captured);

// What is derived from one frame, computed on first use and kept. Lengths are in lattice units.
class FrameWork {
public:
    FrameWork(const Configuration& settled, const Sequence& before, int effort_of_frame, LatticeMesh captured,
              std::vector<Colour> captured_colours, CodedPose captured_pose, std::vector<StageTime>& times)
        : configuration(settled),
          sequence(before),
          effort(tracking_effort(effort_of_frame)),
          mesh(std::move(captured)),
          colours(std::move(captured_colours)),
          pose(std::move(captured_pose)),
          stages(times) {}

    const Configuration& configuration;
    const Sequence& sequence;
    const TrackingEffort effort;        // for this frame
    const LatticeMesh mesh;             // as captured
    const std::vector<Colour> colours;  // of its vertices where they are not coded, for tracking alone; or none
    const CodedPose pose;
    std::vector<StageTime>& stages;
    std::atomic<bool> lost = false;         // whether tracking turned out to be lost in it: then it is not what
                                            // was assumed of it, see frames_in_flight_enc.h
    std::function<bool()> may_repair = {};  // whether what tracking lost is repaired in this frame; null: yes
    std::optional<EncodedTrackedFrame> coded_alone;  // as a T-frame of the reference alone, if it was last coded so and
                                                     // is registered as it was then: what a patch is planned on

    std::optional<QuantisedWork> quantised;  // as an EP-frame, until it is coded as one

    // Takes over what was found before; before anything else is asked for.
    void take(AheadWork ahead);

    // The current reference; there must be one.
    const ReferenceInUse& reference() const { return *sequence.reference; }
    std::int64_t frames_since_intra() const { return std::int64_t{sequence.next_frame} - reference().intra_frame; }
    // Whether the capture has what later frames need to refer to it: triangles in the tracked profile, else vertices. A
    // frame without them is an I-frame that nothing refers to, and leaves the reference as it was.
    bool carries_surface() const;
    double edge();                  // mean edge of the captured mesh
    const SurfaceIndex& surface();  // the captured surface; indexed by direction too if nodes are registered to it
    // The motion of each bone, and of each node, relative to the reference.
    const FrameMotion& bone_motion();
    const NodeRegistration& registered_nodes();
    // What of `colours` is seen at the vertices of a decoded mesh.
    std::vector<Colour> colours_at(const LatticeMesh& decoded);
    // Where tracking was lost: makes registered_nodes() follow limbs that another start finds. Gives whether there
    // are any; looks only once.
    // meanwhile: runs beside it, if there are threads, and sees registered_nodes() as they were.
    bool follow_lost_limbs(const std::function<void()>& meanwhile);
    // Whether registered_nodes() is as it was first found.
    bool is_as_first_registered() const { return registered_nodes_ && !followed_limbs_; }
    // Whether the frame can be the reference, moved; and whether it may refer to it as well.
    bool can_be_moved() const { return internal::can_be_moved(configuration, sequence, mesh); }
    bool can_refer() const { return !configuration.intra_alone() && can_be_moved(); }
    // Whether it must be an I-frame: nothing to refer to, or the longest key interval has passed.
    bool intra_is_due() const { return !can_refer() || frames_since_intra() >= configuration.options.key_interval; }
    const AnimationFit& animation_fit();  // how well the motion of the bones alone represents the frame
    // The distance between a decoded mesh and the captured one, in both directions.
    SurfaceErrors errors_of(const LatticeMesh& decoded);
    // Whether a tracked mesh still represents the captured one. near, intra_squared: see measure_tracked_fit().
    TrackedFit tracked_fit(const LatticeMesh& decoded, double reference_edge, std::span<const std::uint32_t> near,
                           std::span<const double> intra_squared);
    // Of a frame that was registered. Nothing else may be asked for afterwards.
    TrackedWork give_up();

private:
    std::optional<double> edge_;
    std::optional<SurfaceIndex> surface_;
    std::optional<FrameMotion> bone_motion_;
    std::optional<NodeRegistration> registered_nodes_;
    bool looked_for_limbs_ = false, followed_limbs_ = false;
    std::optional<AnimationFit> animation_fit_;
};

// What FrameWork finds, by itself. colours: of the mesh where it has none of its own, or none. before: the motion of
// the bones in the frame before; empty after an I-frame. starts: but for the skeleton's.
SurfaceIndex surface_of(const Configuration& configuration, const LatticeMesh& mesh, const std::vector<Colour>& colours,
                        std::vector<StageTime>& stages);
FrameMotion motion_of_bones(const Configuration& configuration, const ReferenceInUse& reference,
                            const LatticeMesh& mesh, const CodedPose& pose, std::span<const RigidMotion> before,
                            std::vector<StageTime>& stages);
NodeRegistration register_frame(const Configuration& configuration, const ReferenceInUse& reference,
                                const SurfaceIndex& surface, const CodedPose& pose, NodeStarts starts,
                                const TrackingEffort& effort, std::vector<StageTime>& stages,
                                const std::atomic<bool>* in_vain = nullptr);

// Side of the cubes of space by which it is judged whether a region is lost, lattice units.
double region_side(const Configuration& configuration);

// The registration's options, scaled to this subject, with the effort that the encoder was asked for.
DeformationOptions deformation_options(const Configuration& configuration);
// The same with a frame's effort. The reference's samples are as many as were chosen with it, whatever the effort
// since.
DeformationOptions deformation_options(const Configuration& configuration, const TrackingEffort& effort);

}  // namespace htvm::internal
