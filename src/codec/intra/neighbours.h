// What a vertex of an intra frame can be predicted from, found in the connectivity alone: encoder and decoder find the
// same, before any attribute is decoded.
//
// Attributes are not coded in the order of the vertices but in a coding order of their own: always the vertex that has
// the most parallelograms with three corners known, so that most vertices are predicted from several sides.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

// Two triangles that share an edge, three of their four corners known: the fourth is predicted as a + b - opposite.
// Either it lies across the shared edge a, b from `opposite`, or it ends the shared edge, as `opposite` does. Where the
// triangles turn counter-clockwise, (b - opposite) x (a - opposite) points outside.
struct Parallelogram {
    std::uint32_t a = 0, b = 0, opposite = 0;
    bool across = true;
};

// Arrays over the ranks of the coding order, in compressed rows: row k spans first_x[k] .. first_x[k + 1].
// Every vertex named in row k has a rank below k. At most eight parallelograms and eight neighbours a row.
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

inline constexpr std::size_t row_limit = 8;  // parallelograms, and neighbours, kept for a vertex

// The coding order and the candidates of each vertex. Any triangles will do (non-manifold, duplicate, open, none);
// degenerate ones are passed over, and of the triangles at an edge the first pairs with the second, the third with the
// fourth and so on. Time and memory are proportional to vertices plus triangles.
// Errors: bad_input where a triangle names a vertex >= vertex_count; limit above 2^28 vertices or triangles.
Result<Neighbours> find_neighbours(std::span<const Triangle> triangles, std::size_t vertex_count);

}  // namespace htvm::internal
