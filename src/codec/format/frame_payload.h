// The payload of a frame packet: a few numbers, then layers that can each be decoded, or skipped, by themselves. A
// T-frame's is another (tracked/tracked_payload.h), but for versions 1 and 2 of the stream.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "htvm/frame.hpp"
#include "htvm/packet.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

inline constexpr std::uint8_t intra_coder_tfan = 0;
inline constexpr std::uint8_t intra_coder_draco = 1;
inline constexpr std::uint8_t intra_coder_levels = 2;  // intra/leveled_frame.h

// The size of the mesh that a frame was captured with.
struct CapturedCounts {
    std::uint32_t vertices = 0, triangles = 0;
    bool operator==(const CapturedCounts&) const = default;
};

struct FrameHeader {
    std::uint32_t source_vertices = 0, source_triangles = 0;   // of the captured mesh
    std::uint32_t vertices = 0, triangles = 0;                 // of the decoded mesh
    std::uint32_t geometry_step = 64;                          // I: step of positions, lattice units, >= 1
    std::uint32_t colour_step = 8;                             // I: step of colours, levels, 1..255
    std::uint8_t intra_coder = intra_coder_tfan;               // I
    std::uint32_t geometry_codebook = 0, colour_codebook = 0;  // EP: numbers of the codebooks used
};

// A payload to be written.
struct FramePayload {
    FrameHeader header;
    std::array<std::vector<std::uint8_t>, layer_count> layers;
    std::array<bool, layer_count> present{};
    void set(Layer layer, std::vector<std::uint8_t> bytes) {
        layers[static_cast<std::size_t>(layer)] = std::move(bytes);
        present[static_cast<std::size_t>(layer)] = true;
    }
    bool has(Layer layer) const { return present[static_cast<std::size_t>(layer)]; }
    const std::vector<std::uint8_t>& of(Layer layer) const { return layers[static_cast<std::size_t>(layer)]; }
};

// A payload that was read: its layers lie in the packet's bytes, and are valid as long as these.
struct FramePayloadView {
    FrameHeader header;
    std::array<std::span<const std::uint8_t>, layer_count> layers;
    std::array<bool, layer_count> present{};
    bool has(Layer layer) const { return present[static_cast<std::size_t>(layer)]; }
    std::span<const std::uint8_t> of(Layer layer) const { return layers[static_cast<std::size_t>(layer)]; }
};
FramePayloadView view_of(const FramePayload& payload);
FramePayload copy_of(const FramePayloadView& payload);

// The layers' bytes of a packet, and as overhead all its other bytes.
LayerBytes with_overhead(LayerBytes layers, const Packet& packet);

// What a packet of this kind says by itself; and what it says with its payload, where that is no run
// (FrameRules::is_run).
FrameInfo describe(const Packet& packet, FrameType type);
// What inspect() gives.
Result<FrameInfo> describe(const Packet& packet);
FrameInfo describe(const Packet& packet, FrameType type, const FramePayloadView& payload);

// The fewest bytes that the payload of an I- or EP-frame of so many vertices and triangles may have: it bounds what a
// few bytes can make a decoder do.
inline std::uint64_t least_payload(std::uint64_t vertices, std::uint64_t triangles) {
    return std::max((vertices + 63) / 64, (triangles + 127) / 128);
}

// An I- or EP-frame (known by its pose or mapping) that came out shorter than it may be gets zeros behind its layers.
std::vector<std::uint8_t> write_frame_payload(const FramePayload& payload);
// Layers of a number that is not known are skipped.
Result<FramePayloadView> read_frame_payload(std::span<const std::uint8_t> bytes);

}  // namespace htvm::internal
