// What a vertex of an intra frame can be predicted from. This follows from connectivity alone, so encoder and decoder
// find the same before any attribute is decoded.
//
// Attributes are coded in an order of their own, not in the order of the vertices: next is always the vertex that has
// the most parallelograms with three known corners, so that most vertices are predicted from several sides.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/progress.h"
#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

// Two triangles that share an edge and of whose four corners three are known: the fourth is predicted as a + b -
// opposite. It lies either across the shared edge a, b from `opposite`, or at an end of the shared edge, as `opposite`
// does. If the triangles are counter-clockwise, (b - opposite) x (a - opposite) points outside.
struct Parallelogram {
    std::uint32_t a = 0, b = 0, opposite = 0;
    bool across = true;
};

// Arrays over the ranks of the coding order, in compressed rows: row k is first_x[k] .. first_x[k + 1]. Every vertex
// named in row k has a rank below k. A row has at most eight parallelograms and eight neighbours. The rows' arrays may
// be longer than their last row.
struct Neighbours {
    std::vector<std::uint32_t> order;  // order[k] = the vertex coded at rank k; a permutation of 0 .. n - 1
    std::vector<std::uint32_t> first_parallelogram;
    std::vector<Parallelogram> parallelograms;
    std::vector<std::uint32_t> first_neighbour;
    std::vector<std::uint32_t> neighbours;  // distinct vertices that share a triangle with order[k]

    std::size_t vertex_count() const { return order.size(); }
    std::span<const Parallelogram> parallelograms_of(std::size_t rank) const {
        return std::span(parallelograms)
            .subspan(first_parallelogram[rank], first_parallelogram[rank + 1] - first_parallelogram[rank]);
    }
    std::span<const std::uint32_t> neighbours_of(std::size_t rank) const {
        return std::span(neighbours).subspan(first_neighbour[rank], first_neighbour[rank + 1] - first_neighbour[rank]);
    }
};

inline constexpr std::size_t row_limit = 8;  // most parallelograms, and most neighbours, per vertex

// Vertices whose values both sides have before anything is decoded, such as those on the border of a patch: nothing is
// coded for them, and others are predicted from them. Both arrays have one entry per vertex, or none if nothing is
// known.
template <class Value>
struct Known {
    std::span<const std::uint8_t> is;  // 1 if it is known
    std::span<const Value> value;      // only read where it is
};

// A corner table: corner 3 t + i is corner i of triangle t. Degenerate triangles have no corners in it.
struct Corners {
    std::vector<std::uint32_t> vertex;    // of each corner
    std::vector<std::uint32_t> opposite;  // the corner on the other side of the edge opposite to this corner, or none
    std::vector<std::uint32_t> first_at;  // where each vertex's row of `at` begins
    std::vector<std::uint32_t> at;        // the corners at each vertex, in triangle order
    std::size_t paired_edges = 0;         // edges whose two sides both have a corner
};

// Accepts any triangles (non-manifold, duplicate, open, none). At each edge the first triangle is paired with the
// second, the third with the fourth, and so on. Time and memory are linear in vertices plus triangles. Errors:
// bad_input if a triangle names a vertex >= vertex_count; limit above 2^28 vertices or triangles.
Result<Corners> find_corners(std::span<const Triangle> triangles, std::size_t vertex_count, Threads threads = {});

// Rows for these corners, all of them empty and every rank's vertex 0, for order_vertices() to fill.
Neighbours empty_rows(const Corners& corners);

// The coding order and the candidates of each vertex. out: from empty_rows(), of the same corners. known: as in Known;
// these vertices come first. progress: of how many ranks the rows are there, for whoever follows behind; or null.
// Throws std::bad_alloc only before the first rank.
void order_vertices(const Corners& corners, std::span<const std::uint8_t> known, Neighbours& out,
                    Progress* progress = nullptr);

// All of the above. Errors: as find_corners().
Result<Neighbours> find_neighbours(std::span<const Triangle> triangles, std::size_t vertex_count,
                                   std::span<const std::uint8_t> known = {});

}  // namespace htvm::internal
