// The published TFAN (Mamou, Zaharia, Preteux 2009), as adopted by MPEG-4, so that a comparison can be made in its own
// terms too; our own TFAN codes the same fans with contexts (codec/intra/tfan.h).
//
// Every frame is coded by itself. Vertices are visited through a first-in first-out queue; the triangles at the vertex
// in front that are not coded yet are coded as oriented fans. The numbers of fans, their degrees, their configurations,
// and the operations and indices that no configuration covers are five streams, each under one adaptive model without
// contexts. Positions, quantised to a number of bits over the longest side of the bounding box, are predicted by one
// parallelogram; colours by one neighbour. Not byte-compatible with ISO/IEC 14496-16, but near its rate:
// docs/experiments/intra_frames.md.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "coders.h"

namespace htvm::lab {

struct MpegTfanSettings {
    int position_bits = 10;  // over the longest side of the bounding box: 1..30
    int colour_step = 1;     // levels of 255: 1..255
};

struct MpegTfanFrame {
    std::vector<std::uint8_t> bytes;
    LayerBytes layers;                 // connectivity in fans, positions in geometry
    std::vector<std::uint32_t> order;  // the input index of each decoded vertex
};

// Codes positions, colours and triangles. All vertices and triangles come back, including isolated, duplicate and
// degenerate ones, in the order of the traversal; each triangle is rotated to begin with its first visited corner.
// bad_input if a triangle names a vertex that does not exist, a position is not finite, or a setting is out of range.
Result<MpegTfanFrame> encode_mpeg_tfan(const Mesh& mesh, const MpegTfanSettings& settings);

// corrupt_stream if the bytes end early or contain invalid values.
Result<Mesh> decode_mpeg_tfan(std::span<const std::uint8_t> bytes);

// Positions use the number of bits whose cells over the average frame's longest side are nearest to the sweep's step,
// as for Draco.
CoderUnderTest mpeg_tfan_under_test(const std::string& name);

}  // namespace htvm::lab
