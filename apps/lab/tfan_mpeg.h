// The published TFAN (Mamou, Zaharia, Preteux 2009), as MPEG-4 took it up: so that a comparison with it can be made in
// its own terms beside ours, which code the same fans in contexts (codec/intra/tfan.h).
//
// Every frame by itself. Vertices are visited through a first-in first-out queue; the triangles at the vertex in front
// that were not coded yet are coded as oriented fans. The numbers of fans, their degrees, their configurations, and the
// operations and indices of what no configuration names are five streams, each under one adaptive model without
// contexts. Positions, quantised to so many bits of the bounding box's longest side, are predicted by one
// parallelogram; colours by one neighbour. Not byte-compatible with ISO/IEC 14496-16, whose rate it comes near:
// docs/algorithm.md.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "coders.h"

namespace htvm::lab {

struct MpegTfanSettings {
    int position_bits = 10;  // of the bounding box's longest side: 1..30
    int colour_step = 1;     // levels of 255: 1..255
};

struct MpegTfanFrame {
    std::vector<std::uint8_t> bytes;
    LayerBytes layers;                 // connectivity in fans, positions in geometry
    std::vector<std::uint32_t> order;  // the input index of each decoded vertex
};

// The mesh's positions, colours and triangles: all vertices and triangles come back, isolated, duplicate and degenerate
// ones too, in the order of the traversal, each triangle turned to begin with its first visited corner. bad_input where
// a triangle names a vertex that is not there, a position is not finite, or a setting is out of its range.
Result<MpegTfanFrame> encode_mpeg_tfan(const Mesh& mesh, const MpegTfanSettings& settings);

// corrupt_stream where the bytes end early or name what cannot be.
Result<Mesh> decode_mpeg_tfan(std::span<const std::uint8_t> bytes);

// Positions in the bits whose cells over the mean frame's longest side are nearest to the sweep's step, as Draco's.
CoderUnderTest mpeg_tfan_under_test(const std::string& name);

}  // namespace htvm::lab
