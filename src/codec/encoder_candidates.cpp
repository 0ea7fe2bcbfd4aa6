#include "codec/encoder_candidates.h"

#include <algorithm>
#include <cmath>

#include "codec/intra/intra_frame.h"
#include "codec/paper/animated_frame.h"
#include "codec/stage_clock_enc.h"
#include "codec/tracked/captured_surface_enc.h"

namespace htvm::internal {
namespace {

using State = EncoderState;

// Where frames refer to an I-frame, its step is no wider than half an edge: EP-frames then save more than it costs.
// Their quantiser starts from the same cells; the price of a bit stays that of the step asked for, so that it is the
// entropy constraint that makes it coarse. At 8 mm and 35,000 vertices: a fifth fewer bits at the same error.
std::int32_t step_for_reference(double edge, std::int32_t step) {
    const double half_edge = edge / 2;
    return half_edge >= 1 && half_edge < step ? static_cast<std::int32_t>(half_edge) : step;
}

RegistrationOptions registration_options(const State& state) {
    RegistrationOptions out;
    out.point_to_plane = state.options.topology.registration == BoneRegistration::plane;
    if (!out.point_to_plane) {  // slower to settle
        out.iterations = 16;
        out.samples = 500;
    }
    return out;
}

EnhancedFrameOptions enhanced_options(const State& state, const FrameSteps& steps) {
    EnhancedFrameOptions out;
    out.geometry.step = step_for_reference(state.group->edge, steps.geometry);
    out.colour.step = steps.colour;
    const double ratio = static_cast<double>(steps.geometry) / out.geometry.step;
    out.geometry.lambda = state.options.lambda * ratio * ratio;
    out.colour.lambda = state.options.lambda;
    out.geometry.threads = out.colour.threads = out.threads = state.threads;
    out.reference_choice = state.options.topology.reference_vertices == ReferenceVertices::bone ? ReferenceChoice::bone
                                                                                                : ReferenceChoice::any;
    out.merge_duplicates = state.options.topology.merge_duplicates;
    out.nearest_vertices = state.options.topology.nearest_vertices;
    return out;
}

Packet frame_packet(PacketKind kind, const FramePayload& payload) {
    Packet packet;
    packet.kind = kind;
    packet.payload = write_frame_payload(payload);
    return packet;
}

Packet codebook_packet(std::uint8_t purpose, const CodebookInUse& use) {
    Packet packet;
    packet.kind = PacketKind::codebook;
    packet.payload = write_codebook_payload(purpose, use.number, *use.codebook);
    return packet;
}

// New ones, and now and then the one in force: a lost packet costs the frames that name it, but not for long. Every
// tenth frame it takes 0.2 to 0.4 % of the bits.
void send_codebook(const State& state, std::uint8_t purpose, CodebookInUse& use, std::vector<Packet>& packets) {
    constexpr std::uint32_t repeated_after = 10;  // frames
    if (!use.codebook || (!use.is_new && state.next_frame - use.sent < repeated_after)) return;
    use.sent = state.next_frame;
    packets.push_back(codebook_packet(purpose, use));
}

FrameCandidate encode_residual_frame(State& state, const FrameUnderWay& frame, const EnhancedFrameSource& source,
                                     const FrameSteps& steps) {
    FrameCandidate out;
    out.type = FrameType::enhanced;
    out.codebooks = state.group->codebooks;
    auto encoded = encode_enhanced_frame(source, out.codebooks, enhanced_options(state, steps), state.stages);
    send_codebook(state, codebook_for_geometry, out.codebooks.geometry, out.packets);
    send_codebook(state, codebook_for_colour, out.codebooks.colour, out.packets);
    out.packets.push_back(frame_packet(PacketKind::enhanced, encoded.payload));
    out.decoded = std::move(encoded.mesh);
    out.motion = frame.motion->motion;
    out.distance_order_counts = std::move(encoded.distance_order_counts);
    return out;
}

EnhancedFrameSource source_of(const State& state, const FrameUnderWay& frame) {
    EnhancedFrameSource out;
    out.mesh = &frame.mesh;
    out.bone_of_vertex = frame.motion->bone_of_vertex;
    out.motion = &*frame.motion;
    out.reference = &state.group->reference;
    out.search = &*state.group->search;
    out.source_vertices = static_cast<std::uint32_t>(frame.mesh.positions.size());
    out.source_triangles = static_cast<std::uint32_t>(frame.mesh.triangles.size());
    return out;
}

DeformationOptions deformation_options(const State& state) {
    DeformationOptions out;
    out.millimetre = 1.0 / state.header.lattice.step();
    out.threads = state.threads;
    return out;
}

// Where the skeleton moves each node: with the bone of the vertex that it sits on.
std::vector<RigidMotion> skeletal_node_motion(const State& state, const FrameUnderWay& frame) {
    if (!state.header.skeleton_tracked) return {};
    const auto& group = *state.group;
    const auto bones = skeletal_motion(group.reference, state.header.skeleton.bones, frame.pose);
    std::vector<RigidMotion> out;
    for (const auto v : group.tracked->reference.nodes.vertex) out.push_back(bones[group.reference.bone_of_vertex[v]]);
    return out;
}

// Steps at which the simplified I-frame and the T-frames behind it err about as much as other frames do at the steps
// asked for: see docs/algorithm.md for the measurement.
FrameSteps tracked_steps(const FrameSteps& steps) {
    constexpr double finer = 0.55, coarser_colours = 1.3;
    const auto scaled = [](double factor, std::int32_t step) {
        return std::max(1, static_cast<std::int32_t>(std::lround(factor * step)));
    };
    constexpr std::int32_t coarsest_colours = 255;  // that a frame's header can say
    return {scaled(finer, steps.geometry), std::min(scaled(coarser_colours, steps.colour), coarsest_colours)};
}

SimplifiedReferenceOptions simplification(const State& state, const FrameSteps& steps) {
    constexpr double longest_edge = 40, reach = 30;  // mm
    constexpr double colour_steps = 2.5;
    const double units = 1.0 / state.header.lattice.step();
    SimplifiedReferenceOptions out;
    out.surface_error = state.options.tracked.simplify * steps.geometry;
    out.colour_error = colour_steps * steps.colour;
    out.longest_edge = longest_edge * units;
    out.reach = reach * units;
    out.threads = state.threads;
    return out;
}

const TargetSurface& target_of(State& state, FrameUnderWay& frame) {
    if (!frame.target) {
        StageClock clock(state.stages);
        frame.target = captured_surface(frame.mesh, deformation_options(state));
        clock.done("search structures");
    }
    return *frame.target;
}

}  // namespace

TrackedFit tracked_fit(State& state, FrameUnderWay& frame, const LatticeMesh& decoded, double edge,
                       std::span<const double> intra_squared) {
    constexpr double stray_in_edges = 2, reach = 25, region = 100;  // mm
    const auto& target = target_of(state, frame);
    StageClock clock(state.stages);
    const double units = 1.0 / state.header.lattice.step();
    TrackedFitOptions options;
    options.stray = std::max(stray_in_edges * edge, 1.0);
    options.reach = std::max(reach * units, options.stray);
    options.region = region * units;
    options.threads = state.threads;
    const auto out = measure_tracked_fit(target, decoded, intra_squared, options);
    clock.done("fit of the tracking");
    return out;
}

const FrameMotion& motion_of(State& state, FrameUnderWay& frame) {
    if (!frame.motion) {
        auto& group = *state.group;
        if (!group.search) group.search = make_reference_search(group.reference);
        const MotionReference against{&group.reference, &*group.search, &state.header.skeleton.bones,
                                      state.header.radii, group.motion};
        frame.motion = find_frame_motion(frame.mesh.positions, frame.pose, against, registration_options(state),
                                         state.threads, state.stages);
    }
    return *frame.motion;
}

const AnimationFit& fit_of(State& state, FrameUnderWay& frame) {
    if (!frame.fit) {
        const auto& predicted = motion_of(state, frame).predicted;
        StageClock clock(state.stages);
        const bool checked = state.options.topology.animation_error > 0 || state.options.rate.target_error > 0 ||
                             state.options.topology.frame_choice == FrameChoice::rate_distortion;
        frame.fit = measure_animation(frame.mesh, state.group->reference, predicted, checked, state.threads);
        clock.done("fit of the animation");
    }
    return *frame.fit;
}

Result<FrameCandidate> encode_intra(State& state, FrameUnderWay& frame, const FrameSteps& steps) {
    const bool tracked = state.options.profile == Profile::tracked;
    const auto asked = tracked ? tracked_steps(steps) : steps;
    LatticeMesh simplified;
    if (tracked && state.options.tracked.simplify > 0) {
        const auto& target = target_of(state, frame);
        StageClock clock(state.stages);
        simplified = simplified_reference(frame.mesh, target, simplification(state, steps));
        clock.done("simplification");
    }
    const auto& mesh = tracked && state.options.tracked.simplify > 0 ? simplified : frame.mesh;
    StageClock clock(state.stages);
    IntraFrameOptions options;
    const double edge = mean_edge(frame.mesh);
    options.geometry_step =
        state.options.key_interval == 1 ? asked.geometry : step_for_reference(mean_edge(mesh), asked.geometry);
    options.colour_step = asked.colour;
    options.merge_duplicates = state.options.topology.merge_duplicates;
    options.external = state.options.intra_coder ? &*state.options.intra_coder : nullptr;
    FramePayload payload;
    auto decoded = encode_intra_frame(mesh, options, payload);
    if (!decoded) return tl::unexpected(decoded.error());
    payload.header.source_vertices = static_cast<std::uint32_t>(frame.mesh.positions.size());
    payload.header.source_triangles = static_cast<std::uint32_t>(frame.mesh.triangles.size());
    payload.set(Layer::pose, encode_pose(frame.pose));
    FrameCandidate out;
    out.type = FrameType::intra;
    out.decoded = std::move(*decoded);
    out.pose = frame.pose;
    out.edge = edge;
    out.intra_step = options.geometry_step;
    out.packets.push_back(frame_packet(PacketKind::intra, payload));
    clock.done("intra coding");
    if (tracked && state.options.key_interval > 1) out.fit = tracked_fit(state, frame, out.decoded, edge, {});
    return out;
}

FrameCandidate encode_predicted(State& state, FrameUnderWay& frame) {
    const auto& motion = motion_of(state, frame);
    const auto& reference = state.group->reference;
    FrameCandidate out;
    out.type = FrameType::predicted;
    out.packets.push_back(frame_packet(
        PacketKind::predicted,
        predicted_frame_payload(reference, motion.transforms, static_cast<std::uint32_t>(frame.mesh.positions.size()),
                                static_cast<std::uint32_t>(frame.mesh.triangles.size()))));
    out.decoded = animate(reference, motion.transforms, motion.predicted);
    out.motion = motion.motion;
    out.codebooks = state.group->codebooks;
    return out;
}

FrameCandidate encode_enhanced(State& state, FrameUnderWay& frame, const FrameSteps& steps) {
    motion_of(state, frame);
    return encode_residual_frame(state, frame, source_of(state, frame), steps);
}

FrameCandidate encode_moving(State& state, FrameUnderWay& frame, const FrameSteps& steps,
                             const std::vector<bool>& coded_bones) {
    const auto& fit = fit_of(state, frame);
    StageClock clock(state.stages);
    constexpr double stray_in_edges = 4;
    const auto part = cut_moving_part(frame.mesh, frame.motion->bone_of_vertex, state.group->reference, fit,
                                      coded_bones, stray_in_edges * state.group->edge);
    clock.done("cutting");
    auto source = source_of(state, frame);
    source.mesh = &part.mesh;
    source.bone_of_vertex = part.bone_of_vertex;
    source.nearest = part.nearest;
    source.coded_bones = coded_bones;
    auto out = encode_residual_frame(state, frame, source, steps);
    out.in_part = true;
    return out;
}

FrameCandidate encode_coded_bones(State& state, FrameUnderWay& frame, const FrameSteps& steps,
                                  const std::vector<bool>& coded) {
    if (std::find(coded.begin(), coded.end(), true) == coded.end()) return encode_predicted(state, frame);
    bool something = false, everything = true;
    for (std::size_t bone = 0; bone < coded.size(); ++bone) {
        const bool bare = state.group->reference.sub_meshes.of(bone).empty();
        something = something || (coded[bone] && !bare);
        everything = everything && (coded[bone] || bare);
    }
    return everything || !something ? encode_enhanced(state, frame, steps) : encode_moving(state, frame, steps, coded);
}

Result<FrameCandidate> encode_tracked(State& state, FrameUnderWay& frame, const FrameSteps& steps) {
    auto& group = *state.group;
    TrackedFrameOptions options;
    options.deformation = deformation_options(state);
    // Re-meshing alone makes colours at the same place differ from frame to frame: finer steps would code that noise.
    constexpr double coarser_colours = 6;
    options.geometry_step = tracked_steps(steps).geometry;
    options.colour_step = coarser_colours * steps.colour;
    options.lambda = state.options.lambda;
    options.threads = state.threads;
    if (!group.tracked) {
        StageClock clock(state.stages);
        auto reference = make_tracked_reference(group.reference.mesh, state.header.node_spacing, group.intra_step);
        if (!reference) return tl::unexpected(reference.error());
        group.tracked = make_tracked_group(std::move(*reference), options.deformation);
        clock.done("deformation graph");
    }
    const bool refer_to_last = group.last_tracked && state.options.tracked.references == TrackedReferences::previous;
    auto encoded = encode_tracked_frame(frame.mesh, target_of(state, frame), *group.tracked, refer_to_last,
                                        skeletal_node_motion(state, frame), options, state.stages);
    if (!encoded) return tl::unexpected(encoded.error());
    FrameCandidate out;
    out.type = FrameType::tracked;
    out.reference = refer_to_last ? *group.last_tracked : group.reference.frame;
    out.packets.push_back(frame_packet(PacketKind::tracked, encoded->payload));
    out.decoded = std::move(encoded->mesh);
    out.motion = std::move(encoded->motion);
    out.tracked = std::move(encoded->state);
    return out;
}

void adopt(State& state, const FrameCandidate& candidate) {
    StageClock clock(state.stages);
    const auto bytes = static_cast<double>(candidate.bytes());
    if (candidate.type == FrameType::intra) {
        Group group;
        group.reference = make_reference(candidate.decoded, state.header.skeleton.bones, candidate.pose.joints,
                                         candidate.pose.orientations, state.header.radii, state.header.weight_width,
                                         state.next_frame, state.threads);
        group.edge = candidate.edge;
        group.intra_step = candidate.intra_step;
        group.plain_intra = candidate.plain_intra;
        group.intra_fit = candidate.fit;
        group.steps = candidate.steps;
        group.intra_bytes = bytes;
        state.group = std::move(group);
    } else {
        auto& group = *state.group;
        if (candidate.type == FrameType::tracked) {
            group.tracked->before_last = std::move(group.tracked->last);
            group.tracked->last = candidate.motion;
            group.tracked->state = candidate.tracked;
            group.last_tracked = state.next_frame;
            if (group.best_fit == 0 || candidate.fit.rms < group.best_fit) group.best_fit = candidate.fit.rms;
        } else {
            group.motion = candidate.motion;
            group.codebooks = candidate.codebooks;
        }
        if (candidate.type == FrameType::enhanced && !candidate.in_part) {
            if (group.least_bytes == 0 || bytes < group.least_bytes) group.least_bytes = bytes;
            group.excess_bytes += bytes - group.least_bytes;
        }
    }
    state.decoded = candidate.decoded;
    state.distance_order_counts = candidate.distance_order_counts;
    clock.done("reference");
}

}  // namespace htvm::internal
