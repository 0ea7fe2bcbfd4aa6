// What encoder and decoder report about a frame: its type, why it was sent, and how its bytes are distributed.
//
// Threads and lifetimes. Plain values and constants: any thread may read them at any time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <string_view>

namespace htvm {

// The kinds of frames, in the order of frame_kinds.
enum class FrameType : std::uint8_t {
    intra,      // a complete mesh by itself
    enhanced,   // against the last I-frame, with connectivity of its own
    predicted,  // the last I-frame's mesh, moved and nothing else
    tracked,    // the reference's mesh laid on the captured surface
    patched,    // the same, with a part replaced by a piece with connectivity of its own: a new reference
};

// The names of a kind. Everything else the codec must know about it is in src/codec/format/frame_kinds.cpp.
struct FrameKind {
    FrameType type;
    const char* letter;  // as used in tables and on the command line
    const char* name;
};
inline constexpr std::array frame_kinds = {
    FrameKind{FrameType::intra, "I", "intra"},         FrameKind{FrameType::enhanced, "EP", "enhanced"},
    FrameKind{FrameType::predicted, "P", "predicted"}, FrameKind{FrameType::tracked, "T", "tracked"},
    FrameKind{FrameType::patched, "TP", "patched"},
};
inline constexpr std::size_t frame_type_count = frame_kinds.size();

constexpr const FrameKind& kind_of(FrameType type) { return frame_kinds[static_cast<std::size_t>(type)]; }
// The kind with this letter, or null.
constexpr const FrameKind* kind_of_letter(std::string_view letter) {
    for (const auto& kind : frame_kinds)
        if (kind.letter == letter) return &kind;
    return nullptr;
}

// The parts of a frame's payload. A reader may skip each by its length, except a T-frame's. The numbers are those of
// the stream; docs/bitstream.md, section 4, describes the contents for each kind of frame.
enum class Layer : std::uint8_t {
    pose = 1,
    transforms = 2,
    geometry = 3,
    colour = 4,
    normals = 5,
    texcoords = 6,
    mapping = 7,
    fans = 8,  // the paper's connectivity: fans and distance orders
    distance_orders = 9,
    external_intra = 10,  // a whole mesh, coded by another coder
    coded_bones = 11,
    tracked = 12,        // a T-frame's payload
    removed = 13,        // what a patch takes out
    border = 14,         // where a patch is joined
    charts = 15,         // how triangles lie in the texture's picture
    presence = 16,       // which vertices are there
    reason = 17,         // why the encoder sent the frame: a FrameReason
    levels = 18,         // of the surface of a base mesh
    level_colours = 19,  // of the detail of such a surface
};

struct LayerName {
    Layer layer;
    const char* name;
};
inline constexpr std::array frame_layers = {
    LayerName{Layer::pose, "pose"},
    LayerName{Layer::transforms, "transforms"},
    LayerName{Layer::geometry, "geometry"},
    LayerName{Layer::colour, "colour"},
    LayerName{Layer::normals, "normals"},
    LayerName{Layer::texcoords, "texcoords"},
    LayerName{Layer::mapping, "mapping"},
    LayerName{Layer::fans, "fans"},
    LayerName{Layer::distance_orders, "distance order"},
    LayerName{Layer::external_intra, "external intra"},
    LayerName{Layer::coded_bones, "coded bones"},
    LayerName{Layer::tracked, "tracked"},
    LayerName{Layer::removed, "removed"},
    LayerName{Layer::border, "border"},
    LayerName{Layer::charts, "charts"},
    LayerName{Layer::presence, "presence"},
    LayerName{Layer::reason, "reason"},
    LayerName{Layer::levels, "levels"},
    LayerName{Layer::level_colours, "level colours"},
};
inline constexpr std::size_t layer_count = frame_layers.size() + 1;  // the largest number plus one; 0 is not a layer

// The bytes of a frame by layer: bytes[Layer::geometry]. Geometry and colour include their codebook, in the frame that
// it came with.
struct LayerBytes {
    std::array<std::size_t, layer_count> of_layer{};
    std::size_t overhead = 0;  // packet headers, checksums, counts, steps, ends of runs
    std::size_t& operator[](Layer layer) { return of_layer[static_cast<std::size_t>(layer)]; }
    std::size_t operator[](Layer layer) const { return of_layer[static_cast<std::size_t>(layer)]; }
    LayerBytes& operator+=(const LayerBytes& other) {
        for (std::size_t i = 0; i < layer_count; ++i) of_layer[i] += other.of_layer[i];
        overhead += other.overhead;
        return *this;
    }
    std::size_t total() const { return std::accumulate(of_layer.begin(), of_layer.end(), overhead); }
};

// Why the encoder sent an I- or TP-frame where a smaller one might have done. The numbers are those of the stream, in
// the order of frame_reasons.
enum class FrameReason : std::uint8_t { none, due, patches, surface, region, strays, border, texture, rate, cut };

struct FrameReasonName {
    FrameReason reason;
    const char* name;
    const char* meaning;
};
inline constexpr std::array frame_reasons = {
    FrameReasonName{FrameReason::none, "none", "it is not told, as of the first frame"},
    FrameReasonName{FrameReason::due, "due",
                    "the longest key interval has passed, the caller asks for it, or there is nothing to refer to"},
    FrameReasonName{FrameReason::patches, "patches", "whoever joins late would need too many patches"},
    FrameReasonName{FrameReason::surface, "surface", "the reference fits worse than it could, over all the surface"},
    FrameReasonName{FrameReason::region, "region", "the reference does not fit in one region, such as a hand"},
    FrameReasonName{FrameReason::strays, "strays", "too much of the surface is far from the reference"},
    FrameReasonName{FrameReason::border, "border", "surface was captured that the reference does not have"},
    FrameReasonName{FrameReason::texture, "texture", "the capture's texture atlas is laid out anew"},
    FrameReasonName{FrameReason::rate, "rate", "a frame that refers to another would take more bits"},
    FrameReasonName{FrameReason::cut, "cut", "the picture would fall apart: a cut, or another person"},
};

constexpr const char* name_of(FrameReason reason) { return frame_reasons[static_cast<std::size_t>(reason)].name; }

struct FrameInfo {
    FrameType type = FrameType::intra;
    FrameReason reason = FrameReason::none;  // of an I- or TP-frame
    std::uint32_t frame = 0;
    std::uint32_t reference = 0;  // number of the frame it refers to; for a T-frame the reference or the previous frame
    std::uint32_t sequence = 0;   // of a decoded frame: SequenceInfo::ordinal
    std::int64_t timestamp_us = 0;                            // microseconds
    std::uint32_t source_vertices = 0, source_triangles = 0;  // of the captured mesh
    std::uint32_t vertices = 0, triangles = 0;                // of the decoded mesh
    // T-frames: how many its group has, and which of them it is, from 1. The bytes are those of its packet, which may
    // bring others of the group.
    std::uint8_t group = 1, place = 1;
    LayerBytes bytes;
};

// The size of a frame in a first pass, by which a second pass distributes its bits.
struct FrameCost {
    FrameType type = FrameType::intra;
    double quality = 50;  // the quality setting used
    double bits = 0;
    double renewed = 0;  // TP: the share of its vertices that are new, 0..1
};

}  // namespace htvm
