#include "codec/encoder/bones/bones_coders.h"

#include <algorithm>
#include <utility>

#include "codec/bones/animated_frame.h"

namespace htvm::internal {
namespace {

Result<BonesIntra> code_intra_for(const BonesWork& work, FrameSteps steps, bool referred_to, FrameReason reason) {
    const auto& configuration = work.configuration;
    const auto& mesh = work.mesh();
    const auto captured = counts_of(mesh);
    // Without a skeleton EP-frames may never pay off, and then the bits of a finer I-frame would be wasted.
    const bool finer = referred_to && (configuration.header.has_skeleton ||
                                       configuration.options.topology.frame_choice != FrameChoice::cheaper);
    StageClock clock(work.stages);
    BonesIntra out;
    out.steps = steps;
    out.edge = mean_edge(mesh.positions, mesh.triangles);
    if (finer) steps.geometry = step_for_reference(out.edge, steps.geometry);
    auto coded = code_intra_mesh(configuration, mesh, steps, false, captured, work.captured.pose);
    if (!coded) return tl::unexpected(coded.error());
    out.step = coded->step;
    out.pose = work.captured.pose;
    auto& frame = out.frame;
    frame.type = FrameType::intra;
    frame.reference = work.sequence.next_frame;
    frame.decoded = std::move(coded->decoded);
    frame.captured = captured;
    // Under rate control also what stands in for a frame that does not fit may refer to it.
    frame.referred =
        may_be_referred_to(mesh) && (!configuration.intra_only() || configuration.options.rate.bits_per_second > 0);
    frame.packets.push_back(frame_packet(PacketKind::intra, std::move(coded->payload), reason));
    clock.done("intra coding");
    return out;
}

EnhancedFrameOptions enhanced_options(const Configuration& configuration, const BonesReference& reference,
                                      const FrameSteps& steps) {
    const auto& options = configuration.options;
    EnhancedFrameOptions out;
    out.geometry.step = step_for_reference(reference.edge, steps.geometry);
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

EnhancedFrameSource whole_frame(const LatticeMesh& mesh, const FrameMotion& motion, const BonesReference& reference) {
    EnhancedFrameSource out;
    out.mesh = &mesh;
    out.bone_of_vertex = motion.bone_of_vertex;
    out.motion = &motion;
    out.reference = &reference.decoded.skinned;
    out.search = &reference.search;
    const auto captured = counts_of(mesh);
    out.source_vertices = captured.vertices;
    out.source_triangles = captured.triangles;
    return out;
}
EnhancedFrameSource whole_frame(const BonesWork& work) {
    return whole_frame(work.mesh(), *work.motion, work.reference());
}

// Compares whole EP-frames with the cheapest since the I-frame: see intra_is_paid_for() in bones_choice.cpp.
void count_bytes(BonesHistory& history, double bytes) {
    if (history.least_bytes == 0 || bytes < history.least_bytes) history.least_bytes = bytes;
    history.excess_bytes += bytes - history.least_bytes;
}

BonesMoved code_residuals(const BonesWork& work, const EnhancedFrameSource& source, QuantisedFrame quantised,
                          const FrameSteps& steps) {
    BonesMoved out;
    auto& frame = out.frame;
    frame.type = FrameType::enhanced;
    frame.reference = work.reference().decoded.number;
    auto& history = out.history = work.sequence.history;
    const auto before = std::exchange(history.codebooks, quantised.codebooks);
    history.codebooks.geometry.sent = before.geometry.sent;
    history.codebooks.colour.sent = before.colour.sent;
    auto encoded = encode_enhanced_frame(source, std::move(quantised),
                                         enhanced_options(work.configuration, work.reference(), steps), work.stages);
    history.motion = work.motion->motion;
    send_codebook(work.sequence.next_frame, codebook_for_geometry, history.codebooks.geometry, frame.packets);
    send_codebook(work.sequence.next_frame, codebook_for_colour, history.codebooks.colour, frame.packets);
    frame.packets.push_back(frame_packet(PacketKind::enhanced, std::move(encoded.payload)));
    frame.decoded = std::move(encoded.mesh);
    out.distance_order_counts = std::move(encoded.distance_order_counts);
    return out;
}

BonesMoved code_moving_part(const BonesWork& work, const FrameSteps& steps, const std::vector<bool>& coded_bones) {
    const auto& fit = *work.animation;
    StageClock clock(work.stages);
    constexpr double stray_in_edges = 4;
    const auto part = cut_moving_part(work.mesh(), work.motion->bone_of_vertex, work.reference().decoded.skinned, fit,
                                      coded_bones, LatticeUnits(stray_in_edges * work.reference().edge));
    clock.done("cutting");
    auto source = whole_frame(work);
    source.mesh = &part.mesh;
    source.bone_of_vertex = part.bone_of_vertex;
    source.nearest = part.nearest;
    source.coded_bones = coded_bones;
    auto quantised =
        quantise_enhanced_frame(source, work.sequence.history.codebooks,
                                enhanced_options(work.configuration, work.reference(), steps), work.stages);
    return code_residuals(work, source, std::move(quantised), steps);
}

}  // namespace

Result<BonesIntra> code_intra(const BonesWork& work, const FrameSteps& steps, FrameReason reason) {
    return code_intra_for(work, steps, true, reason);
}

Result<BonesIntra> code_unreferred_intra(const BonesWork& work, const FrameSteps& steps, FrameReason reason) {
    return code_intra_for(work, steps, false, reason);
}

BonesMoved code_predicted(const BonesWork& work) {
    const auto& motion = *work.motion;
    const auto& reference = work.reference().decoded;
    const auto captured = counts_of(work.mesh());
    BonesMoved out;
    auto& frame = out.frame;
    frame.type = FrameType::predicted;
    frame.reference = reference.number;
    frame.packets.push_back(frame_packet(
        PacketKind::predicted,
        predicted_frame_payload(reference.skinned, motion.transforms, captured.vertices, captured.triangles)));
    frame.decoded = animate(reference.skinned, motion.transforms, motion.predicted);
    out.history = work.sequence.history;
    out.history.motion = motion.motion;
    return out;
}

QuantisedWhole quantise_whole(const Configuration& configuration, const BonesReference& reference,
                              const LatticeMesh& mesh, const FrameMotion& motion, const Codebooks& before,
                              const FrameSteps& steps, std::vector<StageTime>& stages) {
    return {steps, quantise_enhanced_frame(whole_frame(mesh, motion, reference), before,
                                           enhanced_options(configuration, reference, steps), stages)};
}

QuantisedWhole quantise_whole(const BonesWork& work, const FrameSteps& steps) {
    return quantise_whole(work.configuration, work.reference(), work.mesh(), *work.motion,
                          work.sequence.history.codebooks, steps, work.stages);
}

BonesMoved code_enhanced(const BonesWork& work, const FrameSteps& steps, std::optional<QuantisedWhole> quantised) {
    if (!quantised || quantised->steps != steps) quantised = quantise_whole(work, steps);
    auto out = code_residuals(work, whole_frame(work), std::move(quantised->frame), steps);
    count_bytes(out.history, static_cast<double>(out.frame.bytes()));
    return out;
}

BonesMoved code_coded_bones(const BonesWork& work, const FrameSteps& steps, const std::vector<bool>& coded,
                            std::optional<QuantisedWhole> quantised) {
    if (std::find(coded.begin(), coded.end(), true) == coded.end()) return code_predicted(work);
    const auto& sub_meshes = work.reference().decoded.skinned.sub_meshes;
    bool something = false, everything = true;
    for (std::size_t bone = 0; bone < coded.size(); ++bone) {
        const bool bare = sub_meshes.of(bone).empty();
        something = something || (coded[bone] && !bare);
        everything = everything && (coded[bone] || bare);
    }
    if (everything || !something) return code_enhanced(work, steps, std::move(quantised));
    return code_moving_part(work, steps, coded);
}

}  // namespace htvm::internal
