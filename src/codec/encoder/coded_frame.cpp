#include "codec/encoder/coded_frame.h"

#include <utility>

#include "codec/bones/codebook.h"
#include "codec/format/frame_kinds.h"
#include "codec/intra/intra_frame.h"
#include "codec/reference/reference.h"
#include "codec/tracked/presence.h"

namespace htvm::internal {
namespace {

std::uint32_t count(std::size_t n) { return static_cast<std::uint32_t>(n); }

std::uint8_t flags_of(const CodedFrame& frame) {
    using namespace packet_flag;
    return static_cast<std::uint8_t>((frame.referred ? referred : droppable) | (frame.access ? access : 0) |
                                     (frame.of_tracked_mesh ? packet_flag::of_tracked_mesh : 0));
}

ShownMesh shown(CodedFrame& frame, const Reference* reference) {
    const bool own = rules_of(frame.type).codes_mesh || !reference;
    const auto& textured = own ? frame.textured : reference->textured;
    const auto& detail = detail_of(frame, reference);
    ShownMesh out{shown_mesh(detailed(detail, std::move(frame.decoded)), textured), textured.copied};
    if (frame.projection) project(*frame.projection, out.mesh.positions, out.mesh.texcoords);
    if (!anything_absent(frame.presence)) return out;
    auto presence = frame.presence;
    add_detail(detail, detail.levels.size(), presence);
    for (const auto v : out.repeated) presence.push_back(presence[v]);
    const auto whole = std::move(out.mesh.triangles);
    triangles_shown(whole, presence, out.mesh.triangles);
    return out;
}

}  // namespace

std::size_t CodedFrame::bytes() const {
    std::size_t sum = 0;
    for (const auto& packet : packets) sum += packet.payload.size() + packet_overhead;
    return sum;
}

FrameType rate_type(const CodedFrame& frame) {
    const bool bare = stands_alone(frame.type) && frame.decoded.triangles.empty();
    return frame.stands_in || bare ? FrameType::predicted : frame.type;
}

const SurfaceDetail& detail_of(const CodedFrame& frame, const Reference* reference) {
    static const SurfaceDetail none;
    if (frame.type == FrameType::tracked) return reference ? reference->detail : none;
    return frame.detail;
}

OutgoingFrame outgoing(const Configuration& configuration, CodedFrame frame, const Reference* reference,
                       std::uint32_t number, std::int64_t timestamp_us, const FrameCost& cost) {
    OutgoingFrame out;
    out.cost = cost;
    out.shown = shown(frame, reference);
    LayerBytes codebooks;
    for (auto& packet : frame.packets) {
        packet.frame = number;
        packet.reference = frame.reference;
        packet.timestamp_us = timestamp_us;
        packet.flags |= packet_flag::flags_valid;
        if (packet.kind == PacketKind::codebook) {
            codebooks.overhead += packet_overhead;
            codebooks[packet.payload[0] == codebook_for_geometry ? Layer::geometry : Layer::colour] +=
                packet.payload.size();
            continue;
        }
        packet.flags |= flags_of(frame);
        out.info = *describe(packet);
        if (rules_of(frame.type).is_run) {
            out.info.source_vertices = frame.captured.vertices;
            out.info.source_triangles = frame.captured.triangles;
            out.info.bytes = with_overhead(frame.shares, packet);
        }
        out.info.vertices = count(out.shown.mesh.positions.size());
        out.info.triangles = count(out.shown.mesh.triangles.size());
        out.info.bytes += codebooks;
    }
    // Where nothing refers to it while others are referred to, it is no place to start from.
    out.starts_decoding = stands_alone(frame.type) && (frame.referred || configuration.intra_only());
    out.packets = std::move(frame.packets);
    return out;
}

FrameReason reason_of_due(const Configuration& configuration, std::uint32_t number) {
    return number == 0 || configuration.intra_only() ? FrameReason::none : FrameReason::due;
}

Packet frame_packet(PacketKind kind, std::vector<std::uint8_t> payload) {
    Packet packet;
    packet.kind = kind;
    packet.payload = std::move(payload);
    return packet;
}
Packet frame_packet(PacketKind kind, FramePayload payload, FrameReason reason) {
    if (reason != FrameReason::none) payload.set(Layer::reason, {static_cast<std::uint8_t>(reason)});
    return frame_packet(kind, write_frame_payload(payload));
}

CapturedCounts counts_of(const LatticeMesh& captured) {
    return {count(captured.positions.size()), count(captured.triangles.size())};
}

std::int32_t step_for_reference(double edge, std::int32_t step) {
    const double half_edge = edge / 2;
    return half_edge >= 1 && half_edge < step ? static_cast<std::int32_t>(half_edge) : step;
}

void tell_captured(FramePayload& payload, CapturedCounts captured, const CodedPose& pose) {
    payload.header.source_vertices = captured.vertices;
    payload.header.source_triangles = captured.triangles;
    payload.set(Layer::pose, encode_pose(pose));
}

Result<CodedIntra> code_intra_mesh(const Configuration& configuration, const LatticeMesh& mesh, const FrameSteps& steps,
                                   bool renewal, CapturedCounts captured, const CodedPose& pose) {
    IntraFrameOptions options;
    options.geometry_step = steps.geometry;
    options.colour_step = steps.colour;
    options.merge_duplicates = configuration.options.topology.merge_duplicates;
    options.external = configuration.options.intra_coder ? &*configuration.options.intra_coder : nullptr;
    options.threads = configuration.threads;
    CodedIntra out;
    auto decoded = encode_intra_frame(mesh, options, out.payload);
    if (!decoded) return tl::unexpected(decoded.error());
    out.decoded = std::move(*decoded);
    out.step = smooth_as_shown(out.decoded, options.geometry_step, renewal, configuration.header);
    tell_captured(out.payload, captured, pose);
    return out;
}

SurfaceErrors errors_between(const LatticeMesh& captured, const SurfaceIndex& surface, const LatticeMesh& decoded,
                             Threads threads) {
    SurfaceDistanceOptions options;
    options.threads = threads;
    options.every = 4;
    const auto shown_points = points_of(decoded.positions);
    return surface_errors({surface.positions, captured.triangles, captured.colours}, surface,
                          {shown_points, decoded.triangles, decoded.colours}, options);
}

bool same_attributes(const LatticeMesh& a, const LatticeMesh& b) {
    return a.colours.empty() == b.colours.empty() && a.normals.empty() == b.normals.empty() &&
           a.texcoords.empty() == b.texcoords.empty();
}

}  // namespace htvm::internal
