// Streams of T-frames that no encoder would write: any mesh, randomly moved, displaced and recoloured.
#pragma once

#include <algorithm>
#include <random>
#include <vector>

#include "codec/encoder/tracked/node_motion.h"
#include "codec/encoder/tracked/tracked_frame.h"
#include "codec/format/sequence.h"
#include "codec/intra/intra_frame.h"
#include "codec/reference/reference.h"
#include "codec/test_sequences.h"

namespace htvm::test {

using namespace internal;

struct ChanceMotion {
    double turn = 300, shift = 400;  // of a node's transform relative to the common one, in quanta and lattice units
    double displacement = 60, colour = 20;
    FieldOptions fields;
};

// The payload. before: state of the frame that it refers to, or null. presence: where the stream tells it.
inline std::vector<std::uint8_t> tracked_by_chance(const NodeReference& reference, const TrackedState* before,
                                                   const ChanceMotion& motion, std::mt19937& random,
                                                   std::span<const std::uint8_t> presence = {}) {
    const auto number = [&](double size) {
        std::uniform_real_distribution<double> any(-size, size);
        return static_cast<std::int32_t>(any(random));
    };
    std::vector<QuantisedTransform> wanted;
    for (std::size_t n = 0; n < reference.graph.pivots.size(); ++n) {
        QuantisedTransform transform;
        if (random() % 16 == 0) transform.rotation.largest = static_cast<std::uint8_t>(random() % 4);
        for (auto& c : transform.rotation.others)
            c = static_cast<std::int16_t>(std::clamp(number(motion.turn) + 100, -8192, 8192));
        transform.shift = {number(motion.shift), number(motion.shift) + 500, number(motion.shift)};
        wanted.push_back(transform);
    }
    NodeMotionOptions options;
    options.steps.rotation_exponent = static_cast<int>(random() % 11);
    options.steps.shift_exponent = static_cast<int>(random() % 9);
    TrackedHead head;
    head.captured = {static_cast<std::uint32_t>(random() % 70000), static_cast<std::uint32_t>(random() % 140000)};
    if (before && random() % 2 == 0) {
        head.captured = before->head.captured;
        options.steps = before->head.motion;
    }
    head.motion = options.steps;
    const std::span<const QuantisedTransform> transforms_before =
        before ? std::span<const QuantisedTransform>(before->transforms) : std::span<const QuantisedTransform>{};
    const auto coded_motion = encode_node_motion(wanted, reference.graph, transforms_before, options);
    std::vector<std::int32_t> displacement, colour;
    for (std::size_t v = 0; v < reference.mesh.positions.size(); ++v) {
        displacement.push_back(number(motion.displacement) + 30);
        for (int c = 0; c < 3; ++c) colour.push_back(number(motion.colour) + 5 * c);
    }
    auto fields = motion.fields;
    fields.turned = false;
    const auto coded_displacement =
        *encode_field(reference.hierarchy, displacement, 1, fields, before ? &before->displacement : nullptr);
    head.displacement = coded_displacement.steps;
    fields.turned = motion.fields.turned;
    const bool coloured = !reference.mesh.colours.empty();
    EncodedField coded_colour;
    if (coloured)
        coded_colour = *encode_field(reference.hierarchy, colour, 3, fields, before ? &before->colour : nullptr);
    head.colour = coded_colour.steps;
    const std::size_t least_run = random() % 2 == 0 ? 1 : 1 << 30;  // the colours in their own run, or not
    const PresenceToWrite told{reference.around, before ? before->presence : reference.presence, presence};
    return write_tracked_runs(
               head, {before ? &before->head : nullptr, reference.captured, coloured},
               {coded_motion.decisions, coded_displacement.decisions, coloured ? &coded_colour.decisions : nullptr},
               reference.has_presence ? &told : nullptr, least_run)
        .payload;
}

// A stream that is put together frame by frame.
struct StreamByChance {
    std::uint32_t frame = 0;  // number of the next one
    SequenceHeader header;
    std::vector<Packet> packets = {};
    void add(Packet packet, std::uint32_t reference) {
        packet.frame = frame;
        packet.reference = reference;
        packet.flags = packet_flag::flags_valid | packet_flag::referred;
        packet.timestamp_us = std::int64_t{frame++} * 33333;
        packets.push_back(std::move(packet));
    }
    // The header with nodes so far apart, in lattice units.
    void add_header(const Packet& packet, std::int32_t node_spacing) {
        header = *read_sequence_header(packet.payload);
        header.node_spacing = node_spacing;
        packets.push_back(packet);
        packets.back().payload = write_sequence_header(header);
    }
    // Returns the mesh that decoders have of it.
    LatticeMesh add_intra(const Packet& packet, const FramePayloadView& coded) {
        auto mesh = *decode_intra_frame(coded, nullptr);
        smooth_as_shown(mesh, static_cast<std::int32_t>(coded.header.geometry_step), false, header);
        add(packet, frame);
        return mesh;
    }
};

// A stream of I-frames with a few T-frames after each: one from the I-frame, two from the previous frame, one more from
// the I-frame. node_spacing: lattice units. first: the number of the first frame.
inline std::vector<Packet> with_tracked_frames(const std::vector<Packet>& intra, std::int32_t node_spacing,
                                               const ChanceMotion& motion, std::uint32_t first, unsigned seed) {
    std::mt19937 random(seed);
    StreamByChance out{.frame = first, .header = {}};
    for (const auto& packet : intra) {
        if (packet.kind == PacketKind::sequence) out.add_header(packet, node_spacing);
        if (packet.kind != PacketKind::intra) continue;
        const auto payload = *read_frame_payload(packet.payload);
        const std::uint32_t key = out.frame;
        auto reference = *make_node_reference(out.add_intra(packet, payload), node_spacing, 1);
        reference.captured = {payload.header.source_vertices, payload.header.source_triangles};
        TrackedState state;
        for (const bool refers_to_last : {false, true, true, false}) {
            auto tracked = tracked_by_chance(reference, refers_to_last ? &state : nullptr, motion, random);
            DecodedTrackedFrame decoded;
            if (!decode_tracked_frame(tracked, reference, refers_to_last ? &state : nullptr, {}, decoded)) break;
            state = std::move(decoded.state);
            Packet next = packet;
            next.kind = PacketKind::tracked;
            next.payload = std::move(tracked);
            out.add(std::move(next), refers_to_last ? out.frame - 1 : key);
        }
    }
    return std::move(out.packets);
}

}  // namespace htvm::test
