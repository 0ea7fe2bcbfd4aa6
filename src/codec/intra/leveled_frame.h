// An I-frame as a base mesh and the levels of its surface (docs/bitstream.md, section 6.9). The base is coded as a
// mesh of its own; the levels follow in a layer. Frames refer to the mesh of one of the first levels, which has the
// frame's attributes; those below it are its detail, which it is shown with.
//
// Layer: the level that frames refer to (8 bits), the base's vertices and triangles (varints), then a payload of
// surface_levels.h. The frame's header counts the mesh that frames refer to.
#pragma once

#include <cstdint>
#include <vector>

#include "codec/format/frame_payload.h"
#include "codec/intra/surface_levels.h"
#include "codec/reference/surface_detail.h"
#include "core/thread.h"
#include "htvm/lattice_mesh.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

// The detail has at most so many vertices for each of the mesh that frames refer to: it bounds what a few bytes can
// make a decoder do, in this frame and in those that refer to it.
inline constexpr std::size_t most_detail = 32;

struct LeveledFrame {
    LatticeMesh mesh;      // that frames refer to
    SurfaceDetail detail;  // of it
};

// Takes a decoded surface apart. referred: the level that frames refer to, or the last if there are fewer.
LeveledFrame leveled_frame(const SurfaceLevels& levels, LeveledSurface surface, std::uint32_t referred);

// The layer. base: counts of the base mesh. payload: of the levels.
std::vector<std::uint8_t> write_levels_layer(std::uint32_t referred, CapturedCounts base,
                                             std::span<const std::uint8_t> payload);

// What a level adds to those above it; the base is the first.
struct LevelShare {
    std::size_t vertices = 0;
    std::size_t bytes = 0;         // connectivity and places
    std::size_t colour_bytes = 0;  // of the mesh that frames refer to, with the level that this is; of each below it
    bool referred = false;         // whether frames refer to it and those above
};
// The shares of an I-frame's levels; nothing where it has none. Errors: as decode_leveled_frame().
Result<std::vector<LevelShare>> level_shares(const FramePayloadView& payload, std::size_t most_vertices);

// most_vertices: of the mesh with all its detail. Errors: corrupt_stream, limit.
Result<LeveledFrame> decode_leveled_frame(const FramePayloadView& payload, std::size_t most_vertices,
                                          Threads threads = {});

}  // namespace htvm::internal
