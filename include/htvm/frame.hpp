// What encoder and decoder say of a frame: its kind and where its bytes went.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace htvm {

enum class FrameType : std::uint8_t {
    intra,      // I: by itself
    enhanced,   // EP: against the last I-frame
    predicted,  // P: the last I-frame's mesh moved, nothing else
    tracked,    // T: the last I-frame's mesh laid on the captured surface
};

inline constexpr std::array all_frame_types = {FrameType::intra, FrameType::enhanced, FrameType::predicted,
                                               FrameType::tracked};
inline constexpr std::size_t frame_type_count = all_frame_types.size();

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
