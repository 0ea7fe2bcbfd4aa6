// Simplifies a mesh: collapses edges, cheapest first, until the next collapse would cause too large an error (quadric
// error metrics; Garland and Heckbert 1997). The result shows the same surface and colours with fewer vertices. Used
// for the meshes that tracked frames refer to, where the capture's own sampling need not be kept.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/thread.h"
#include "htvm/lattice_mesh.hpp"
#include "htvm/mesh.hpp"

namespace htvm::internal {

struct SimplificationOptions {
    double surface_error = 0;  // the largest distance (RMS) of a vertex from the planes it stands for, in units of the
                               // positions; 0: nothing is collapsed
    double colour_error = 12;  // the same for the colours it stands for, in levels
    double longest_edge = 0;   // no collapse makes an edge longer than this; 0: no limit
    bool keep_tips = true;     // a vertex at a border that has one triangle keeps it, else goes with it where it does
    // How many times smaller each vertex's error must be, and that of what it is merged with; none: all once.
    std::span<const float> finer = {};
    Threads threads = {};
};

struct SimplifiedMesh {
    std::vector<Eigen::Vector3d> positions;
    std::vector<Triangle> triangles;
    std::vector<std::array<double, 3>> colours;  // levels: for each vertex the mean of the colours it stands for; empty
                                                 // if the input has none
    std::uint64_t looked_at = 0;                 // triangles examined, counting repeats: a measure of the work done
};

// Works on any mesh. triangles: indices into positions. Borders stay in place to within the error. A collapse that
// would fold the surface or join two sheets is left out, also around edges of more than two triangles and triangles of
// no area. Vertices without triangles are kept. The same for any number of threads. A hub of more than 256 triangles
// stays where it is, so that the time is near-linear for any mesh.
SimplifiedMesh simplify(std::span<const Eigen::Vector3d> positions, std::span<const Triangle> triangles,
                        std::span<const Colour> colours, const SimplificationOptions& options);

// The same of a mesh on the lattice, whose positions and colours are rounded; without other attributes.
LatticeMesh simplified_mesh(const LatticeMesh& mesh, const SimplificationOptions& options);

}  // namespace htvm::internal
