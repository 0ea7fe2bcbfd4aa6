// The mesh that tracked frames refer to: the captured one with as few vertices as show its surface and colours. Encoder
// side.
#pragma once

#include "codec/reference/lattice_mesh.h"
#include "surface/target_surface.h"
#include "core/thread.h"

namespace htvm::internal {

struct SimplifiedReferenceOptions {
    double surface_error = 16;  // lattice units, > 0: see SimplificationOptions
    double colour_error = 16;   // levels, > 0
    double longest_edge = 640;  // lattice units, > 0
    double reach = 480;         // lattice units: how far the captured surface is looked for
    Threads threads = {};
};

// Normals are made anew where the capture has them. Texture coordinates cannot be simplified: a mesh that has some, or
// has no triangles, comes back as it is.
// surface: of `captured`.
LatticeMesh simplified_reference(const LatticeMesh& captured, const TargetSurface& surface,
                                 const SimplifiedReferenceOptions& options);

}  // namespace htvm::internal
