// The table of frame kinds: everything the codec must know about each, in the order of FrameType. Names and letters are
// in htvm/frame.hpp. A new kind needs a row in both, a packet kind, its decoder, and a chapter of docs/bitstream.md;
// the encoder's tables are indexed by FrameType too.
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>

#include "codec/format/decoder_limits.h"
#include "codec/format/frame_payload.h"
#include "htvm/frame.hpp"
#include "htvm/packet.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

struct DecoderState;

// What must have been decoded before a frame can be, besides the sequence header.
enum class RefersTo : std::uint8_t {
    nothing,
    reference,            // the current reference: an I-frame, or a frame that patched it
    reference_or_before,  // the current reference, or the last frame of the same kind since then; in a group of them
                          // also one of those
};

// Kinds whose sizes rate control models together.
enum class RateClass : std::uint8_t {
    intra,    // many bits, depending on quality
    between,  // fewer bits, depending on quality
    moved,    // very few bits, whatever the quality
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
    LayerSet layers;  // the layers that it may have; others are ignored
    RefersTo refers_to;
    bool codebooks;       // whether it names codebooks, which come in packets of their own
    bool referred;        // whether later frames may refer to it, unless its packet tells otherwise
    bool renews = false;  // whether it then is the reference of what follows
    bool codes_mesh;      // true: it codes as many vertices and triangles as its header says, so its payload has at
                          // least least_payload() bytes; false: it has the counts of its reference, and its header
                          // must say so
    MemoryBound memory;   // for decoding it
    RateClass rate;
    // Decodes and shows the frame. Called once the payload's header is known to be within all limits; if the frame
    // refers to the reference alone, that is known to exist. After an error the state is unchanged, except for what
    // helps to conceal the frame.
    Result<void> (*decode)(DecoderState&, const Packet&, const FramePayloadView&);
};

extern const std::array<FrameRules, frame_type_count> frame_rules;

inline const FrameRules& rules_of(FrameType type) { return frame_rules[static_cast<std::size_t>(type)]; }

// Whether frames of this kind are decoded by themselves.
inline bool stands_alone(FrameType type) { return rules_of(type).refers_to == RefersTo::nothing; }

// Whether later frames may refer to this one. Otherwise it leaves what they refer to as it was.
inline bool is_referred(const PacketHeader& packet, const FrameRules& rules) {
    return rules.referred && (!packet.has(packet_flag::flags_valid) || packet.has(packet_flag::referred));
}

// The decoders of the rows; each is in decoder_NAME.cpp.
Result<void> decode_intra(DecoderState& state, const Packet& packet, const FramePayloadView& payload);
Result<void> decode_enhanced(DecoderState& state, const Packet& packet, const FramePayloadView& payload);
Result<void> decode_predicted(DecoderState& state, const Packet& packet, const FramePayloadView& payload);
Result<void> decode_tracked(DecoderState& state, const Packet& packet, const FramePayloadView& payload);
Result<void> decode_patched(DecoderState& state, const Packet& packet, const FramePayloadView& payload);

}  // namespace htvm::internal
