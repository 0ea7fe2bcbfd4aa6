// What a captured mesh is like, for a report on a capture: how it hangs together, where it ends, how light it is.
#pragma once

#include <array>
#include <cstddef>

#include "htvm/mesh.hpp"

namespace htvm {

// Vertices at the same place count as one, so that seams of textures are no borders. Lengths in mm, areas in mm^2.
struct MeshFacts {
    std::size_t vertices = 0, triangles = 0;
    std::size_t unused_vertices = 0;      // in no triangle
    std::size_t collapsed_triangles = 0;  // with two corners at one place
    std::size_t pieces = 0;               // sets of triangles that hang together by their corners
    // Pieces of less than a hundredth of the largest one's area: dust of the reconstruction.
    std::size_t specks = 0;
    // Pieces that lie farther from the largest one's box than a tenth of its diagonal: spikes' ends, walls, other
    // things.
    std::size_t strays = 0;
    double border = 0;                    // length of edges that only one triangle has
    std::size_t forked_edges = 0;         // that three triangles or more have
    double area = 0, mean_edge = 0;       // of all triangles
    std::array<double, 3> low{}, high{};  // the largest piece's box
    std::array<double, 3> middle{};       // of its surface
    double light = -1;                    // mean of the surface's colours, 0..255; -1: none
};

MeshFacts facts_of(const Mesh& mesh);

}  // namespace htvm
