// Connectivity of an I-frame: triangle fans (TFAN; Mamou, Zaharia, Preteux 2009; the paper's sections III-C and IV-D).
//
// Vertices are visited through a first-in first-out queue. All triangles at the vertex in front (the focus) that were
// not coded yet are coded as oriented fans: a fan with the boundary a0, a1, ..., ad holds the triangles
// (focus, a0, a1), (focus, a1, a2), ... A vertex met for the first time joins the queue and takes the next number, so
// the decoder gives the vertices in visiting order. Any set of triangles comes back exactly: non-manifold, of mixed
// orientation, degenerate or duplicate, with isolated vertices. docs/bitstream.md has the syntax.
//
// MPEG-4's TFAN writes degrees, configurations, operations and indices into separate streams. Here each step of a fan
// is a decision or two among the few vertices that the open edges offer, in contexts of how full its surroundings are:
// about a third fewer bits. The traversal is in triangle_fans.h, which M-TFAN shares.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

struct EncodedTfan {
    std::vector<std::uint8_t> bytes;
    // The input index of each output vertex: a permutation of all vertices. Isolated vertices are last, in input order.
    std::vector<std::uint32_t> order;
    // What the decoder returns, in output numbers: by focus vertex, ascending, and in order around it; each triangle
    // turned so that it starts with its focus. Turning keeps a triangle's orientation.
    std::vector<Triangle> triangles;
};

// Every triangle index must be < vertex_count. Time and memory are linear in vertices and triangles.
EncodedTfan encode_tfan(std::uint32_t vertex_count, std::span<const Triangle> triangles);

// The triangles that encode_tfan promised, for the same two counts. corrupt_stream where the bytes name a vertex that
// cannot be, or end early. Work and memory are linear in the vertices and triangles decoded, which are no more than
// the counts.
Result<std::vector<Triangle>> decode_tfan(std::span<const std::uint8_t> bytes, std::uint32_t vertex_count,
                                          std::uint32_t triangle_count);

}  // namespace htvm::internal
