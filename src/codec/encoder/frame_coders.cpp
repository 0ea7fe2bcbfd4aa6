#include "codec/encoder/frame_coders.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "codec/bones/animated_frame.h"
#include "codec/encoder/charts/chart_packing.h"
#include "codec/encoder/tracked/captured_surface.h"
#include "codec/format/sequence.h"
#include "codec/intra/intra_frame.h"
#include "codec/tracked/frame_group.h"

namespace htvm::internal {
namespace {

enum class IntraUse : std::uint8_t { reference, alone };       // whether later frames may refer to it
enum class TrackedParts : std::uint8_t { all, motion_alone };  // what of a T-frame is sent

Packet frame_packet(PacketKind kind, std::vector<std::uint8_t> payload) {
    Packet packet;
    packet.kind = kind;
    packet.payload = std::move(payload);
    return packet;
}
Packet frame_packet(PacketKind kind, const FramePayload& payload) {
    return frame_packet(kind, write_frame_payload(payload));
}

std::uint32_t count(std::size_t n) { return static_cast<std::uint32_t>(n); }

CapturedCounts counts_of(const LatticeMesh& captured) {
    return {count(captured.positions.size()), count(captured.triangles.size())};
}

// If EP-frames refer to an I-frame, its step is at most half an edge: EP-frames then save more than the finer step
// costs. Their quantiser starts from the same cells, but the price of a bit stays that of the step asked for, so that
// only the entropy constraint makes it coarser. At 8 mm and 35,000 vertices this takes a fifth fewer bits at the same
// error.
std::int32_t step_for_reference(double edge, std::int32_t step) {
    const double half_edge = edge / 2;
    return half_edge >= 1 && half_edge < step ? static_cast<std::int32_t>(half_edge) : step;
}

// The steps at which the simplified I-frame and its T-frames have about the same error as other frames have at the
// steps asked for; docs/algorithm.md gives the measurements.
FrameSteps tracked_steps(const FrameSteps& steps) {
    constexpr double finer = 0.55, coarser_colours = 1.3;
    const auto scaled = [](double factor, std::int32_t step) {
        return std::max(1, static_cast<std::int32_t>(std::lround(factor * step)));
    };
    constexpr std::int32_t coarsest_colours = 255;  // the largest step that a frame header can hold
    return {scaled(finer, steps.geometry), std::min(scaled(coarser_colours, steps.colour), coarsest_colours)};
}

LatticeMesh simplified(FrameWork& work, const FrameSteps& steps) {
    const auto& surface = work.surface();
    StageClock clock(work.stages);
    auto out = simplified_reference(work.mesh, surface, simplification_options(work.configuration, steps));
    clock.done("simplification");
    return out;
}

EnhancedFrameOptions enhanced_options(const Configuration& configuration, const ReferenceInUse& reference,
                                      const FrameSteps& steps) {
    const auto& options = configuration.options;
    EnhancedFrameOptions out;
    out.geometry.step = step_for_reference(reference.intra.edge, steps.geometry);
    out.colour.step = steps.colour;
    const double ratio = static_cast<double>(steps.geometry) / out.geometry.step;
    out.geometry.lambda = options.lambda * ratio * ratio;
    out.colour.lambda = options.lambda;
    out.geometry.threads = out.colour.threads = out.threads = configuration.threads;
    out.reference_choice =
        options.topology.reference_vertices == ReferenceVertices::bone ? ReferenceChoice::bone : ReferenceChoice::any;
    out.merge_duplicates = options.topology.merge_duplicates;
    out.nearest_vertices = options.topology.nearest_vertices;
    return out;
}

// Sends new codebooks and, from time to time, repeats the current one: if a packet is lost, the frames that use the
// codebook are lost too, but not for long. Every tenth frame costs 0.2 to 0.4 % of the bits.
void send_codebook(std::uint32_t frame, std::uint8_t purpose, CodebookInUse& use, std::vector<Packet>& packets) {
    constexpr std::uint32_t repeated_after = 10;  // frames
    if (!use.codebook || (!use.is_new && frame - use.sent < repeated_after)) return;
    use.sent = frame;
    Packet packet;
    packet.kind = PacketKind::codebook;
    packet.flags = purpose == codebook_for_colour ? packet_flag::colour : 0;
    packet.payload = write_codebook_payload(purpose, use.number, *use.codebook);
    packets.push_back(std::move(packet));
}

EnhancedFrameSource whole_frame(const LatticeMesh& mesh, const FrameMotion& motion, const ReferenceInUse& reference) {
    EnhancedFrameSource out;
    out.mesh = &mesh;
    out.bone_of_vertex = motion.bone_of_vertex;
    out.motion = &motion;
    out.reference = &reference.decoded.skinned;
    out.search = &reference.search;
    out.source_vertices = count(mesh.positions.size());
    out.source_triangles = count(mesh.triangles.size());
    return out;
}
EnhancedFrameSource whole_frame(FrameWork& work) {
    return whole_frame(work.mesh, work.bone_motion(), work.reference());
}

// Compares whole EP-frames with the cheapest since the I-frame: see intra_is_paid_for() in choice/frame_choice.cpp.
void count_bytes(BoneHistory& history, double bytes) {
    if (history.least_bytes == 0 || bytes < history.least_bytes) history.least_bytes = bytes;
    history.excess_bytes += bytes - history.least_bytes;
}

Candidate code_residuals(FrameWork& work, const EnhancedFrameSource& source, QuantisedFrame quantised,
                         const FrameSteps& steps) {
    Candidate out;
    out.type = FrameType::enhanced;
    out.reference = work.reference().decoded.number;
    auto& history = out.bones.emplace(work.sequence.bones);
    const auto before = std::exchange(history.codebooks, quantised.codebooks);
    history.codebooks.geometry.sent = before.geometry.sent;
    history.codebooks.colour.sent = before.colour.sent;
    auto encoded = encode_enhanced_frame(source, std::move(quantised),
                                         enhanced_options(work.configuration, work.reference(), steps), work.stages);
    history.motion = work.bone_motion().motion;
    send_codebook(work.sequence.next_frame, codebook_for_geometry, history.codebooks.geometry, out.packets);
    send_codebook(work.sequence.next_frame, codebook_for_colour, history.codebooks.colour, out.packets);
    out.packets.push_back(frame_packet(PacketKind::enhanced, encoded.payload));
    out.decoded = std::move(encoded.mesh);
    out.distance_order_counts = std::move(encoded.distance_order_counts);
    return out;
}

Candidate code_moving_part(FrameWork& work, const FrameSteps& steps, const std::vector<bool>& coded_bones) {
    const auto& fit = work.animation_fit();
    StageClock clock(work.stages);
    constexpr double stray_in_edges = 4;
    const auto part = cut_moving_part(work.mesh, work.bone_motion().bone_of_vertex, work.reference().decoded.skinned,
                                      fit, coded_bones, stray_in_edges * work.reference().intra.edge);
    clock.done("cutting");
    auto source = whole_frame(work);
    source.mesh = &part.mesh;
    source.bone_of_vertex = part.bone_of_vertex;
    source.nearest = part.nearest;
    source.coded_bones = coded_bones;
    auto quantised =
        quantise_enhanced_frame(source, work.sequence.bones.codebooks,
                                enhanced_options(work.configuration, work.reference(), steps), work.stages);
    return code_residuals(work, source, std::move(quantised), steps);
}

struct Charts {
    TexturedSurface textured;  // empty where the stream has no charts, or the mesh no triangles
    std::uint32_t scale = 0;
};

Result<Charts> add_charts(const LatticeMesh& mesh, const StreamTexture& texture, FramePayload& payload) {
    if (texture.layout != TextureLayout::charts || mesh.triangles.empty()) return Charts();
    auto placed = lay_out(mesh.positions, mesh.triangles, texture);
    if (!placed) return tl::unexpected(placed.error());
    payload.set(Layer::charts, std::move(placed->layer));
    auto textured = textured_surface(mesh.positions.size(), mesh.triangles, std::move(placed->corners));
    if (!textured) return tl::unexpected(textured.error());
    return Charts{std::move(*textured), placed->scale};
}

// The patched mesh with the charts of what stays and new ones for the piece; nothing if the picture has no room.
std::optional<TexturedSurface> add_charts_of_piece(const PatchedSurface& patched, const Reference& before,
                                                   const StreamTexture& texture, std::uint32_t scale,
                                                   FramePayload& payload) {
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
    auto textured = textured_surface(mesh.positions.size(), mesh.triangles, std::move(corners));
    return textured ? std::optional(std::move(*textured)) : std::nullopt;
}

// renewed: the tracked mesh, which is coded instead of the capture; or null.
Result<Candidate> code_intra(FrameWork& work, const FrameSteps& steps, IntraUse use,
                             const LatticeMesh* renewed = nullptr) {
    const auto& configuration = work.configuration;
    const bool tracked = configuration.tracked(), referred_to = use == IntraUse::reference;
    auto asked = tracked ? tracked_steps(steps) : steps;
    // What is quantised already would err twice as far, and jump.
    constexpr double finer_again = 0.5;
    if (renewed) asked.geometry = std::max(1, static_cast<std::int32_t>(std::lround(finer_again * asked.geometry)));
    const bool simplify = tracked && !renewed && configuration.options.tracked.simplify > 0 && work.carries_surface();
    // Without a skeleton EP-frames may never pay off, and then the bits of a finer I-frame would be wasted.
    const bool finer = referred_to && (configuration.header.skeleton_tracked || tracked ||
                                       configuration.options.topology.frame_choice != FrameChoice::cheaper);
    const auto simple = simplify ? simplified(work, steps) : LatticeMesh{};
    const auto& mesh = renewed ? *renewed : simplify ? simple : work.mesh;
    StageClock clock(work.stages);
    IntraFrameOptions options;
    options.geometry_step =
        finer ? step_for_reference(mean_edge(mesh.positions, mesh.triangles), asked.geometry) : asked.geometry;
    options.colour_step = asked.colour;
    options.merge_duplicates = configuration.options.topology.merge_duplicates;
    options.external = configuration.options.intra_coder ? &*configuration.options.intra_coder : nullptr;
    options.threads = configuration.threads;
    FramePayload payload;
    auto decoded = encode_intra_frame(mesh, options, payload);
    if (!decoded) return tl::unexpected(decoded.error());
    const auto step = smooth_as_shown(*decoded, options.geometry_step, renewed != nullptr, configuration.header);
    const auto captured = counts_of(work.mesh);
    payload.header.source_vertices = captured.vertices;
    payload.header.source_triangles = captured.triangles;
    payload.set(Layer::pose, encode_pose(work.pose));
    auto charts = add_charts(*decoded, configuration.options.texture, payload);
    if (!charts) return tl::unexpected(charts.error());
    Candidate out;
    out.textured = std::move(charts->textured);
    out.type = FrameType::intra;
    out.reference = work.sequence.next_frame;
    out.decoded = std::move(*decoded);
    out.captured = captured;
    // Under rate control also what stands in for a frame that does not fit may refer to it.
    out.referred = work.carries_surface() && !(tracked && out.decoded.triangles.empty()) &&
                   (!configuration.intra_alone() || configuration.options.rate.bits_per_second > 0);
    out.pose = work.pose;
    out.packets.push_back(frame_packet(PacketKind::intra, payload));
    auto& facts = out.intra.emplace();
    facts.step = step;
    facts.edge = work.edge();
    facts.steps = steps;
    facts.chart_scale = charts->scale;
    if (referred_to) facts.colours = work.colours_at(out.decoded);
    clock.done("intra coding");
    if (tracked && referred_to && out.referred) facts.fit = work.tracked_fit(out.decoded, facts.edge, {}, {});
    facts.vertices = out.decoded.positions.size();
    if (renewed) {
        const auto& before = work.reference().intra;
        facts.fit = least_of(std::move(facts.fit), before.fit);
        facts.vertices = before.vertices;
        out.renewal = true;
    }
    return out;
}

Result<Candidate> code_predicted(FrameWork& work) {
    const auto& motion = work.bone_motion();
    const auto& reference = work.reference().decoded;
    Candidate out;
    out.type = FrameType::predicted;
    out.reference = reference.number;
    out.packets.push_back(
        frame_packet(PacketKind::predicted,
                     predicted_frame_payload(reference.skinned, motion.transforms, count(work.mesh.positions.size()),
                                             count(work.mesh.triangles.size()))));
    out.decoded = animate(reference.skinned, motion.transforms, motion.predicted);
    out.bones.emplace(work.sequence.bones).motion = motion.motion;
    return out;
}

Result<Candidate> code_enhanced(FrameWork& work, const FrameSteps& steps) {
    auto quantised = std::exchange(work.quantised, std::nullopt);
    if (!quantised || quantised->steps != steps) quantised = quantise_whole(work, steps);
    auto out = code_residuals(work, whole_frame(work), std::move(quantised->frame), steps);
    count_bytes(*out.bones, static_cast<double>(out.bytes()));
    return out;
}

// Not where frames are to have an error that is measured against the capture, noise and all.
bool denoises(const Configuration& configuration) {
    return configuration.options.tracked.denoise == Denoising::automatic &&
           configuration.options.rate.target_error <= 0;
}

TargetFilterOptions filter_options(const FrameWork& work) {
    const auto& intra = work.reference().intra;
    const auto steps = tracked_steps(intra.steps);
    return {1.0 * steps.geometry, 1.0 * steps.colour, intra.edge};
}

// before: state of the frame that it refers to; null if that is the reference.
Result<EncodedTrackedFrame> encode_tracked(FrameWork& work, const FrameSteps& steps, TrackedParts parts,
                                           const TrackedState* before, std::span<const std::uint32_t> near = {}) {
    const auto& configuration = work.configuration;
    auto options = tracked_frame_options(configuration, steps);
    if (denoises(configuration)) options.denoise = filter_options(work);
    options.keeps_noise = configuration.options.tracked.group > 1;
    options.motion_alone = parts == TrackedParts::motion_alone;
    options.target_samples = work.effort.target_samples;
    options.near = near;
    return encode_tracked_frame(work.mesh, work.surface(), *work.reference().decoded.tracked, work.registered_nodes(),
                                before, work.sequence.nodes.targets, options, work.stages);
}

Result<Candidate> code_tracked(FrameWork& work, const FrameSteps& steps, TrackedParts parts) {
    const auto references = work.configuration.options.tracked.references;
    const auto& reference = work.reference().decoded;
    const auto& nodes = work.sequence.nodes;
    // Now and then a place to start from, for whoever has the reference.
    const auto since = work.sequence.next_frame - std::max(reference.number, nodes.access.value_or(0));
    const bool from_last = nodes.frame && references == TrackedReferences::previous &&
                           std::int64_t{since} < work.configuration.options.tracked.access_interval;
    auto encoded = encode_tracked(work, steps, parts, from_last ? &nodes.state : nullptr);
    if (!encoded) return tl::unexpected(encoded.error());
    if (!from_last && parts == TrackedParts::all) work.coded_alone = *encoded;
    Candidate out;
    out.type = FrameType::tracked;
    out.reference = from_last ? *nodes.frame : reference.number;
    out.referred = references == TrackedReferences::previous;
    out.access = !from_last;
    auto& payload = encoded->runs.payload;
    const bool grouped = work.configuration.header.version >= grouped_version;
    out.packets.push_back(frame_packet(
        PacketKind::tracked, grouped ? write_group_payload({.length = 1, .frame = 1}, {&payload, 1}) : payload));
    out.decoded = std::move(encoded->mesh);
    out.captured = counts_of(work.mesh);
    out.shares = encoded->runs.shares;
    out.steps = steps;
    out.noise = std::move(encoded->noise);
    out.near = std::move(encoded->near);
    auto& history = out.nodes.emplace();
    history.frame = work.sequence.next_frame;
    history.access = from_last ? nodes.access : history.frame;
    history.before_last = nodes.last;
    history.last = work.registered_nodes().motion;
    history.state = std::move(encoded->state);
    history.targets = std::move(encoded->targets);
    history.best_fit = nodes.best_fit;
    return out;
}

// By FrameType.
using FrameCoder = Result<Candidate> (*)(FrameWork& work, const FrameSteps& steps);
constexpr std::array<FrameCoder, frame_type_count - 1> frame_coders = {
    [](FrameWork& work, const FrameSteps& steps) { return code_intra(work, steps, IntraUse::reference); },
    code_enhanced,
    [](FrameWork& work, const FrameSteps&) { return code_predicted(work); },
    [](FrameWork& work, const FrameSteps& steps) { return code_tracked(work, steps, TrackedParts::all); },
};
// A TP-frame is coded by code_patched(), which needs a patch.
static_assert(frame_coders.size() == static_cast<std::size_t>(FrameType::patched));

}  // namespace

TrackedFrameOptions tracked_frame_options(const Configuration& configuration, const FrameSteps& steps) {
    // Re-meshing alone makes the colour at one place vary from frame to frame; finer steps would code that noise.
    constexpr double coarser_colours = 6, reach = 30;  // the reach in mm on an adult
    TrackedFrameOptions out;
    out.scale = {configuration.units, configuration.adult_millimetre};
    out.geometry_step = tracked_steps(steps).geometry;
    out.colour_step = coarser_colours * steps.colour;
    out.lambda = configuration.options.lambda;
    out.reach = reach * configuration.adult_millimetre;
    out.threads = configuration.threads;
    return out;
}

SimplifiedReferenceOptions simplification_options(const Configuration& configuration, const FrameSteps& steps) {
    constexpr double longest_edge = 40, reach = 30;  // mm on an adult
    constexpr double colour_steps = 2.5;
    SimplifiedReferenceOptions out;
    out.surface_error = configuration.options.tracked.simplify * steps.geometry;
    out.colour_error = colour_steps * steps.colour;
    out.longest_edge = longest_edge * configuration.adult_millimetre;
    out.reach = reach * configuration.adult_millimetre;
    out.threads = configuration.threads;
    return out;
}

Result<Candidate> code_frame(FrameType type, FrameWork& work, const FrameSteps& steps) {
    return frame_coders[static_cast<std::size_t>(type)](work, steps);
}

QuantisedWork quantise_whole(const Configuration& configuration, const ReferenceInUse& reference,
                             const LatticeMesh& mesh, const FrameMotion& motion, const Codebooks& before,
                             const FrameSteps& steps, std::vector<StageTime>& stages) {
    return {steps, quantise_enhanced_frame(whole_frame(mesh, motion, reference), before,
                                           enhanced_options(configuration, reference, steps), stages)};
}

QuantisedWork quantise_whole(FrameWork& work, const FrameSteps& steps) {
    return quantise_whole(work.configuration, work.reference(), work.mesh, work.bone_motion(),
                          work.sequence.bones.codebooks, steps, work.stages);
}

Result<Candidate> code_lone_intra(FrameWork& work, const FrameSteps& steps) {
    return code_intra(work, steps, IntraUse::alone);
}

Result<Candidate> code_renewed_intra(FrameWork& work, const FrameSteps& steps, const LatticeMesh& tracked) {
    return code_intra(work, steps, IntraUse::reference, &tracked);
}

Result<Candidate> code_coded_bones(FrameWork& work, const FrameSteps& steps, const std::vector<bool>& coded) {
    if (std::find(coded.begin(), coded.end(), true) == coded.end()) return code_predicted(work);
    const auto& sub_meshes = work.reference().decoded.skinned.sub_meshes;
    bool something = false, everything = true;
    for (std::size_t bone = 0; bone < coded.size(); ++bone) {
        const bool bare = sub_meshes.of(bone).empty();
        something = something || (coded[bone] && !bare);
        everything = everything && (coded[bone] || bare);
    }
    if (everything || !something) return code_enhanced(work, steps);
    return code_moving_part(work, steps, coded);
}

Result<EncodedTrackedFrame> code_for_patches(FrameWork& work, const FrameSteps& steps,
                                             std::span<const std::uint32_t> near) {
    if (auto coded = std::exchange(work.coded_alone, std::nullopt)) return std::move(*coded);
    return encode_tracked(work, steps, TrackedParts::all, nullptr, near);
}

Result<std::optional<Candidate>> code_patched(FrameWork& work, const FrameSteps& steps,
                                              const EncodedTrackedFrame& tracked, const SurfacePatch& patch) {
    const auto& in_use = work.reference();
    StageClock clock(work.stages);
    const auto coded_steps = tracked_steps(steps);
    FramePayload payload;
    const auto& mesh = tracked.mesh;
    auto patched = encode_patch({mesh.positions, mesh.triangles, mesh.colours}, in_use.decoded.tracked->hierarchy,
                                patch, {coded_steps.geometry, coded_steps.colour}, payload);
    if (!patched) return tl::unexpected(patched.error());
    const auto captured = counts_of(work.mesh);
    const auto vertices = patched->mesh.positions.size();
    payload.header.source_vertices = captured.vertices;
    payload.header.source_triangles = captured.triangles;
    payload.set(Layer::tracked, tracked.runs.payload);
    payload.set(Layer::pose, encode_pose(work.pose));
    Candidate out;
    out.type = FrameType::patched;
    out.reference = in_use.decoded.number;
    out.referred = true;
    smooth_what_is_new(*patched, coded_steps.geometry, !mesh.normals.empty());
    auto textured = add_charts_of_piece(*patched, in_use.decoded, work.configuration.options.texture,
                                        in_use.intra.chart_scale, payload);
    if (!textured) return std::optional<Candidate>();
    out.textured = std::move(*textured);
    out.renewed =
        vertices > 0 ? static_cast<double>(vertices - patched->stays.size()) / static_cast<double>(vertices) : 0;
    out.decoded = std::move(patched->mesh);
    if (denoises(work.configuration))
        out.targets =
            on_new_reference(tracked.targets, patched->stays, out.decoded.positions.size(), filter_options(work));
    out.kept = keep_nodes(in_use.decoded.tracked->nodes, patched->stays);
    out.captured = captured;
    out.pose = work.pose;
    out.packets.push_back(frame_packet(PacketKind::patched, payload));
    auto& history = out.nodes.emplace();
    history.before_last = work.sequence.nodes.last;
    if (history.before_last.empty()) history.before_last.resize(work.registered_nodes().motion.size());
    history.last = work.registered_nodes().motion;
    auto& facts = out.intra.emplace(in_use.intra);
    facts.step = 1;
    facts.steps = steps;
    facts.edge = work.edge();
    facts.colours = work.colours_at(out.decoded);
    clock.done("patch coding");
    std::vector<std::uint32_t> near(vertices, OrientedPoints::no_point);
    for (std::size_t i = 0; i < patched->stays.size(); ++i) near[i] = tracked.near[patched->stays[i]];
    facts.fit = work.tracked_fit(out.decoded, facts.edge, near, {});
    return std::optional(std::move(out));
}

Result<Candidate> code_motion_alone(FrameWork& work, const FrameSteps& steps) {
    return code_tracked(work, steps, TrackedParts::motion_alone);
}

}  // namespace htvm::internal
