#include "codec/encoder/tracked/tracked_coders.h"

#include <algorithm>
#include <cmath>

#include "codec/encoder/charts/captured_detail.h"
#include "codec/encoder/charts/chart_packing.h"
#include "codec/encoder/level_colours.h"
#include "codec/encoder/leveled_intra.h"
#include "codec/intra/intra_frame.h"
#include "codec/tracked/frame_group.h"
#include "codec/tracked/presence.h"

namespace htvm::internal {
namespace {

enum class IntraUse : std::uint8_t { reference, none };  // whether later frames may refer to it

// The steps at which the simplified I-frame and its T-frames have about the same error as other frames have at the
// steps asked for; docs/experiments/colour_steps.md has measurements.
FrameSteps tracked_steps(const FrameSteps& steps) {
    const auto scaled = [](double factor, std::int32_t step) {
        return std::max(1, static_cast<std::int32_t>(std::lround(factor * step)));
    };
    constexpr std::int32_t coarsest_colours = 255;  // the largest step that a frame header can hold
    return {scaled(tracking_numbers.finer, steps.geometry),
            std::min(scaled(tracking_numbers.coarser_colours, steps.colour), coarsest_colours)};
}

LatticeMesh simplified(const TrackedWork& work, const FrameSteps& steps) {
    StageClock clock(work.stages);
    auto out =
        simplified_reference(work.captured.mesh, work.surface, simplification_options(work.configuration, steps));
    clock.done("simplification");
    return out;
}

struct Charts {
    TexturedSurface textured;  // empty where the stream has no charts, or the mesh no triangles
    std::uint32_t scale = 0;
};

Result<Charts> add_charts(const LatticeMesh& mesh, const SurfaceDetail& detail, const SurfaceIndex& captured,
                          const StreamTexture& texture, FramePayload& payload) {
    if (texture.layout != TextureLayout::charts || mesh.triangles.empty()) return Charts();
    auto placed = lay_out(mesh.positions, mesh.triangles, texture, captured_detail(mesh.positions, captured));
    if (!placed) return tl::unexpected(placed.error());
    payload.set(Layer::charts, std::move(placed->layer));
    auto textured = textured_surface(mesh.positions.size(), mesh.triangles, std::move(placed->corners), detail,
                                     detail.levels.size());
    if (!textured) return tl::unexpected(textured.error());
    return Charts{std::move(*textured), placed->scale};
}

// The patched mesh with the charts of what stays and new ones for the piece; nothing if the picture has no room.
std::optional<TexturedSurface> add_charts_of_piece(const PatchedSurface& patched, const SurfaceDetail& detail,
                                                   const Reference& before, const StreamTexture& texture,
                                                   std::uint32_t scale, FramePayload& payload) {
    if (before.textured.empty()) return TexturedSurface();
    const auto& mesh = patched.mesh;
    auto corners = corners_that_stay(before.textured.corners, before.mesh().triangles, before.mesh().positions.size(),
                                     patched.stays);
    const auto piece = std::span(mesh.triangles).subspan(corners.size());
    if (!piece.empty()) {
        auto placed = lay_out_beside(mesh.positions, piece, texture, corners, scale);
        if (!placed) return std::nullopt;
        payload.set(Layer::charts, std::move(placed->layer));
        corners.insert(corners.end(), placed->corners.begin(), placed->corners.end());
    }
    auto textured =
        textured_surface(mesh.positions.size(), mesh.triangles, std::move(corners), detail, detail.levels.size());
    return textured ? std::optional(std::move(*textured)) : std::nullopt;
}

// What an I-frame is made of: the capture, simplified or not, or the tracked mesh, and what of that is there.
struct IntraSource {
    const LatticeMesh& mesh;
    Presence presence = {};
    bool renewal = false;
};

// Tells which vertices of a coded mesh are there, from what is of the mesh that it was made of: an intra coder orders
// vertices as it will, so they are told by their places. One of several at a place is enough.
Presence presence_by_place(const IntraSource& source, const LatticeMesh& coded, std::int32_t step) {
    std::vector<LatticePoint> there;
    for (std::size_t v = 0; v < source.presence.size(); ++v)
        if (source.presence[v] != 0) there.push_back(to_grid(source.mesh.positions[v], step));
    std::ranges::sort(there);
    Presence out;
    for (const auto& p : coded.positions) out.push_back(std::ranges::binary_search(there, to_grid(p, step)) ? 1 : 0);
    return out;
}

// The frame that a coded mesh becomes, with its charts. steps: asked for.
Result<TrackedIntra> sent_as(const TrackedWork& work, CodedIntra coded, Presence presence, bool renewal,
                             const FrameSteps& steps, FrameReason reason) {
    const auto& configuration = work.configuration;
    StageClock clock(work.stages);
    auto charts = add_charts(coded.decoded, coded.detail, work.surface, configuration.options.texture, coded.payload);
    if (!charts) return tl::unexpected(charts.error());
    TrackedIntra out;
    out.step = coded.step;
    out.pose = work.captured.pose;
    auto& frame = out.frame;
    frame.type = FrameType::intra;
    frame.reference = work.sequence.next_frame;
    frame.textured = std::move(charts->textured);
    frame.projection = work.captured.projection;
    if (frame.projection) coded.payload.set(Layer::charts, write_projection_layer(*frame.projection));
    frame.decoded = std::move(coded.decoded);
    frame.detail = std::move(coded.detail);
    frame.presence = std::move(presence);
    frame.captured = counts_of(work.captured.mesh);
    frame.of_tracked_mesh = renewal;
    // Under rate control also what stands in for a frame that does not fit may refer to it.
    frame.referred = carries_surface(work.captured.mesh) && !frame.decoded.triangles.empty() &&
                     (!configuration.intra_only() || configuration.options.rate.bits_per_second > 0);
    frame.packets.push_back(frame_packet(PacketKind::intra, std::move(coded.payload), reason));
    auto& origin = out.origin;
    origin.edge = mean_edge(work.captured.mesh.positions, work.captured.mesh.triangles);
    origin.steps = steps;
    origin.chart_scale = charts->scale;
    origin.vertices = frame.decoded.positions.size();
    clock.done("intra coding");
    return out;
}

// What tracking measures frames by that refer to this one.
void prepare_reference(const TrackedWork& work, TrackedIntra& intra) {
    auto& origin = intra.origin;
    StageClock clock(work.stages);
    origin.colours = colours_at(work, intra.frame.decoded);
    clock.done("intra coding");
    if (intra.frame.referred) origin.fit = fit_of(work, intra.frame.decoded, origin.edge, {});
}

// steps: asked for.
Result<TrackedIntra> code_intra_of(const TrackedWork& work, const IntraSource& source, const FrameSteps& steps,
                                   FrameSteps quantised, IntraUse use, FrameReason reason) {
    const auto& configuration = work.configuration;
    const auto captured = counts_of(work.captured.mesh);
    const bool referred_to = use == IntraUse::reference;
    StageClock clock(work.stages);
    if (referred_to)
        quantised.geometry =
            step_for_reference(mean_edge(source.mesh.positions, source.mesh.triangles), quantised.geometry);
    auto coded = code_intra_mesh(configuration, source.mesh, quantised, source.renewal, captured, work.captured.pose);
    if (!coded) return tl::unexpected(coded.error());
    Presence presence;
    if (anything_absent(source.presence)) {
        presence = presence_by_place(source, coded->decoded, quantised.geometry);
        coded->payload.set(Layer::presence, write_presence_layer(coded->decoded.triangles, presence));
    }
    clock.done("intra coding");
    return sent_as(work, std::move(*coded), std::move(presence), source.renewal, steps, reason);
}

// The capture as a base and its levels. Nothing if the detail would have too many vertices.
Result<std::optional<TrackedIntra>> code_levels(const TrackedWork& work, const FrameSteps& steps, FrameReason reason) {
    const auto& configuration = work.configuration;
    const auto& source = work.captured.mesh;
    const auto quantised = tracked_steps(steps);
    StageClock clock(work.stages);
    LeveledIntraOptions options;
    options.step = LatticeUnits(tracking_numbers.levels_step * quantised.geometry);
    if (!work.effort.thorough_levels) options.rounds = 3, options.choices = 2;
    options.threads = configuration.threads;
    auto leveled = encode_leveled_intra(source, options);
    if (!leveled) return tl::unexpected(leveled.error());
    CodedIntra coded;
    auto frame = put_leveled_intra(std::move(*leveled), tracking_numbers.referred_level, coded.payload);
    clock.done("levels");
    auto& mesh = coded.decoded = std::move(frame.mesh);
    coded.detail = std::move(frame.detail);
    const std::size_t coded_below =
        coded.detail.empty() ? 0 : options.levels - std::min(tracking_numbers.referred_level, options.levels);
    if (coded.detail.vertices() > most_detail * mesh.positions.size()) return std::optional<TrackedIntra>();
    const auto normals = vertex_normals(mesh.positions, mesh.triangles);
    if (!source.colours.empty()) {
        mesh.colours.resize(mesh.positions.size());
        const auto targets = find_tracked_targets(
            {mesh.positions, normals, mesh.triangles, mesh.colours, &coded.detail}, source, work.surface,
            {.reach = configuration.scale.on_lattice(tracking_numbers.reach), .threads = configuration.threads});
        mesh.colours = recoloured(mesh.colours, targets.colours);
    }
    if (!source.normals.empty()) mesh.normals = quantised_normals(normals);
    if (auto ok = encode_intra_attributes(mesh, quantised.colour, coded.payload, configuration.threads); !ok)
        return tl::unexpected(ok.error());
    if (!mesh.colours.empty() && coded_below > 0) {
        LevelColourOptions colour_options;
        colour_options.step = quantised.colour;
        colour_options.reach = configuration.scale.on_lattice(tracking_numbers.reach).value;
        colour_options.threads = configuration.threads;
        coded.payload.set(Layer::level_colours,
                          encode_level_colours(mesh, source, work.surface, coded_below, colour_options, coded.detail));
    }
    tell_captured(coded.payload, counts_of(source), work.captured.pose);
    clock.done("intra coding");
    auto sent = sent_as(work, std::move(coded), {}, false, steps, reason);
    if (!sent) return tl::unexpected(sent.error());
    return std::optional(std::move(*sent));
}

// Whether I-frames that are referred to are coded as a base and its levels. simple: the capture, simplified; empty
// where it is not.
bool codes_levels(const TrackedWork& work, const LatticeMesh& simple) {
    const auto& configuration = work.configuration;
    const auto& options = configuration.options;
    const auto& mesh = work.captured.mesh;
    const auto wanted = options.tracked.levels;
    if (wanted == ReferenceLevels::off || (wanted == ReferenceLevels::automatic && !work.effort.levels)) return false;
    const bool with_charts = options.texture.layout == TextureLayout::charts && wanted == ReferenceLevels::automatic;
    const double most_kept =
        with_charts ? tracking_numbers.levels_most_kept_with_charts : tracking_numbers.levels_most_kept;
    return !options.intra_coder && (!configuration.tells_presence() || wanted == ReferenceLevels::on) &&
           options.texture.layout != TextureLayout::captured && !simple.positions.empty() && mesh.texcoords.empty() &&
           !configuration.intra_only() &&
           static_cast<double>(simple.positions.size()) <= most_kept * static_cast<double>(mesh.positions.size());
}

// What a coding of the same surface costs: the logarithm of bits where the error is equal.
double price_of(const TrackedWork& work, const CodedFrame& frame) {
    const auto errors = errors_shown(work, frame.decoded, frame.detail);
    return std::log(static_cast<double>(frame.bytes())) +
           tracking_numbers.bits_by_error * std::log(std::max(errors.geometry_rms, 1e-6));
}

Result<TrackedIntra> code_intra_of_capture(const TrackedWork& work, const FrameSteps& steps, IntraUse use,
                                           FrameReason reason) {
    const bool simplify = work.configuration.options.tracked.simplify > 0 && carries_surface(work.captured.mesh);
    const auto simple = simplify ? simplified(work, steps) : LatticeMesh{};
    auto flat = code_intra_of(work, {simplify ? simple : work.captured.mesh}, steps, tracked_steps(steps), use, reason);
    if (!flat || use != IntraUse::reference) return flat;
    auto& chosen = *flat;
    if (codes_levels(work, simple)) {
        auto leveled = code_levels(work, steps, reason);
        if (!leveled) return tl::unexpected(leveled.error());
        if (*leveled && price_of(work, (*leveled)->frame) < price_of(work, chosen.frame)) chosen = std::move(**leveled);
    }
    prepare_reference(work, chosen);
    return flat;
}

// Not where frames are to have an error that is measured against the capture, noise and all.
bool denoises(const Configuration& configuration) {
    return configuration.options.tracked.denoise == Denoising::automatic &&
           configuration.options.rate.target_error <= 0;
}

TargetFilterOptions filter_options(const TrackedWork& work) {
    const auto& origin = work.reference->origin;
    const auto steps = tracked_steps(origin.steps);
    return {LatticeUnits(steps.geometry), 1.0 * steps.colour, LatticeUnits(origin.edge)};
}

PresenceOptions presence_options(const Configuration& configuration) {
    const auto& tracked = configuration.options.tracked;
    PresenceOptions out;
    out.fill = tracked.fill == HoleFilling::automatic;
    out.leave_out_specks = tracked.specks == Specks::automatic;
    out.speck = configuration.scale.on_lattice(tracking_numbers.speck);
    return out;
}

// before: state of the frame that it refers to; null if that is the reference.
Result<EncodedTrackedFrame> encode(const TrackedWork& work, const NodeRegistration& registered, const FrameSteps& steps,
                                   MotionParts parts, const TrackedState* before,
                                   std::span<const std::uint32_t> near = {}) {
    const auto& configuration = work.configuration;
    auto options = tracked_frame_options(configuration, steps);
    if (denoises(configuration)) options.denoise = filter_options(work);
    options.keeps_noise = configuration.options.tracked.group > 1;
    options.motion_alone = parts == MotionParts::motion_alone;
    options.target_samples = work.effort.target_samples;
    options.near = near;
    options.projection = work.captured.projection;
    options.detail = &work.reference->decoded.detail;
    if (configuration.tells_presence()) {
        options.presence_options = presence_options(configuration);
        options.presence_before = &work.sequence.history.presence;
    }
    return encode_tracked_frame(work.captured.mesh, work.surface, *work.reference->decoded.by_nodes, registered, before,
                                work.sequence.history.targets, options, work.stages);
}

}  // namespace

TrackedFrameOptions tracked_frame_options(const Configuration& configuration, const FrameSteps& steps) {
    TrackedFrameOptions out;
    out.scale = configuration.scale;
    out.geometry_step = LatticeUnits(tracked_steps(steps).geometry);
    out.colour_step = tracking_numbers.coarser_tracked_colours * steps.colour;
    out.lambda = configuration.options.lambda;
    out.reach = configuration.scale.on_lattice(tracking_numbers.reach);
    out.threads = configuration.threads;
    return out;
}

SimplifiedReferenceOptions simplification_options(const Configuration& configuration, const FrameSteps& steps) {
    SimplifiedReferenceOptions out;
    out.surface_error = configuration.options.tracked.simplify * LatticeUnits(steps.geometry);
    out.colour_error = tracking_numbers.simplified_colours * steps.colour;
    out.longest_edge = configuration.scale.on_lattice(tracking_numbers.longest_edge);
    out.reach = configuration.scale.on_lattice(tracking_numbers.reach);
    out.threads = configuration.threads;
    if (!configuration.tells_presence()) return out;
    const auto presence = presence_options(configuration);
    if (presence.fill) out.filled_holes = configuration.scale.on_lattice(tracking_numbers.filled_hole);
    if (presence.leave_out_specks) out.specks = presence.speck;
    return out;
}

Result<TrackedIntra> code_intra(const TrackedWork& work, const FrameSteps& steps, FrameReason reason) {
    return code_intra_of_capture(work, steps, IntraUse::reference, reason);
}

Result<TrackedIntra> code_unreferred_intra(const TrackedWork& work, const FrameSteps& steps, FrameReason reason) {
    return code_intra_of_capture(work, steps, IntraUse::none, reason);
}

namespace {

// Without what was not seen for long, where surface comes and goes.
LatticeMesh seen_lately(const EncodedTrackedFrame& tracked, Presence& presence) {
    const auto& unseen = tracked.presence.unseen;
    const auto& whole = tracked.mesh;
    std::vector<std::uint32_t> kept, number(whole.positions.size(), OrientedPoints::no_point);
    presence.clear();
    for (std::uint32_t v = 0; v < whole.positions.size(); ++v) {
        if (tracked.state.presence[v] == 0 && unseen[v] > tracking_numbers.forgotten_after) continue;
        number[v] = static_cast<std::uint32_t>(kept.size());
        kept.push_back(v);
        presence.push_back(tracked.state.presence[v]);
    }
    auto out = kept_vertices(whole, kept);
    for (const auto& t : whole.triangles)
        if (const Triangle own{number[t[0]], number[t[1]], number[t[2]]};
            std::ranges::find(own, OrientedPoints::no_point) == own.end())
            out.triangles.push_back(own);
    return out;
}

}  // namespace

Result<TrackedIntra> code_renewal(const TrackedWork& work, const FrameSteps& steps, const EncodedTrackedFrame& tracked,
                                  FrameReason reason) {
    auto quantised = tracked_steps(steps);
    quantised.geometry =
        std::max(1, static_cast<std::int32_t>(std::lround(tracking_numbers.finer_renewed * quantised.geometry)));
    Presence presence;
    const bool tells_presence = !tracked.presence.unseen.empty();
    const auto lately = tells_presence ? seen_lately(tracked, presence) : LatticeMesh{};
    auto out = code_intra_of(work, {tells_presence ? lately : tracked.mesh, std::move(presence), true}, steps,
                             quantised, IntraUse::reference, reason);
    if (!out) return out;
    prepare_reference(work, *out);
    const auto& before = work.reference->origin;
    out->origin.fit = least_of(std::move(out->origin.fit), before.fit);
    out->origin.vertices = before.vertices;
    return out;
}

Result<CodedMotion> code_motion(const TrackedWork& work, const NodeRegistration& registered, const FrameSteps& steps,
                                MotionParts parts) {
    const auto& options = work.configuration.options.tracked;
    const auto& history = work.sequence.history;
    // Now and then a place to start from, for whoever has the reference.
    const auto since = work.sequence.next_frame - std::max(work.reference->decoded.number, history.access.value_or(0));
    const bool from_last = history.frame && !work.captured.force_access &&
                           options.references == TrackedReferences::previous &&
                           std::int64_t{since} < options.access_interval;
    auto encoded = encode(work, registered, steps, parts, from_last ? &history.state : nullptr);
    if (!encoded) return tl::unexpected(encoded.error());
    const auto& payload = encoded->runs.payload;
    const bool grouped = work.configuration.header.version >= grouped_version;
    auto packet = frame_packet(PacketKind::tracked,
                               grouped ? write_group_payload({.length = 1, .frame = 1}, {&payload, 1}) : payload);
    return CodedMotion{std::move(*encoded), std::move(packet), steps, !from_last};
}

TrackedMotion chosen_motion(const TrackedWork& work, const NodeRegistration& registered, CodedMotion coded,
                            LatticeUnits best_fit) {
    const auto& before = work.sequence.history;
    TrackedMotion out;
    auto& frame = out.frame;
    frame.type = FrameType::tracked;
    frame.reference = coded.of_reference ? work.reference->decoded.number : *before.frame;
    frame.referred = work.configuration.options.tracked.references == TrackedReferences::previous;
    frame.access = coded.of_reference;
    frame.packets.push_back(std::move(coded.packet));
    frame.decoded = std::move(coded.encoded.mesh);
    frame.presence = coded.encoded.state.presence;
    frame.projection = work.captured.projection;
    frame.captured = counts_of(work.captured.mesh);
    frame.shares = coded.encoded.runs.shares;
    out.steps = coded.steps;
    out.noise = std::move(coded.encoded.noise);
    auto& history = out.history;
    history.frame = work.sequence.next_frame;
    history.access = coded.of_reference ? history.frame : before.access;
    history.before_last = before.last;
    history.last = registered.motion;
    history.state = std::move(coded.encoded.state);
    history.targets = std::move(coded.encoded.targets);
    history.presence = std::move(coded.encoded.presence);
    history.present_before_last = before.presence.shown;
    history.best_fit = best_fit;
    return out;
}

Result<EncodedTrackedFrame> code_for_patches(const TrackedWork& work, const NodeRegistration& registered,
                                             const FrameSteps& steps, std::span<const std::uint32_t> near) {
    return encode(work, registered, steps, MotionParts::all, nullptr, near);
}

Result<std::optional<TrackedPatch>> code_patch(const TrackedWork& work, const NodeRegistration& registered,
                                               const FrameSteps& steps, const EncodedTrackedFrame& tracked,
                                               const SurfacePatch& patch, FrameReason reason) {
    const auto& reference = *work.reference;
    const auto& by_nodes = *reference.decoded.by_nodes;
    StageClock clock(work.stages);
    const auto quantised = tracked_steps(steps);
    FramePayload payload;
    const auto& mesh = tracked.mesh;
    auto patched = encode_patch({mesh.positions, mesh.triangles, mesh.colours}, by_nodes.hierarchy, patch,
                                {quantised.geometry, quantised.colour}, payload);
    if (!patched) return tl::unexpected(patched.error());
    const auto captured = counts_of(work.captured.mesh);
    const auto vertices = patched->mesh.positions.size();
    payload.header.source_vertices = captured.vertices;
    payload.header.source_triangles = captured.triangles;
    payload.set(Layer::tracked, tracked.runs.payload);
    payload.set(Layer::pose, encode_pose(work.captured.pose));
    smooth_what_is_new(*patched, quantised.geometry, !mesh.normals.empty());
    auto detail = detail_that_stays(reference.decoded.detail, mesh.positions.size(), patched->stays, patched->mesh);
    auto textured = add_charts_of_piece(*patched, detail, reference.decoded, work.configuration.options.texture,
                                        reference.origin.chart_scale, payload);
    if (!textured) return std::optional<TrackedPatch>();
    TrackedPatch out;
    auto& frame = out.frame;
    frame.type = FrameType::patched;
    frame.reference = reference.decoded.number;
    frame.referred = true;
    frame.textured = std::move(*textured);
    frame.projection = work.captured.projection;
    frame.renewed =
        vertices > 0 ? static_cast<double>(vertices - patched->stays.size()) / static_cast<double>(vertices) : 0;
    frame.decoded = std::move(patched->mesh);
    frame.detail = std::move(detail);
    if (by_nodes.has_presence) {
        frame.presence = presence_of_patched(tracked.state.presence, patched->stays, vertices);
        out.presence = on_new_reference(tracked.presence, patched->stays, vertices);
    }
    frame.captured = captured;
    frame.packets.push_back(frame_packet(PacketKind::patched, std::move(payload), reason));
    if (denoises(work.configuration))
        out.targets = on_new_reference(tracked.targets, patched->stays, vertices, filter_options(work));
    out.kept = keep_nodes(by_nodes.nodes, patched->stays);
    out.pose = work.captured.pose;
    out.before_last = work.sequence.history.last;
    if (out.before_last.empty()) out.before_last.resize(registered.motion.size());
    out.last = registered.motion;
    auto& origin = out.origin = reference.origin;
    origin.steps = steps;
    origin.edge = mean_edge(work.captured.mesh.positions, work.captured.mesh.triangles);
    origin.colours = colours_at(work, frame.decoded);
    clock.done("patch coding");
    std::vector<std::uint32_t> near(vertices, OrientedPoints::no_point);
    std::vector<std::uint8_t> seen(tracked.seen.empty() ? 0 : vertices, 1);
    for (std::size_t i = 0; i < patched->stays.size(); ++i) {
        near[i] = tracked.near[patched->stays[i]];
        if (!seen.empty()) seen[i] = tracked.seen[patched->stays[i]];
    }
    origin.fit = fit_of(work, frame.decoded, origin.edge, {.near = near, .seen = seen});
    return std::optional(std::move(out));
}

}  // namespace htvm::internal
