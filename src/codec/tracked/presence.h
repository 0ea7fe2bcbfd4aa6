// Which vertices of a tracked mesh are there, from version 7 of the stream on (presence_version). What a depth camera
// delivers is a view: its border moves, an arm casts a hole on the chest that wanders. The reference is the union of
// what was seen, and each frame says which part of it is there. What is not there goes on moving with its nodes, and
// comes back without a new vertex.
//
// A triangle is shown if its three vertices are there. A vertex is coded as what it was before, mostly: in contexts of
// how far the border was, and of what became of the neighbours that come before it in the order of the vertices.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/reference/node_reference.h"
#include "core/geometry.h"
#include "entropy/range_coder.h"
#include "htvm/mesh.hpp"

namespace htvm::internal {

// Behind both sides of a group's frame (tracked/frame_group.h): one of the two frames has the vertex, the other has
// not.
inline constexpr std::uint8_t doubtful_presence = 2;

// presence: 0 or 1 for each vertex of the mesh whose neighbours `around` are. before: what is known of it, one per
// vertex, doubtful where nothing is; or none: all were there.
void write_presence(RangeEncoder& encoder, const VerticesAround& around, std::span<const std::uint8_t> before,
                    std::span<const std::uint8_t> presence);
// Gives 0 or 1 for each vertex, whatever the bytes say.
Presence read_presence(RangeDecoder& decoder, const VerticesAround& around, std::span<const std::uint8_t> before);

// The same as a layer of its own, of a mesh by itself: an I-frame's.
std::vector<std::uint8_t> write_presence_layer(std::span<const Triangle> triangles,
                                               std::span<const std::uint8_t> presence);
// Errors: corrupt_stream where the layer ends too early.
Result<Presence> read_presence_layer(std::span<const std::uint8_t> layer, std::size_t vertices,
                                     std::span<const Triangle> triangles);

// What is known of a frame's vertices from the two that it lies between. later: none: all of them are there.
Presence presence_between(std::span<const std::uint8_t> earlier, std::span<const std::uint8_t> later);

// The presence of a patched mesh: what stays is there as it was, what is new is there. presence: of the mesh before, or
// none.
Presence presence_of_patched(std::span<const std::uint8_t> presence, std::span<const std::uint32_t> stays,
                             std::size_t vertices);

// Whether a vertex is missing. presence: one per vertex, or none.
bool anything_absent(std::span<const std::uint8_t> presence);
// The triangles whose three vertices are there, in their order. presence: one per vertex, or none.
void triangles_shown(std::span<const Triangle> triangles, std::span<const std::uint8_t> presence,
                     std::vector<Triangle>& out);

}  // namespace htvm::internal
