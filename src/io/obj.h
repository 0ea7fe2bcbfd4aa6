// OBJ, Wavefront's text format. tinyobjloader is not used because it keeps a polygon's corner count in 8 bits (300
// corners become 44), only warns about indices out of range, and cuts polygons by ear clipping, which loses degenerate
// ones.
//
// Read: v x y z, v x y z r g b, vt, vn, f with v, v/vt, v//vn and v/vt/vn, negative (relative) indices, comments, lines
// continued with a backslash; mtllib and usemtl, which say where the texture is. Every other statement (groups,
// objects, lines, points) is skipped. Lines end in LF, CR LF, CR or LF CR; a byte-order mark is passed over; numbers
// may have a decimal comma, and 1.#QNAN and the like are not a number. Polygons become triangles as polygon.h says,
// keeping their orientation; faces with fewer than three corners are left out; isolated vertices and degenerate
// triangles are kept. Vertices that are not finite: finite_mesh.h.
//
// Vertices keep their number and order. A position whose corners have several values of vt or vn becomes several
// vertices: the first combination keeps the position's index, the others are appended at the end, in the order in which
// they are met. A vertex that no corner refers to gets the vt (vn) with its own index if the file's faces use vt (vn)
// with the same index as v throughout and there are as many; otherwise zeros, as do corners whose vt (vn) the file does
// not have; a file without any vt (vn) gives none. The range of colours is the options', or else the one that the
// file's own levels speak for. Vertices without a colour in a file with colours are white.
//
// The parts of the texture are the materials in the order of their first use. Names of materials and mtllib's lines are
// the whole rest of their line, which may hold blanks and '#': obj_material.h takes them apart.
//
// Positions keep the file's own unit: see mesh_file.h for the scale to millimetres.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "io/mesh_reading.h"

namespace htvm {

// Errors: bad_input, naming the line, if a number cannot be read or an index refers to no position; naming the vertex,
// if too many positions are not finite; limit.
Result<Mesh> read_obj(std::string_view text, const MeshReadOptions& options = {}, MeshFindings* findings = nullptr);

// Writes lines v x y z or v x y z r g b, vt, vn, f. Positions, normals and texture coordinates are read back exactly,
// colours to the same 8 bits. Fails (bad_input) if check_mesh does.
// material_file: of the material that faces use, written by write_obj_material(); empty: none. origin: added to the
// positions, as doubles.
Result<std::string> write_obj(const Mesh& mesh, std::string_view material_file = {},
                              const std::array<double, 3>& origin = {});
// The text of such a file, for an image of that name.
std::string write_obj_material(std::string_view image);

}  // namespace htvm
