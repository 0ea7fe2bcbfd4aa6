// The tracked strategy's values: what its frames refer to, what is found of a frame before it is coded, and what coding
// it in one way gives. Frames are I, T or TP: docs/tracked_frames.md. Lengths are in lattice units.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "codec/encoder/coded_frame.h"
#include "codec/encoder/tracked/captured_surface.h"
#include "codec/encoder/tracked/tracked_frame.h"
#include "codec/encoder/tracked/tracking_effort.h"
#include "codec/encoder/tracking_numbers.h"
#include "codec/reference/reference.h"

namespace htvm::internal {

// What the encoder knows about where a reference came from, and the decoder does not.
struct ReferenceOrigin {
    FrameSteps steps;               // asked for
    double edge = 0;                // mean edge of the captured mesh
    std::size_t vertices = 0;       // of the last I-frame that was made of the capture; later ones may be renewals
    std::uint32_t chart_scale = 0;  // ChartLayout::scale, if the stream has charts
    std::vector<Colour> colours;    // of the reference's vertices, for tracking alone: where frames have none; or none
    TrackedFit fit;                 // of the reference itself
};

// The current reference, and what the encoder derives from it.
struct TrackedReference {
    Reference decoded;
    ReferenceOrigin origin;
    std::uint32_t intra_frame = 0;  // number of the I-frame; patched since, the reference has another
    double intra_bytes = 0;         // size of the I-frame
    int patches = 0;                // how many TP-frames led from the I-frame to this reference
    double patch_bytes = 0;         // their size
    DeformableMesh deformable;
};

// When what takes time was last tried in vain where surface comes and goes: numbers of frames. It is not tried again
// at once, since what it is tried for is mostly still there in the next frame.
struct VainAttempts {
    std::optional<std::uint32_t> limbs;   // looking for lost ones
    std::optional<std::uint32_t> growth;  // adding what was captured beside what is tracked
    std::optional<std::uint32_t> repair;  // patching what is lost, as the frame before had asked
};

// A capture that keeps its vertices, and how well it is followed: see fresh_reference.h.
struct FollowedCapture {
    std::uint32_t frames = 0;    // in a row whose vertices are those of the frame before, this one the last
    std::uint32_t expected = 0;  // in a row, behind a frame with other vertices: as there were before the last one,
                                 // or half as many as were expected there, if that is more
    double tracked_bytes = 0;    // of the T-frames since the I-frame
    double squared = 0;          // RMS distance between the surfaces squared, of all measured T-frames of one I-frame
    int measured = 0;            // together, and how many those are: the last I-frame of which there are any
    std::uint32_t of_intra = 0;  // its number
};

// What the T-frames since the reference leave for the next one.
struct MotionHistory {
    std::optional<std::uint32_t> frame;          // number of the last one
    std::optional<std::uint32_t> access;         // number of the last one that refers to the reference alone
    std::vector<RigidMotion> last, before_last;  // of each node, as registered; empty if there is none
    TrackedState state;                          // of the last one
    TargetHistory targets;                       // what filtering left of the last one
    PresenceHistory presence;                    // what judging left of it, in streams that tell what is there
    Presence present_before_last;                // what was there one frame before; none: as of the reference
    std::vector<RigidMotion> gone_on;     // behind a TP-frame: a start for each node of the new reference, from how the
                                          // surface there moved on the old one; else empty
    LatticeUnits best_fit;                // RMS of the best so far; 0: none yet
    std::optional<FrameReason> to_patch;  // why the next frame should be a TP-frame at once; nothing if it need not
    VainAttempts in_vain;
    FollowedCapture followed;
};

// A captured mesh without its attributes: the next one may have kept its vertices.
struct CapturedVertices {
    std::vector<LatticePoint> positions;
    std::vector<Triangle> triangles;
    std::vector<std::uint64_t> around;  // connectivity_around()
};

// Behind a TP-frame: what is still to be derived of the reference that it became. That is a fifth of a T-frame's time,
// and TP-frames take long enough.
struct ToDerive {
    std::shared_ptr<TrackedReference> reference;  // the sequence's; without nodes, and nothing to deform
    std::shared_ptr<const TrackedReference> before;
    std::vector<RigidMotion> before_last, last;  // of each node of the reference before, up to the TP-frame
};

// The strategy's state between two frames.
struct TrackedSequence {
    std::uint32_t next_frame = 0;
    std::shared_ptr<const TrackedReference> reference;  // null before the first I-frame
    MotionHistory history;
    std::shared_ptr<const CapturedVertices> captured;  // of the frame that the history ends with; null if there is none
    std::optional<ToDerive> to_derive;
};

// What was found of a frame that waits, while others were coded.
struct TrackedAhead {
    std::shared_ptr<const SurfaceIndex> surface;
    std::shared_ptr<const CapturedVertices> vertices;
    std::optional<NodeRegistration> registered;  // as if the frame before had been a T-frame
};

// How the reference lies on the frame that is coded, and what attempts at coding it have found out so far: rate and
// error control make several.
struct Tracking {
    std::optional<NodeRegistration> registered;
    bool searched_limbs = false, moved_limbs = false;  // whether lost limbs were looked for, and any was found
    std::atomic<bool> lost = false;  // that tracking is lost; read by whoever works ahead on the frame behind
};

// A T-frame.
struct TrackedMotion {
    CodedFrame frame;
    MotionHistory history;  // that it leaves
    FrameSteps steps;       // asked for
    RemovedNoise noise;     // what filtering took off, if it is to be coded again in a group
};
// An I-frame. It becomes the reference if it is referred to.
struct TrackedIntra {
    CodedFrame frame;
    ReferenceOrigin origin;
    std::int32_t step = 1;  // Reference::step
    CodedPose pose;
    PresenceHistory presence = {};  // MotionHistory::presence, of a renewed one
    LatticeUnits best_fit;          // MotionHistory::best_fit, which lasts as long as tracking does; 0: it begins anew
    FollowedCapture followed;       // MotionHistory::followed
};
// A TP-frame, which becomes the reference.
struct TrackedPatch {
    CodedFrame frame;
    ReferenceOrigin origin;
    CodedPose pose;
    KeptNodes kept;                              // what it takes over of the reference before
    TargetHistory targets;                       // on the reference that it becomes
    PresenceHistory presence;                    // likewise
    std::vector<RigidMotion> before_last, last;  // of each node of the reference before, up to this frame
    LatticeUnits best_fit;                       // as of an I-frame
    VainAttempts in_vain;                        // as of a T-frame
    FollowedCapture followed;                    // likewise
};

// The frame that is coded, and what is found of it before that. Attempts share it and leave it as it is.
struct TrackedWork {
    using Progress = Tracking;
    using Frame = std::variant<TrackedIntra, TrackedMotion, TrackedPatch>;

