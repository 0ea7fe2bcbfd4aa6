#include "reproduce_zipper.h"

#include <cmath>

#include "codec/intra/intra_frame.h"
#include "codec/paper/animated_frame.h"
#include "codec/paper/codebook.h"
#include "codec/paper/enhanced_frame.h"
#include "codec/paper/zipper.h"
#include "codec/reference/transforms.h"
#include "codec/stream/sequence.h"
#include "core/thread.h"

namespace htvm::lab {

using namespace internal;
namespace {

// What a decoder keeps between frames, laid open.
struct OpenDecoder {
    std::optional<SequenceHeader> header;
    std::optional<ReferenceMesh> reference;
    std::optional<NumberedCodebook> geometry_codebook, colour_codebook;
    Threads threads = {};
};

const Codebook* book_of(const std::optional<NumberedCodebook>& codebook) {
    return codebook ? &codebook->codebook : nullptr;
}

Result<void> take_intra(OpenDecoder& decoder, const Packet& packet) {
    const auto payload = read_frame_payload(packet.payload);
    if (!payload) return tl::unexpected(payload.error());
    const auto& header = *decoder.header;
    const auto pose =
        decode_pose(payload->of(Layer::pose), header.skeleton.joint_names.size(), header.skeleton.bones.size());
    if (!pose) return tl::unexpected(pose.error());
    auto mesh = decode_intra_frame(*payload, nullptr);
    if (!mesh) return tl::unexpected(mesh.error());
    decoder.reference = make_reference(std::move(*mesh), header.skeleton.bones, pose->joints, pose->orientations,
                                       header.radii, header.weight_width, packet.frame, decoder.threads);
    return {};
}

Result<void> take_codebook(OpenDecoder& decoder, const Packet& packet) {
    auto codebook = read_codebook_payload(packet.payload);
    if (!codebook) return tl::unexpected(codebook.error());
    (codebook->purpose == codebook_for_geometry ? decoder.geometry_codebook : decoder.colour_codebook) =
        std::move(*codebook);
    return {};
}

// The coded part, then the animated triangles that are wanted, one flag each.
Mesh joined(const LatticeMesh& coded, const LatticeMesh& animated, const std::vector<std::uint8_t>& wanted,
            const Lattice& lattice) {
    Mesh out = to_mesh(coded, lattice);
    const Mesh rest = to_mesh(animated, lattice);
    const auto first = static_cast<std::uint32_t>(out.positions.size());
    out.positions.insert(out.positions.end(), rest.positions.begin(), rest.positions.end());
    out.colours.insert(out.colours.end(), rest.colours.begin(), rest.colours.end());
    out.normals.clear();
    out.texcoords.clear();
    for (std::size_t t = 0; t < wanted.size(); ++t)
        if (wanted[t])
            out.triangles.push_back(
                {rest.triangles[t][0] + first, rest.triangles[t][1] + first, rest.triangles[t][2] + first});
    return out;
}

// The first part of a zippered mesh is what was coded.
LatticeMesh coded_part(const LatticeMesh& zippered, const FrameHeader& header) {
    LatticeMesh out;
    out.positions.assign(zippered.positions.begin(), zippered.positions.begin() + header.vertices);
    if (!zippered.colours.empty())
        out.colours.assign(zippered.colours.begin(), zippered.colours.begin() + header.vertices);
    out.triangles.assign(zippered.triangles.begin(), zippered.triangles.begin() + header.triangles);
    return out;
}

// Nothing where the frame is coded as a whole.
Result<std::optional<SeamStages>> take_apart(const OpenDecoder& decoder, const Packet& packet) {
    const auto payload = read_frame_payload(packet.payload);
    if (!payload) return tl::unexpected(payload.error());
    if (!payload->has(Layer::coded_bones)) return std::optional<SeamStages>();
    const auto& reference = *decoder.reference;
    const auto& lattice = decoder.header->lattice;
    auto decoded = decode_enhanced_frame(
        *payload, {reference, book_of(decoder.geometry_codebook), book_of(decoder.colour_codebook),
                   decoder.header->nearest_vertices, decoder.threads});
    if (!decoded) return tl::unexpected(decoded.error());
    const auto bones = read_coded_bones(payload->of(Layer::coded_bones), reference.pivots.size());
    if (!bones) return tl::unexpected(bones.error());
    const auto still = still_vertices(reference, *bones);
    const auto animated =
        animate(reference, decoded->transforms, predict_positions(reference, decoded->transforms, decoder.threads));
    const auto coded = coded_part(decoded->mesh, payload->header);
    std::vector<std::uint8_t> touching;
    for (const auto& t : animated.triangles) touching.push_back(still[t[0]] || still[t[1]] || still[t[2]] ? 1 : 0);
    const auto kept = kept_by_zippering(coded, animated, still, decoder.threads);
    SeamStages out;
    out.frame = packet.frame;
    out.coded_triangles = coded.triangles.size();
    out.animated = to_mesh(animated, lattice);
    out.overlapping = joined(coded, animated, touching, lattice);
    out.trimmed = joined(coded, animated, kept, lattice);
    out.kept_end = out.trimmed.triangles.size();
    out.zippered = to_mesh(decoded->mesh, lattice);
    return std::optional<SeamStages>(std::move(out));
}

Result<std::optional<SeamStages>> take(OpenDecoder& decoder, const Packet& packet) {
    Result<void> taken;
    if (packet.kind == PacketKind::sequence) {
        auto header = read_sequence_header(packet.payload);
        if (!header) return tl::unexpected(header.error());
        decoder.header = std::move(*header);
    } else if (packet.kind == PacketKind::intra) {
        taken = take_intra(decoder, packet);
    } else if (packet.kind == PacketKind::codebook) {
        taken = take_codebook(decoder, packet);
    } else if (packet.kind == PacketKind::enhanced) {
        return take_apart(decoder, packet);
    }
    if (!taken) return tl::unexpected(taken.error());
    return std::optional<SeamStages>();
}

}  // namespace

Result<std::vector<SeamStages>> code_in_stages(const std::vector<std::shared_ptr<const SourceFrame>>& frames,
                                               const SequenceFacts& facts, const EncoderOptions& options) {
    auto all = options;
    all.key_interval = 1000000;
    all.topology.scene_changes = false;
    all.skeleton = facts.skeleton;
    all.radii = facts.radii;
    auto encoder = Encoder::create(all);
    if (!encoder) return tl::unexpected(encoder.error());
    const ThreadPool pool(options.threads, options.runner);
    OpenDecoder decoder;
    decoder.threads = pool.threads();
    std::vector<SeamStages> out;
    for (const auto& frame : frames) {
        const auto pushed = encoder->push(frame->mesh, frame->pose ? &*frame->pose : nullptr, frame->timestamp_us);
        if (!pushed) return tl::unexpected(pushed.error());
        while (auto packet = encoder->pull()) {
            auto stages = take(decoder, *packet);
            if (!stages) return tl::unexpected(stages.error());
            if (!*stages) continue;
            (*stages)->frame = frame->index;
            out.push_back(std::move(**stages));
        }
    }
    return out;
}

Result<SeamCounts> count_seams(const Mesh& original, const SeamStages& stages, unsigned threads) {
    TopologyMeasureOptions options;
    options.crack_width = 2 * mean_edge_length(original);
    SeamCounts out;
    out.frame = stages.frame;
    const std::pair<const Mesh*, Topology*> meshes[] = {{&original, &out.original},
                                                        {&stages.animated, &out.animated},
                                                        {&stages.overlapping, &out.overlapping},
                                                        {&stages.trimmed, &out.trimmed},
                                                        {&stages.zippered, &out.zippered}};
    const ThreadPool pool(threads);
    for (const auto& [mesh, counts] : meshes) {
        auto counted = topology(*mesh, options, pool.threads());
        if (!counted) return tl::unexpected(counted.error());
        *counts = *counted;
    }
    return out;
}

}  // namespace htvm::lab
