// Draco files (.drc), meshes and point clouds, read with libdraco.
//
// Positions are numbers of any type, less the origin; normals and texture coordinates floats, or integers that stand
// for shares. Colours have 3 or 4 components (alpha is dropped), or 1 or 2, which are grey; of bytes, of integers that
// are said to be shares, or of others whose range is that of the capture (colour_range.h). The first attribute of each
// kind is used; more of them, and such as have too few components, are passed over with a remark. Vertices whose
// positions are no numbers are left out (finite_mesh.h). Each of Draco's points becomes a vertex, in Draco's order,
// with the attributes mapped to it; a vertex on a seam of an attribute thus appears once for each side. Faces keep
// their order and orientation.
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

// Bytes behind the mesh are not looked at. Errors: bad_input if the bytes are not a Draco file, are truncated or
// damaged, have no positions, or too many that are not finite; unsupported for bitstreams before 1.0 and for positions
// of one component; limit.
Result<Mesh> read_drc(std::span<const std::uint8_t> bytes, const MeshReadOptions& options = {},
                      MeshFindings* findings = nullptr);

}  // namespace htvm