    const Configuration& configuration;
    const TrackedSequence& sequence;
    const TrackedReference* reference;  // the sequence's; null before the first I-frame
    std::vector<StageTime>& stages;     // where times are added
    CapturedFrame captured;
    TrackingEffort effort;
    std::shared_ptr<const SurfaceIndex> kept_surface;
    const SurfaceIndex& surface;  // the same: the captured surface, indexed by direction too; empty without triangles
    std::shared_ptr<const CapturedVertices> vertices;
};

// A frame without triangles is an I-frame that nothing refers to, and leaves the reference as it was.
bool carries_surface(const LatticeMesh& captured);
// Whether the nodes of the reference can move it to this captured frame, by what both have.
bool can_be_moved(const TrackedSequence& sequence, const LatticeMesh& captured);
inline bool can_be_moved(const TrackedWork& work) { return can_be_moved(work.sequence, work.captured.mesh); }
// Whether the frame may also refer to it.
bool can_refer(const TrackedWork& work);
// Whether an I-frame is wanted: it is asked for, there is nothing to refer to, or the longest key interval has passed.
bool intra_is_due(const TrackedWork& work);
// Whether the shortest key interval has passed: an I-frame is allowed if it saves bits.
bool may_be_intra(const TrackedWork& work);

inline CodedFrame& coded_frame(TrackedWork::Frame& frame) {
    return std::visit([](auto& of_kind) -> CodedFrame& { return of_kind.frame; }, frame);
}

// What is kept of a captured mesh for the frame behind it.
std::shared_ptr<const CapturedVertices> vertices_of(const LatticeMesh& captured);

// The captured surface, with the colours that serve tracking; what another encoder has made of the same frame is taken.
std::shared_ptr<const SurfaceIndex> surface_of(const Configuration& configuration, const CapturedFrame& captured,
                                               std::vector<StageTime>& stages);

// What of the reference is known to be there when a frame is registered: since that may begin while the frame before is
// coded, what was there before that one. One per vertex, or none: all is. behind: of the frame behind the next one.
std::span<const std::uint8_t> present(const TrackedSequence& sequence, bool behind = false);

// Registers the reference's nodes to a captured surface. starts: but for the skeleton's and the vertices'. now: of this
// frame; before: of the frame that starts.last is of, or null. presence: what of the reference was seen lately.
// in_vain: may end it early.
NodeRegistration register_frame(const Configuration& configuration, const TrackedReference& reference,
                                const SurfaceIndex& surface, const CapturedFrame& captured, NodeStarts starts,
                                const CapturedVertices* before, const CapturedVertices& now,
                                std::span<const std::uint8_t> presence, std::vector<StageTime>& stages,
                                const std::atomic<bool>* in_vain = nullptr);
// The same of the frame that is coded, unless it is registered already.
const NodeRegistration& register_once(const TrackedWork& work, Tracking& tracking);

// Where tracking was lost: the registration with the limbs that another start finds, and whether there are any.
struct FoundLimbs {
    NodeRegistration registered;
    bool any = false;
};
FoundLimbs find_lost_limbs(const TrackedWork& work, NodeRegistration registered, std::vector<StageTime>& stages);

// What is known of a decoded mesh: see measure_tracked_fit().
struct KnownOfFit {
    std::span<const std::uint32_t> near = {};
    std::span<const double> intra_squared = {};
    std::span<const std::uint8_t> seen = {};
};
// Whether a decoded mesh still represents the captured one.
TrackedFit fit_of(const TrackedWork& work, const LatticeMesh& decoded, double reference_edge, const KnownOfFit& known);

// The distance between the captured surface and a decoded mesh, shown with this detail, in both directions.
SurfaceErrors errors_shown(const TrackedWork& work, const LatticeMesh& decoded, const SurfaceDetail& detail);

// What is seen of CapturedFrame::colours at the vertices of a decoded mesh; none without those.
std::vector<Colour> colours_at(const TrackedWork& work, const LatticeMesh& decoded);

// Side of the cubes of space by which it is judged whether a region is lost.
LatticeUnits region_side(const Configuration& configuration);

// The registration's options, scaled to this subject, with the effort that the encoder was asked for, or a frame's. The
// reference's samples are as many as were chosen with it, whatever the effort since.
DeformationOptions deformation_options(const Configuration& configuration);
DeformationOptions deformation_options(const Configuration& configuration, const TrackingEffort& effort);

}  // namespace htvm::internal
