#include "codec/encoder/tracked/tracked_work.h"

#include <algorithm>
#include <utility>

#include "codec/encoder/lattice_motion.h"
#include "codec/encoder/tracked/shared_tracking.h"
#include "surface/kept_vertices.h"

namespace htvm::internal {
namespace {

// Where the skeleton moves each node: with the bone of the vertex that the node sits on.
std::vector<RigidMotion> skeletal_node_motion(const Configuration& configuration, const Reference& reference,
                                              const CodedPose& pose) {
    if (!configuration.header.has_skeleton) return {};
    const auto bones = skeletal_motion(reference.skinned, configuration.header.skeleton.bones, pose);
    std::vector<RigidMotion> out;
    for (const auto v : reference.by_nodes->nodes.vertex) out.push_back(bones[reference.skinned.bone_of_vertex[v]]);
    return out;
}

// What is there of what is registered: DeformableMesh has detail.
std::vector<std::uint8_t> shown_presence(const TrackedReference& reference, std::span<const std::uint8_t> presence) {
    std::vector<std::uint8_t> out(presence.begin(), presence.end());
    const auto& detail = reference.decoded.detail;
    if (const auto levels = levels_to_sample(detail, out.size()); levels > 0 && !out.empty())
        add_detail(detail, levels, out);
    return out;
}

// Where a capture moves each node that has kept its vertices, and the share of those that are known again; no motions
// if too few are: then it is another mesh, and those few are known by chance.
struct CarriedNodes {
    std::vector<RigidMotion> motion;
    double again = 0;
};
CarriedNodes carried_nodes(const Configuration& configuration, const TrackedReference& reference,
                           const CapturedVertices& before, const CapturedVertices& now,
                           std::span<const RigidMotion> last) {
    CarriedNodes out;
    if (before.positions.empty() || now.positions.empty()) return out;
    const auto again = vertices_again(before.around, now.around);
    const auto unknown = std::count(again.begin(), again.end(), OrientedPoints::no_point);
    out.again = 1 - static_cast<double>(unknown) / static_cast<double>(again.size());
    if (out.again < tracking_numbers.vertices_again) return out;
    const auto was = points_of(before.positions), is = points_of(now.positions);
    KeptVerticesOptions options;
    options.scale = configuration.scale;
    options.threads = configuration.threads;
    out.motion = carried_by_vertices(reference.deformable, last, {was, is, before.triangles, again}, options);
    return out;
}

std::int64_t frames_since_intra(const TrackedWork& work) {
    return std::int64_t{work.sequence.next_frame} - work.reference->intra_frame;
}

}  // namespace

bool carries_surface(const LatticeMesh& captured) { return !captured.triangles.empty(); }

bool can_be_moved(const TrackedSequence& sequence, const LatticeMesh& captured) {
    if (!sequence.reference) return false;
    const auto& reference = sequence.reference->decoded;
    return reference.by_nodes && !reference.mesh().positions.empty() && carries_surface(captured) &&
           same_attributes(captured, reference.mesh());
}

bool can_refer(const TrackedWork& work) { return !work.configuration.intra_only() && can_be_moved(work); }

bool intra_is_due(const TrackedWork& work) {
    return work.captured.force_intra || !can_refer(work) ||
           frames_since_intra(work) >= work.configuration.options.key_interval;
}

bool may_be_intra(const TrackedWork& work) {
    return frames_since_intra(work) >= work.configuration.options.least_key_interval;
}

std::shared_ptr<const CapturedVertices> vertices_of(const LatticeMesh& captured) {
    return std::make_shared<const CapturedVertices>(CapturedVertices{
        captured.positions, captured.triangles, connectivity_around(captured.positions.size(), captured.triangles)});
}

std::shared_ptr<const SurfaceIndex> surface_of(const Configuration& configuration, const CapturedFrame& captured,
                                               std::vector<StageTime>& stages) {
    const auto& lattice = configuration.header.lattice;
    const SurfaceKey key{captured.timestamp_us,
                         lattice.origin,
                         lattice.bits,
                         configuration.options.tracked.effort,
                         configuration.tells_presence(),
                         captured.mesh.positions.size(),
                         captured.colours.size()};
    if (configuration.shared)
        if (auto known = configuration.shared->surface(key)) return known;
    StageClock clock(stages);
    auto made = captured_surface(captured.mesh, deformation_options(configuration));
    if (!captured.colours.empty()) made.colours = captured.colours;
    auto out = std::make_shared<const SurfaceIndex>(std::move(made));
    if (configuration.shared) configuration.shared->add(key, out);
    clock.done("search structures");
    return out;
}

NodeRegistration register_frame(const Configuration& configuration, const TrackedReference& reference,
                                const SurfaceIndex& surface, const CapturedFrame& captured, NodeStarts starts,
                                const CapturedVertices* before, const CapturedVertices& now,
                                std::span<const std::uint8_t> presence, std::vector<StageTime>& stages,
                                const std::atomic<bool>* in_vain) {
    StageClock clock(stages);
    const auto skeletal = skeletal_node_motion(configuration, reference.decoded, captured.pose);
    const auto carried = before ? carried_nodes(configuration, reference, *before, now, starts.last) : CarriedNodes{};
    starts.skeletal = skeletal;
    starts.carried = carried.motion;
    std::vector<RigidMotion> shared;
    if (configuration.follows)
        shared = configuration.shared->start(captured.timestamp_us, configuration.header.lattice, reference.deformable,
                                             starts.last);
    starts.shared = shared;
    auto options = deformation_options(configuration, tracking_effort(captured.effort));
    options.in_vain = in_vain;
    const auto present = shown_presence(reference, presence);
    options.present = present;
    auto out = register_nodes(reference.deformable, surface, starts, options);
    out.vertices_again = carried.again;
    clock.done("registration");
    return out;
}

std::span<const std::uint8_t> present(const TrackedSequence& sequence, bool behind) {
    const auto& history = sequence.history;
    const auto& there = behind ? history.presence.shown : history.present_before_last;
    return there.empty() ? sequence.reference->decoded.presence : there;
}

const NodeRegistration& register_once(const TrackedWork& work, Tracking& tracking) {
    if (!tracking.registered) {
        const auto& history = work.sequence.history;
        tracking.registered =
            register_frame(work.configuration, *work.reference, work.surface, work.captured,
                           {history.last, history.before_last, history.gone_on, {}, {}}, work.sequence.captured.get(),
                           *work.vertices, present(work.sequence), work.stages);
    }
    return *tracking.registered;
}

FoundLimbs find_lost_limbs(const TrackedWork& work, NodeRegistration registered, std::vector<StageTime>& stages) {
    StageClock clock(stages);
    const auto& history = work.sequence.history;
    const auto skeletal = skeletal_node_motion(work.configuration, work.reference->decoded, work.captured.pose);
    FoundLimbs out{std::move(registered)};
    auto options = deformation_options(work.configuration, work.effort);
    const auto there = shown_presence(*work.reference, present(work.sequence));
    options.present = there;
    out.any =
        follow_lost_limbs(work.reference->deformable, work.surface,
                          {history.last, history.before_last, history.gone_on, skeletal, out.registered.carried, {}},
                          options, out.registered);
    clock.done("registration");
    return out;
}

TrackedFit fit_of(const TrackedWork& work, const LatticeMesh& decoded, double reference_edge, const KnownOfFit& known) {
    StageClock clock(work.stages);
    TrackedFitOptions options;
    options.stray = std::max(tracking_numbers.stray_in_edges * LatticeUnits(reference_edge), LatticeUnits(1));
    options.reach = std::max(work.configuration.scale.on_lattice(tracking_numbers.fit_reach), options.stray);
    options.region = region_side(work.configuration);
    options.seen = known.seen;
    options.threads = work.configuration.threads;
    auto out = measure_tracked_fit(work.surface, decoded, known.near, known.intra_squared, options);
    clock.done("fit of the tracking");
    return out;
}

SurfaceErrors errors_shown(const TrackedWork& work, const LatticeMesh& decoded, const SurfaceDetail& detail) {
    return errors_between(work.captured.mesh, work.surface, detailed(detail, decoded), work.configuration.threads);
}

std::vector<Colour> colours_at(const TrackedWork& work, const LatticeMesh& decoded) {
    const auto& colours = work.captured.colours;
    if (colours.empty()) return {};
    const auto points = points_of(decoded.positions);
    const auto normals = points_of(vertex_normals(decoded.positions, decoded.triangles));
    const auto found =
        closest_facing(work.surface, points, normals,
                       {.reach = static_cast<float>(work.configuration.scale.on_lattice(tracking_numbers.reach).value)},
                       work.configuration.threads);
    std::vector<Colour> out;
    for (const auto& at : found) {
        Colour colour{};
        for (std::size_t c = 0; c < 3 && at.found(); ++c) {
            float level = 0;
            for (std::size_t i = 0; i < 3; ++i)
                level += at.shares[i] * static_cast<float>(colours[work.captured.mesh.triangles[at.triangle][i]][c]);
            colour[c] = static_cast<std::uint8_t>(std::clamp(level + 0.5F, 0.0F, 255.0F));
        }
        out.push_back(colour);
    }
    return out;
}

LatticeUnits region_side(const Configuration& configuration) {
    return configuration.scale.on_lattice(tracking_numbers.region);
}

DeformationOptions deformation_options(const Configuration& configuration, const TrackingEffort& effort) {
    DeformationOptions out;
    out.scale = configuration.scale;
    out.open = configuration.tells_presence();
    out.threads = configuration.threads;
    return with_effort(out, effort);
}
DeformationOptions deformation_options(const Configuration& configuration) {
    return deformation_options(configuration, tracking_effort(configuration.options.tracked.effort));
}

}  // namespace htvm::internal
