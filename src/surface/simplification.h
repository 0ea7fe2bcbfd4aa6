// A mesh with fewer vertices that shows the same surface and colours: edges are collapsed, the cheapest first, until
// the next would err too much (quadric error metrics; Garland and Heckbert 1997). For the meshes that tracked frames
// refer to, whose own sampling nobody asked for.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "htvm/mesh.hpp"

namespace htvm::internal {

struct SimplificationOptions {
    double surface_error = 0;  // most that a vertex may be off the planes it stands for (root mean square), units of
                               // the positions; 0: nothing is collapsed
    double colour_error = 12;  // likewise of the colours it stands for, levels
    double longest_edge = 0;   // no collapse makes an edge longer than this; 0: no bound
};

struct SimplifiedMesh {
    std::vector<Eigen::Vector3d> positions;
    std::vector<Triangle> triangles;
    std::vector<std::array<double, 3>> colours;  // levels, means of what each vertex stands for; empty as the input's
    std::uint64_t looked_at = 0;                 // triangles looked at, most of them many times: the work it took
};

// triangles: indices within positions; any mesh: borders stay where they are to within the error, edges of more than
// two triangles and triangles of no area are never collapsed away wrongly: a collapse that would fold the surface or
// join two sheets is left out. Vertices without triangles are kept. The same on every run, in one thread.
// A hub of more than 256 triangles stays where it is, so that the time is near-linear whatever the mesh.
SimplifiedMesh simplify(std::span<const Eigen::Vector3d> positions, std::span<const Triangle> triangles,
                        std::span<const Colour> colours, const SimplificationOptions& options);

}  // namespace htvm::internal
