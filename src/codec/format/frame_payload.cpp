#include "codec/format/frame_payload.h"

#include "codec/format/frame_kinds.h"
#include "core/bytes.h"
#include "htvm/decoder.hpp"

namespace htvm::internal {

std::vector<std::uint8_t> write_frame_payload(const FramePayload& payload) {
    ByteWriter out;
    const auto& h = payload.header;
    for (const std::uint32_t v : {h.source_vertices, h.source_triangles, h.vertices, h.triangles, h.geometry_step,
                                  h.colour_step, std::uint32_t{h.intra_coder}, h.geometry_codebook, h.colour_codebook})
        out.varint(v);
    std::uint8_t layers = 0;
    for (const bool present : payload.present) layers = static_cast<std::uint8_t>(layers + present);
    out.u8(layers);
    for (std::size_t i = 0; i < layer_count; ++i) {
        if (!payload.present[i]) continue;
        out.u8(static_cast<std::uint8_t>(i));
        out.varint(payload.layers[i].size());
    }
    for (std::size_t i = 0; i < layer_count; ++i)
        if (payload.present[i]) out.bytes(payload.layers[i]);
    auto bytes = out.take();
    if (payload.has(Layer::pose) || payload.has(Layer::mapping))
        bytes.resize(
            std::max<std::size_t>(bytes.size(), static_cast<std::size_t>(least_payload(h.vertices, h.triangles))), 0);
    return bytes;
}

LayerBytes with_overhead(LayerBytes layers, const Packet& packet) {
    layers.overhead = 0;
    layers.overhead = packet.payload.size() + packet_overhead - layers.total();
    return layers;
}

FramePayloadView view_of(const FramePayload& payload) {
    FramePayloadView out{payload.header, {}, payload.present};
    for (std::size_t i = 0; i < layer_count; ++i) out.layers[i] = payload.layers[i];
    return out;
}

FramePayload copy_of(const FramePayloadView& payload) {
    FramePayload out{payload.header, {}, payload.present};
    for (std::size_t i = 0; i < layer_count; ++i)
        out.layers[i].assign(payload.layers[i].begin(), payload.layers[i].end());
    return out;
}

Result<FramePayloadView> read_frame_payload(std::span<const std::uint8_t> bytes) {
    ByteReader in(bytes);
    std::array<std::uint64_t, 9> v{};
    for (auto& value : v) value = in.varint();
    for (const auto value : v)
        if (value > 0x7FFFFFFF) return fail(ErrorKind::corrupt_stream, "frame: a number of its header is out of range");
    FramePayloadView out;
    auto& h = out.header;
    h.source_vertices = static_cast<std::uint32_t>(v[0]);
    h.source_triangles = static_cast<std::uint32_t>(v[1]);
    h.vertices = static_cast<std::uint32_t>(v[2]);
    h.triangles = static_cast<std::uint32_t>(v[3]);
    h.geometry_step = static_cast<std::uint32_t>(v[4]);
    h.colour_step = static_cast<std::uint32_t>(v[5]);
    h.intra_coder = static_cast<std::uint8_t>(v[6] > 255 ? 255 : v[6]);
    h.geometry_codebook = static_cast<std::uint32_t>(v[7]);
    h.colour_codebook = static_cast<std::uint32_t>(v[8]);
    if (h.geometry_step < 1 || h.geometry_step > (1u << 24) || h.colour_step < 1 || h.colour_step > 255)
        return fail(ErrorKind::corrupt_stream, "frame: a step is out of range");
    struct Entry {
        std::size_t layer;
        std::uint64_t size;
    };
    std::array<Entry, 255> table;
    const auto entries = std::span(table).first(in.u8());
    for (auto& entry : entries) {
        entry.layer = in.u8();
        entry.size = in.varint();
        if (entry.size > in.remaining())
            return fail(ErrorKind::corrupt_stream, "frame: a layer is longer than the frame");
    }
    for (const auto& entry : entries) {
        const auto layer = in.bytes(entry.size);
        if (entry.layer >= layer_count) continue;
        if (out.present[entry.layer]) return fail(ErrorKind::corrupt_stream, "frame: a layer comes twice");
        out.layers[entry.layer] = layer;
        out.present[entry.layer] = true;
    }
    if (!in.ok()) return fail(ErrorKind::corrupt_stream, "frame: its header or layers end too early");
    return out;
}

FrameInfo describe(const Packet& packet, FrameType type) {
    FrameInfo out;
    out.type = type;
    out.frame = packet.frame;
    out.reference = packet.reference;
    out.timestamp_us = packet.timestamp_us;
    out.bytes.overhead = packet.payload.size() + packet_overhead;
    return out;
}

namespace {

// A reason that this version does not know decides nothing, so it is as if none was told.
FrameReason read_reason(const FramePayloadView& payload) {
    const auto layer = payload.of(Layer::reason);
    return layer.size() == 1 && layer[0] < frame_reasons.size() ? FrameReason{layer[0]} : FrameReason::none;
}

}  // namespace

FrameInfo describe(const Packet& packet, FrameType type, const FramePayloadView& payload) {
    auto out = describe(packet, type);
    if (rules_of(type).layers.has(Layer::reason)) out.reason = read_reason(payload);
    out.source_vertices = payload.header.source_vertices;
    out.source_triangles = payload.header.source_triangles;
    out.vertices = payload.header.vertices;
    out.triangles = payload.header.triangles;
    LayerBytes layers;
    for (const auto& [layer, name] : frame_layers) layers[layer] = payload.of(layer).size();
    out.bytes = with_overhead(layers, packet);
    return out;
}

Result<FrameInfo> describe(const Packet& packet) {
    const auto type = frame_type(packet.kind);
    if (!type) return fail(ErrorKind::bad_input, "the packet is not a frame");
    if (rules_of(*type).is_run) return describe(packet, *type);
    const auto payload = read_frame_payload(packet.payload);
    if (!payload) return tl::unexpected(payload.error());
    return describe(packet, *type, *payload);
}

}  // namespace htvm::internal

namespace htvm {

Result<FrameInfo> inspect(const Packet& packet) { return internal::describe(packet); }

}  // namespace htvm
