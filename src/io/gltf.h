// glTF 2.0 (.glb, .gltf), one mesh per file. A whole stream in one file: gltf_animation.h.
//
// tinygltf is not used to read: version 2.7 reads eight bytes past the end of a cut-off .glb, overflows the stack on
// nested brackets, copies the binary chunk for every buffer that names it, and leaves the bounds of accessors to its
// caller.
//
// Read: every mesh that the file's scene shows, joined to one, with the transforms of the nodes applied. POSITION,
// NORMAL, COLOR_0 (times the material's base colour) and TEXCOORD_0, of floats or integers; triangles, strips, fans and
// points, with indices or without. A material's base colour and its texture's image, with the coordinates that it
// uses (KHR_texture_transform applied; the base colour does not multiply the image). Lines, materials otherwise,
// cameras, lights and animations are passed over, and so are nodes that are scaled to nothing, which glTF uses to hide.
// A vertex that lacks what others have is white, has a zero normal, texture coordinate 0, 0. Primitives of one mesh
// that share their vertices go on sharing them.
//
// Not read, with an error that says so: sparse accessors, skins and weighted morph targets (the vertices of a frame are
// what counts), and required extensions about geometry other than KHR_mesh_quantization, such as Draco.
//
// glTF's colours are linear light, ours sRGB levels: 16 bits keep each of the 256 levels. Its texture coordinates begin
// at the top of the picture, ours at the bottom, as in OBJ: v becomes 1 - v. Positions keep the file's own unit, which
// is to be the metre: see mesh_file.h for the scale to millimetres.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "io/mesh_reading.h"

namespace htvm {

// bytes: a .glb or .gltf file; folder: where it lies. Buffers in files of their own are read only from that folder and
// those in it, not through links that lead out of it, and nothing is fetched; with an empty folder, they are errors.
// Errors: bad_input, unsupported, limit.
Result<Mesh> read_gltf(std::span<const std::uint8_t> bytes, const std::filesystem::path& folder,
                       const MeshReadOptions& options = {}, MeshFindings* findings = nullptr);

// A .glb file. Positions, normals, colours and triangles are read back exactly, texture coordinates to within 1e-7 if
// they are 0..1. Coloured meshes are unlit (KHR_materials_unlit): captured colours contain the light. Fails (bad_input)
// if check_mesh does; (limit) if the file would be larger than 4 GiB. image: the bytes of a PNG or JPEG file, which
// becomes the texture, in the place of colours; empty: none. origin: where the mesh's node stands.
Result<std::vector<std::uint8_t>> write_gltf(const Mesh& mesh, std::span<const std::uint8_t> image = {},
                                             const std::array<double, 3>& origin = {});

}  // namespace htvm
