// The table of frame kinds: what the codec must know of each, in the order of FrameType. Names and letters are in
// htvm/frame.hpp. A new kind is a row here and there, a packet kind, its decoder, and a chapter of docs/bitstream.md;
// tables of the encoder's are indexed by FrameType likewise.
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>

#include "codec/stream/decoder_limits.h"
#include "codec/stream/frame_payload.h"
#include "htvm/frame.hpp"
#include "htvm/packet.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

struct DecoderState;

// What must have been decoded before a frame, besides the sequence header.
enum class RefersTo : std::uint8_t {
    nothing,
    intra,            // the I-frame in force
    intra_or_before,  // that, or the last frame of its own kind since
};

// What rate control takes for alike.
enum class RateClass : std::uint8_t {
    intra,    // many bits, that follow the quality
    between,  // fewer, that follow it too
    moved,    // hardly any, at whatever quality
};

struct LayerSet {
    std::uint32_t bits = 0;
    constexpr LayerSet(std::initializer_list<Layer> layers) {
        for (const auto layer : layers) bits |= 1u << static_cast<unsigned>(layer);
    }
    constexpr bool has(Layer layer) const { return (bits >> static_cast<unsigned>(layer) & 1u) != 0; }
};

struct FrameRules {
    FrameType type;
    PacketKind packet;
    LayerSet layers;  // that it may have; others are ignored
    RefersTo refers_to;
    bool codebooks;      // it names codebooks that came in packets of their own
    bool codes_mesh;     // it codes as many vertices and triangles as its header says, so that its payload has at least
                         // least_payload() bytes; else it has its reference's, and its header must say so
    MemoryBound memory;  // of decoding it
    RateClass rate;
    // Decodes and shows it, once its header was found within all limits and what it refers to, where that is the
    // I-frame alone, is there. After an error the state is as before, but for what conceals.
    Result<void> (*decode)(DecoderState&, const Packet&, const FramePayloadView&);
};

extern const std::array<FrameRules, frame_type_count> frame_rules;

inline const FrameRules& rules_of(FrameType type) { return frame_rules[static_cast<std::size_t>(type)]; }

// The decoders of the rows, each in decoder_NAME.cpp.
Result<void> decode_intra(DecoderState& state, const Packet& packet, const FramePayloadView& payload);
Result<void> decode_enhanced(DecoderState& state, const Packet& packet, const FramePayloadView& payload);
Result<void> decode_predicted(DecoderState& state, const Packet& packet, const FramePayloadView& payload);
Result<void> decode_tracked(DecoderState& state, const Packet& packet, const FramePayloadView& payload);

}  // namespace htvm::internal
