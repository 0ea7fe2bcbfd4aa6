// Draco files (.drc), meshes and point clouds, read with libdraco.
//
// Positions are floats or integers (taken as they are); colours have 3 or 4 components (alpha is dropped) of 8 bits, of
// 16 bits, or as floats 0..1; normals have 3 components, texture coordinates 2. The first attribute of each kind is
// used. Each of Draco's points becomes a vertex, in Draco's order, with the attributes mapped to it; a vertex
// on a seam of an attribute thus appears once for each side. Faces keep their order and orientation.
//
// Positions keep the file's own unit: see mesh_file.h for the scale to millimetres.
//
// For untrusted files: the counts in the header are compared with the size of the file before libdraco sees it,
// libdraco's exceptions become errors, and its output is checked. What libdraco does in between cannot be controlled:
// version 1.5.5 can spend ten seconds on a damaged kilobyte with texture coordinates. Read untrusted .drc files in a
// process of their own.
#pragma once

#include <cstdint>
#include <span>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "io/mesh_reading.h"

namespace htvm {

// Errors: bad_input if the bytes are not a Draco file, are truncated or damaged, have no positions, or a position is
// not finite; unsupported for bitstreams before 2.2 (Draco 1.2, 2017) and for other attribute layouts; limit.
Result<Mesh> read_drc(std::span<const std::uint8_t> bytes, const MeshReadOptions& options = {},
                      MeshFindings* findings = nullptr);

}  // namespace htvm
