// Connectivity of an I-frame: triangle fans (TFAN; Mamou, Zaharia, Preteux 2009; the paper's sections III-C and IV-D).
//
// Vertices are visited through a first-in first-out queue. All triangles at the vertex in front (the focus) that are
// not coded yet are coded as oriented fans: a fan with the boundary a0, a1, ..., ad consists of the triangles (focus,
// a0, a1), (focus, a1, a2), ... A vertex met for the first time joins the queue and takes the next number, so the
// decoder outputs the vertices in visiting order. Any set of triangles is reproduced exactly: non-manifold, of mixed
// orientation, degenerate or duplicate, with isolated vertices. docs/bitstream.md has the syntax.
//
// MPEG-4's TFAN writes degrees, configurations, operations and indices into separate streams. Here each step of a fan
// is one or two decisions among the few vertices that the open edges offer, with contexts that tell how complete the
// surroundings are; this takes about a third fewer bits. The traversal is in triangle_fans.h, which M-TFAN shares.
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
    // What the decoder returns, in output numbers: sorted by focus vertex, and in order around it. Each triangle is
    // rotated to begin with its focus, which keeps its orientation.
    std::vector<Triangle> triangles;
};

// Every triangle index must be < vertex_count. Time and memory are linear in vertices and triangles.
EncodedTfan encode_tfan(std::uint32_t vertex_count, std::span<const Triangle> triangles);

// The triangles that encode_tfan announced, given the same two counts. corrupt_stream if the bytes name an impossible
// vertex or end early. Time and memory are linear in the vertices and triangles decoded, which never exceed the counts.
Result<std::vector<Triangle>> decode_tfan(std::span<const std::uint8_t> bytes, std::uint32_t vertex_count,
                                          std::uint32_t triangle_count);

}  // namespace htvm::internal
