// The checks that all mesh readers and writers share: sizes within limits, indices in range, finite positions.
#pragma once

#include <cstdint>
#include <string_view>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm {

// The largest mesh that a reader accepts. A file that claims more is refused before anything is allocated for it.
struct MeshLimits {
    std::uint64_t most_vertices = std::uint64_t{1} << 26;   // vertices a mesh may have
    std::uint64_t most_triangles = std::uint64_t{1} << 27;  // triangles a mesh may have, after polygons are cut into
                                                            // triangles
};

// Fails (bad_input, naming the attribute, vertex or triangle) unless every attribute is empty or as long as positions,
// every position is finite and every triangle index is below the number of vertices.
Result<void> check_mesh(const Mesh& mesh);

// Fails (limit) if a count is above the limits. `what` names what is counted ("vertices"), for the message.
Result<void> check_count(std::uint64_t count, std::uint64_t most, std::string_view what);

// The value as a float, or 0 if it is not a finite float: for normals and texture coordinates, where some tools write
// NaN for missing ones.
float finite_or_zero(double value);

// True if the value is finite and remains so as a float.
bool fits_float(double value);

}  // namespace htvm
