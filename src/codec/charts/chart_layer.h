// Charts: how a reference's triangles lie in the texture's picture. A chart is a set of triangles with one projection
// of their corners onto a plane, so that no texture coordinate is sent: the stream tells which triangles belong
// together, and of each chart which way its plane faces, its size and its place in the picture. Both sides derive the
// coordinates from decoded positions, in integers.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/reference/textured_surface.h"
#include "codec/reference/transforms.h"
#include "core/lattice.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "htvm/texture_layout.hpp"

namespace htvm::internal {

// Projected coordinates are in texels times 2^texel_bits.
inline constexpr int texel_bits = 4;
// Components of a chart's rotation are multiples of this.
inline constexpr int coarse_rotation = 128;
// A chart's size is relative to that of the layout, in sixteenths.
inline constexpr int usual_size = 16, largest_size = 64;
inline constexpr std::uint32_t largest_scale = (1u << 24) - 1;
inline constexpr std::uint32_t no_chart = 0xFFFFFFFF;
// A layer has at most so many: this bounds the time that few bytes can make a decoder take.
inline constexpr std::size_t most_charts = 255;

struct Chart {
    QuantisedRotation rotation;      // turns the picture's x into the first axis, y (up) into the second, the direction
                                     // from which the plane is seen into the third
    std::int32_t size = usual_size;  // 1..largest_size
    std::int32_t x = 0, y = 0;       // where the lower left corner of what bounds it lies, texels, 0..4095
};

// The charts of all of a mesh's triangles, or of those from some index on.
struct ChartLayout {
    std::uint32_t scale = 1;    // texels of 2^-texel_bits in a lattice unit, times 2^16; 1..largest_scale
    std::vector<Chart> charts;  // in the order in which the triangles name them first
    std::vector<std::uint32_t> chart_of_triangle;  // of each such triangle, from 0
};

// positions: of the mesh, as shown. triangles: those that the layout is of; they may name any of the positions.
std::vector<std::uint8_t> encode_charts(const ChartLayout& layout, std::span<const LatticePoint> positions,
                                        std::span<const Triangle> triangles);
// Errors: corrupt_stream.
Result<ChartLayout> decode_charts(std::span<const std::uint8_t> bytes, std::span<const LatticePoint> positions,
                                  std::span<const Triangle> triangles);

// Where the triangles' corners lie, in texels times 2^texel_bits, each chart from its own lower left corner on: its
// place is not added.
std::vector<CornerTexcoords> projected_corners(const ChartLayout& layout, std::span<const LatticePoint> positions,
                                               std::span<const Triangle> triangles);
// The triangles' texture coordinates. Errors: corrupt_stream if a chart does not fit into the picture.
Result<std::vector<CornerTexcoords>> chart_texcoords(const ChartLayout& layout, const StreamTexture& picture,
                                                     std::span<const LatticePoint> positions,
                                                     std::span<const Triangle> triangles);

}  // namespace htvm::internal
