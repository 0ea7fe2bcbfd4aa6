// Tracked frames, encoder side. First the reference is registered to the captured surface; this depends on no quantiser
// step and is done once per frame. Then the motion of its nodes is quantised, and the remaining differences along the
// normals and in the colours are coded as fields.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "codec/encoder/tracked/presence_judge.h"
#include "codec/encoder/tracked/target_filter.h"
#include "codec/encoder/tracking_numbers.h"
#include "codec/tracked/tracked_frame.h"
#include "core/length.h"
#include "core/thread.h"
#include "entropy/decision_log.h"
#include "htvm/encoder.hpp"
#include "surface/tracked_registration.h"

namespace htvm::internal {

// What filtering took off a frame's targets, for when the frame is coded once more from others.
struct RemovedNoise {
    TrackedTargets targets;  // to take off what is found; empty without filtering
    double price = 1;        // by how much less a bit should cost: price_of_bits()
};

struct TrackedFrameOptions {
    Scale scale;  // of the lattice
    // The quantiser steps of the displacement along the normal, and of colours (levels).
    LatticeUnits geometry_step = tracking_numbers.finer * usual_request.geometry_step;
    double colour_step = tracking_numbers.coarser_tracked_colours * usual_request.colour_step;
    double lambda = 0.12;  // squared steps that one bit is worth
    // How far from the moved reference to search for the captured surface.
    LatticeUnits reach = Scale{}.on_lattice(tracking_numbers.reach);
    std::optional<NodeMotionSteps> motion;       // none: those that suit the geometry step
    std::optional<TargetFilterOptions> denoise;  // filters the targets over time
    const RemovedNoise* noise = nullptr;         // else: what to take off them
    bool keeps_noise = false;                    // whether to tell what filtering took off
    TargetSamples target_samples = TargetSamples::middles;
    const SurfaceDetail* detail = nullptr;     // with which the reference is shown; null: none
    std::span<const std::uint32_t> near = {};  // EncodedTrackedFrame::near of another attempt, where searches begin;
                                               // none: they begin at the registration's matches
    // Where the stream tells what is there: how that is judged, from the frame before; or what it is to be.
    PresenceOptions presence_options;
    const PresenceHistory* presence_before = nullptr;
    std::span<const std::uint8_t> presence = {};
    std::optional<FilmProjection> projection;  // how the camera saw the frame, where the reference has a projection
    bool motion_alone = false;  // displacement and colours stay as predicted: the smallest frame possible
    Threads threads = {};
};

// The reference as it is shown, with levels_to_sample() levels of its detail, prepared for registration; made once per
// reference. Its own few vertices would say too little, and lie off what is shown between them. colours: of its own
// vertices, for the registration alone; none: those that it has.
DeformableMesh make_tracked_deformable(const NodeReference& reference, const SurfaceDetail& detail,
                                       const DeformationOptions& options, std::span<const Colour> colours = {});

// Possible starts of a registration, each one motion per node, or empty. last, before_last: of the two previous frames.
// gone_on: behind a TP-frame, as the surface moved before it. skeletal: where the skeleton moves each node. carried:
// where the capture's own vertices move it, if it has kept them. shared: as another encoder of the same capture found
// that the surface moves: nearly right already.
struct NodeStarts {
    std::span<const RigidMotion> last{}, before_last{}, gone_on{}, skeletal{}, carried{}, shared{};
};
struct NodeRegistration {
    std::vector<RigidMotion> motion;   // of each node, reference -> frame
    DeformationForm form;              // how well the captured surface determines it
    std::size_t start = 0;             // which of the starts it began at
    std::vector<RigidMotion> carried;  // NodeStarts::carried
    double vertices_again = 0;         // share of the vertices captured in the frame before that are known in this one
};
// From the start that lies nearest to the surface.
NodeRegistration register_nodes(const DeformableMesh& deformable, const SurfaceIndex& surface, const NodeStarts& starts,
                                const DeformationOptions& options);
// Registers from the other starts, too, and with limbs that end nowhere turned towards the capture's extremities; takes
// each limb from where it lies nearest to the surface: a start that is best for the whole may lose a hand. registered:
// by register_nodes(). Gives whether any limb was taken from elsewhere.
bool follow_lost_limbs(const DeformableMesh& deformable, const SurfaceIndex& surface, const NodeStarts& starts,
                       const DeformationOptions& options, NodeRegistration& registered);

struct TrackedRuns {
    std::vector<std::uint8_t> payload;
    LayerBytes shares;  // of the payload
};
struct TrackedDecisions {
    const DecisionLog &motion, &displacement;
    const DecisionLog* colour = nullptr;  // null where the reference has no colours
};
// What is there, as it is coded.
struct PresenceToWrite {
    const VerticesAround& around;
    std::span<const std::uint8_t> before, presence;
};
// The payload of decisions. presence: null in streams that do not tell it. least_run: bytes from which on the colours
// are a run of their own; sets head.colour_run.
TrackedRuns write_tracked_runs(TrackedHead& head, const KnownOfHead& known, const TrackedDecisions& decisions,
                               const PresenceToWrite* presence, std::size_t least_run);

struct EncodedTrackedFrame {
    TrackedRuns runs;
    LatticeMesh mesh;  // the mesh that the decoder will have
    TrackedState state;
    TargetHistory targets;            // empty without filtering
    PresenceHistory presence;         // empty in streams that do not tell it, and where it was given
    std::vector<std::uint8_t> seen;   // TrackedTargets::seen
    RemovedNoise noise;               // empty unless it was to be told
    std::vector<std::uint32_t> near;  // of each vertex, the captured vertex beside it: TrackedTargets::near
};

// mesh: as captured; surface: its index, see captured_surface(). registered: to this surface. before: state of the
// frame that this one refers to; null if that is the reference. targets: what filtering left of the last frame.
Result<EncodedTrackedFrame> encode_tracked_frame(const LatticeMesh& mesh, const SurfaceIndex& surface,
                                                 const NodeReference& reference, const NodeRegistration& registered,
                                                 const TrackedState* before, const TargetHistory& targets,
                                                 const TrackedFrameOptions& options, std::vector<StageTime>& stages);

}  // namespace htvm::internal
