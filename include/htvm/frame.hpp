// What encoder and decoder say of a frame: its kind and where its bytes went.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace htvm {

// The kinds of frames; their order is that of frame_kinds.
enum class FrameType : std::uint8_t {
    intra,      // by itself
    enhanced,   // against the last I-frame, with connectivity of its own
    predicted,  // the last I-frame's mesh moved, nothing else
    tracked,    // the last I-frame's mesh laid on the captured surface
};

// What people call them. What the codec must know of each besides is in src/codec/frame_kinds.cpp.
struct FrameKind {
    FrameType type;
    const char* letter;  // as in tables and on the command line
    const char* name;
};
inline constexpr std::array frame_kinds = {
    FrameKind{FrameType::intra, "I", "intra"},
    FrameKind{FrameType::enhanced, "EP", "enhanced"},
    FrameKind{FrameType::predicted, "P", "predicted"},
    FrameKind{FrameType::tracked, "T", "tracked"},
};
inline constexpr std::size_t frame_type_count = frame_kinds.size();
inline constexpr std::array all_frame_types = {FrameType::intra, FrameType::enhanced, FrameType::predicted,
                                               FrameType::tracked};

constexpr const FrameKind& kind_of(FrameType type) { return frame_kinds[static_cast<std::size_t>(type)]; }
// The kind of this letter, or null.
constexpr const FrameKind* kind_of_letter(std::string_view letter) {
    for (const auto& kind : frame_kinds)
        if (kind.letter == letter) return &kind;
    return nullptr;
}

// Bytes of one frame by layer. The paper's layers: geometry, colour, mapping, and connectivity = fans +
// distance_orders.
struct LayerBytes {
    std::size_t overhead = 0;  // packet headers, counts, checksums
    std::size_t pose = 0;
    std::size_t transforms = 0;
    std::size_t geometry = 0;  // with its codebook, in the frame that brought it
    std::size_t colour = 0;    // likewise
    std::size_t normals = 0;
    std::size_t texcoords = 0;
    std::size_t mapping = 0;
    std::size_t fans = 0;
    std::size_t distance_orders = 0;
    std::size_t external_intra = 0;  // all of a mesh that another coder packed
    std::size_t total() const {
        return overhead + pose + transforms + geometry + colour + normals + texcoords + mapping + fans +
               distance_orders + external_intra;
    }
};

struct FrameInfo {
    FrameType type = FrameType::intra;
    std::uint32_t frame = 0;
    std::uint32_t reference = 0;    // number of the frame it refers to: the I-frame, of a T-frame also the frame before
    std::int64_t timestamp_us = 0;  // microseconds
    std::uint32_t source_vertices = 0, source_triangles = 0;  // of the captured mesh
    std::uint32_t vertices = 0, triangles = 0;                // of the decoded mesh
    LayerBytes bytes;
};

// What a frame took in a first pass: what a second one spreads its bits by.
struct FrameCost {
    FrameType type = FrameType::intra;
    double quality = 50;  // of the quality knob
    double bits = 0;
};

}  // namespace htvm
