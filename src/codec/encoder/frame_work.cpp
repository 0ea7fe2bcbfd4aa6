#include "codec/encoder/frame_work.h"

#include <algorithm>
#include <utility>

#include "core/parallel.h"

namespace htvm::internal {
namespace {

RegistrationOptions registration_options(const EncoderOptions& options) {
    RegistrationOptions out;
    out.point_to_plane = options.topology.registration == BoneRegistration::plane;
    if (!out.point_to_plane) {  // converges more slowly
        out.iterations = 16;
        out.samples = 500;
    }
    return out;
}

// What to derive for the frames that may refer to an I-frame. If the skeleton is tracked, the bones also give a start
// for the motion of the nodes.
Derived derived_of(const Configuration& configuration) {
    // Under rate control a stand-in for a frame that does not fit also refers to the I-frame.
    const bool referred_to = !configuration.intra_alone() || configuration.options.rate.bits_per_second > 0;
    return {.bones = referred_to && (configuration.header.skeleton_tracked || !configuration.tracked()),
            .nodes = referred_to && configuration.tracked()};
}

// Where the skeleton moves each node: with the bone of the vertex that the node sits on.
std::vector<RigidMotion> skeletal_node_motion(const Configuration& configuration, const Reference& reference,
                                              const CodedPose& pose) {
    if (!configuration.header.skeleton_tracked) return {};
    const auto bones = skeletal_motion(reference.skinned, configuration.header.skeleton.bones, pose);
    std::vector<RigidMotion> out;
    for (const auto v : reference.tracked->nodes.vertex) out.push_back(bones[reference.skinned.bone_of_vertex[v]]);
    return out;
}

}  // namespace

SurfaceIndex surface_of(const Configuration& configuration, const LatticeMesh& mesh, const std::vector<Colour>& colours,
                        std::vector<StageTime>& stages) {
    StageClock clock(stages);
    auto out = configuration.tracked() ? captured_surface(mesh, deformation_options(configuration))
                                       : SurfaceIndex(points_of(mesh.positions), mesh.triangles);
    if (!colours.empty()) out.colours = colours;
    clock.done("search structures");
    return out;
}

FrameMotion motion_of_bones(const Configuration& configuration, const ReferenceInUse& reference,
                            const LatticeMesh& mesh, const CodedPose& pose, std::span<const RigidMotion> before,
                            std::vector<StageTime>& stages) {
    const MotionReference against{&reference.decoded.skinned, &reference.search, &configuration.header.skeleton.bones,
                                  configuration.header.radii, before};
    return find_frame_motion(mesh.positions, pose, against, registration_options(configuration.options),
                             configuration.threads, stages);
}

NodeRegistration register_frame(const Configuration& configuration, const ReferenceInUse& reference,
                                const SurfaceIndex& surface, const CodedPose& pose, NodeStarts starts,
                                const TrackingEffort& effort, std::vector<StageTime>& stages,
                                const std::atomic<bool>* in_vain) {
    StageClock clock(stages);
    const auto skeletal = skeletal_node_motion(configuration, reference.decoded, pose);
    starts.skeletal = skeletal;
    auto options = deformation_options(configuration, effort);
    options.in_vain = in_vain;
    auto out = register_nodes(reference.deformable, surface, starts, options);
    clock.done("registration");
    return out;
}

std::size_t Candidate::bytes() const {
    std::size_t sum = 0;
    for (const auto& packet : packets) sum += packet.payload.size() + packet_overhead;
    return sum;
}

double region_side(const Configuration& configuration) { return 100 * configuration.adult_millimetre; }

DeformationOptions deformation_options(const Configuration& configuration, const TrackingEffort& effort) {
    DeformationOptions out;
    out.scale = {configuration.units, configuration.adult_millimetre};
    out.threads = configuration.threads;
    return with_effort(out, effort);
}
DeformationOptions deformation_options(const Configuration& configuration) {
    return deformation_options(configuration, tracking_effort(configuration.options.tracked.effort));
}

Result<Sequence> advance(const Configuration& configuration, const Sequence& before, Candidate& sent) {
    Sequence out;
    out.next_frame = before.next_frame + 1;
    out.trial = sent.trial ? *sent.trial : before.trial;
    if (!sent.intra || !sent.referred) {
        out.reference = before.reference;
        out.bones = sent.bones ? std::move(*sent.bones) : before.bones;
        out.nodes = sent.nodes ? std::move(*sent.nodes) : before.nodes;
        return out;
    }
    const bool patched = sent.type == FrameType::patched;
    auto decoded = make_reference(
        configuration.header, {before.next_frame, sent.intra->step, sent.captured, std::move(sent.kept), sent.textured},
        sent.decoded, std::move(sent.pose), derived_of(configuration), configuration.threads);
    if (!decoded) return tl::unexpected(decoded.error());
    auto in_use = std::make_shared<ReferenceInUse>();
    in_use->decoded = std::move(*decoded);
    in_use->intra = std::move(*sent.intra);
    in_use->intra_frame = patched ? before.reference->intra_frame : before.next_frame;
    in_use->bytes = patched ? before.reference->bytes : static_cast<double>(sent.bytes());
    if (patched) {
        in_use->patches = before.reference->patches + 1;
        in_use->patch_bytes = before.reference->patch_bytes + static_cast<double>(sent.bytes());
    }
    out.nodes.best_fit = sent.best_fit;
    out.nodes.targets = patched ? std::move(sent.targets) : on_new_reference(before.nodes.targets, {}, 0, {});
    if (in_use->decoded.tracked)
        in_use->deformable = make_tracked_deformable(*in_use->decoded.tracked, deformation_options(configuration),
                                                     in_use->intra.colours);
    else if (in_use->decoded.has_bones)
        in_use->search = make_reference_search(in_use->decoded.skinned);
    if (patched && sent.nodes && !sent.nodes->before_last.empty())
        out.nodes.gone_on = moved_on(before.reference->deformable, sent.nodes->before_last, sent.nodes->last,
                                     in_use->deformable.handles);
    out.reference = std::move(in_use);
    return out;
}

double FrameWork::edge() {
    if (!edge_) edge_ = mean_edge(mesh.positions, mesh.triangles);
    return *edge_;
}

const SurfaceIndex& FrameWork::surface() {
    if (!surface_) surface_ = surface_of(configuration, mesh, colours, stages);
    return *surface_;
}

void FrameWork::take(AheadWork ahead) {
    surface_ = std::move(ahead.surface);
    registered_nodes_ = std::move(ahead.registered);
    bone_motion_ = std::move(ahead.bone_motion);
    quantised = std::move(ahead.quantised);
}

namespace {

bool carries_surface(const Configuration& configuration, const LatticeMesh& captured) {
    return configuration.tracked() ? !captured.triangles.empty() : !captured.positions.empty();
}

bool same_attributes(const LatticeMesh& a, const LatticeMesh& b) {
    return a.colours.empty() == b.colours.empty() && a.normals.empty() == b.normals.empty() &&
           a.texcoords.empty() == b.texcoords.empty();
}

}  // namespace

bool FrameWork::carries_surface() const { return internal::carries_surface(configuration, mesh); }

bool can_be_moved(const Configuration& configuration, const Sequence& sequence, const LatticeMesh& captured) {
    if (!sequence.reference) return false;
    const auto& decoded = sequence.reference->decoded;
    const bool derived = configuration.tracked() ? decoded.tracked.has_value() : decoded.has_bones;
    return derived && !decoded.mesh().positions.empty() && carries_surface(configuration, captured) &&
           same_attributes(captured, decoded.mesh());
}

const FrameMotion& FrameWork::bone_motion() {
    if (!bone_motion_)
        bone_motion_ = motion_of_bones(configuration, reference(), mesh, pose, sequence.bones.motion, stages);
    return *bone_motion_;
}

std::vector<Colour> FrameWork::colours_at(const LatticeMesh& decoded) {
    if (colours.empty()) return {};
    const auto& captured = surface();
    const auto points = points_of(decoded.positions);
    const auto normals = points_of(vertex_normals(decoded.positions, decoded.triangles));
    const auto found =
        closest_facing(captured, points, normals, {.reach = static_cast<float>(30 * configuration.adult_millimetre)},
                       configuration.threads);
    std::vector<Colour> out;
    for (const auto& at : found) {
        Colour colour{};
        for (std::size_t c = 0; c < 3 && at.found(); ++c) {
            float level = 0;
            for (std::size_t i = 0; i < 3; ++i)
                level += at.shares[i] * static_cast<float>(colours[mesh.triangles[at.triangle][i]][c]);
            colour[c] = static_cast<std::uint8_t>(std::clamp(level + 0.5F, 0.0F, 255.0F));
        }
        out.push_back(colour);
    }
    return out;
}

const NodeRegistration& FrameWork::registered_nodes() {
    if (!registered_nodes_) {
        const auto& nodes = sequence.nodes;
        registered_nodes_ = register_frame(configuration, reference(), surface(), pose,
                                           {nodes.last, nodes.before_last, nodes.gone_on, {}}, effort, stages);
    }
    return *registered_nodes_;
}

bool FrameWork::follow_lost_limbs(const std::function<void()>& meanwhile) {
    if (std::exchange(looked_for_limbs_, true)) {
        meanwhile();
        return false;
    }
    auto registered = registered_nodes();
    const auto& captured = surface();
    const auto& nodes = sequence.nodes;
    const auto skeletal = skeletal_node_motion(configuration, reference().decoded, pose);
    bool any = false;
    std::vector<StageTime> of_limbs;
    const auto follow = [&] {
        StageClock clock(of_limbs);
        any = internal::follow_lost_limbs(reference().deformable, captured,
                                          {nodes.last, nodes.before_last, nodes.gone_on, skeletal},
                                          deformation_options(configuration, effort), registered);
        clock.done("registration");
    };
    parallel_invoke(configuration.threads, follow, meanwhile);
    stages.insert(stages.end(), of_limbs.begin(), of_limbs.end());
    registered_nodes_ = std::move(registered);
    followed_limbs_ = followed_limbs_ || any;
    if (any) coded_alone.reset();
    return any;
}

const AnimationFit& FrameWork::animation_fit() {
    if (!animation_fit_) {
        const auto& predicted = bone_motion().predicted;
        StageClock clock(stages);
        const auto& options = configuration.options;
        const bool checked = options.topology.animation_error > 0 || options.rate.target_error > 0 ||
                             options.topology.frame_choice == FrameChoice::rate_distortion;
        animation_fit_ =
            measure_animation(mesh, reference().decoded.skinned, predicted, checked, configuration.threads);
        clock.done("fit of the animation");
    }
    return *animation_fit_;
}

SurfaceErrors FrameWork::errors_of(const LatticeMesh& decoded) {
    SurfaceDistanceOptions options;
    options.threads = configuration.threads;
    options.every = 4;
    const auto& captured = surface();
    const auto shown = points_of(decoded.positions);
    return surface_errors({captured.positions, mesh.triangles, mesh.colours}, captured,
                          {shown, decoded.triangles, decoded.colours}, options);
}

TrackedFit FrameWork::tracked_fit(const LatticeMesh& decoded, double reference_edge,
                                  std::span<const std::uint32_t> near, std::span<const double> intra_squared) {
    constexpr double stray_in_edges = 2, reach = 25;  // in mean edges; mm on an adult
    const auto& captured = surface();
    StageClock clock(stages);
    TrackedFitOptions options;
    options.stray = std::max(stray_in_edges * reference_edge, 1.0);
    options.reach = std::max<LatticeUnits>(reach * configuration.adult_millimetre, options.stray);
    options.region = region_side(configuration);
    options.threads = configuration.threads;
    auto out = measure_tracked_fit(captured, decoded, near, intra_squared, options);
    clock.done("fit of the tracking");
    return out;
}

TrackedWork FrameWork::give_up() { return {mesh, std::move(*surface_), std::move(*registered_nodes_)}; }

}  // namespace htvm::internal
