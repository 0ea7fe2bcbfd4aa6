// The table of frame kinds: everything that both sides must know about each, in the order of FrameType. It does not
// hold names and letters (htvm/frame.hpp), how a kind is decoded (decoder/frame_decoders.h), nor when and how it is
// coded: that is a strategy's (encoder/tracked, encoder/bones). A new kind needs a row here and in the first two, a
// packet kind, and a chapter of docs/bitstream.md.
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>

#include "codec/format/decoder_limits.h"
#include "codec/format/frame_payload.h"
#include "htvm/frame.hpp"
#include "htvm/packet.hpp"

namespace htvm::internal {

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
    LayerSet layers;      // the layers that it may have; others are ignored
    bool is_run = false;  // whether from tracked_run_version on its payload is one run of the range coder, which has
                          // neither a header nor a table of layers
    RefersTo refers_to;
    bool codebooks;       // whether it names codebooks, which come in packets of their own
    bool referred;        // whether later frames may refer to it, unless its packet tells otherwise
    bool renews = false;  // whether it then is the reference of what follows
    bool codes_mesh;      // true: it codes as many vertices and triangles as its header says, so its payload has at
                          // least least_payload() bytes; false: it has the counts of its reference, and its header
                          // must say so
    MemoryBound memory;   // for decoding it
    std::uint8_t reference_work;  // likewise time: for each vertex of what it refers to, beside showing one
    RateClass rate;
};

extern const std::array<FrameRules, frame_type_count> frame_rules;

inline const FrameRules& rules_of(FrameType type) { return frame_rules[static_cast<std::size_t>(type)]; }

// Whether frames of this kind are decoded by themselves.
inline bool stands_alone(FrameType type) { return rules_of(type).refers_to == RefersTo::nothing; }

// Whether later frames may refer to this one. Otherwise it leaves what they refer to as it was.
inline bool is_referred(const PacketHeader& packet, const FrameRules& rules) {
    return rules.referred && (!packet.has(packet_flag::flags_valid) || packet.has(packet_flag::referred));
}

// Whether a decoder at its defaults accepts a stream whose frames, of this kind, are as large: an error of kind limit
// that says why not.
Result<void> check_default_limits(FrameType type, MeshCounts shown);

}  // namespace htvm::internal
