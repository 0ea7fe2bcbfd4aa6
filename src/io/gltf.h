// glTF 2.0 (.glb, .gltf), one mesh per file. A whole stream in one file: gltf_animation.h.
//
// tinygltf is not used to read: version 2.7 reads eight bytes past the end of a cut-off .glb, overflows the stack on
// nested brackets, copies the binary chunk for every buffer that names it, and leaves the bounds of accessors to its
// caller.
//
// Read: every mesh that the file's scene shows, joined to one, with the transforms of the nodes applied, instances too
// (EXT_mesh_gpu_instancing), less those that are hidden by KHR_node_visibility or by a scale of nothing. POSITION,
// NORMAL, COLOR_0 and the texture coordinates that the image uses, of floats or integers, sparse or not, or compressed
// by Draco; triangles, strips, fans, or points alone, with indices or without. A vertex that lacks what others have is
// white, has a zero normal, texture coordinate 0, 0. Primitives of one mesh that share their vertices go on sharing
// them. Vertices whose positions are no numbers are left out (finite_mesh.h).
//
// What it looks like is by gltf_material.h. TextureReference gets each image once, and a part for each look in the
// order of the materials; colours of parts and of vertices multiply the image. Where nothing has an image, the
// materials' colours are those of the vertices, and multiply theirs; a grey that is everywhere, as programs write it by
// default, is none.
//
// Passed over, with a remark: lines, points beside triangles, emission besides a colour, what alpha lets through,
// animations (everything is as at rest), scenes but the shown one, extensions that are not known. Without one: cameras,
// lights and how surfaces answer light.
//
// Not read, with an error that says so: skins whose pose changes the shape and weighted morph targets (the vertices of
// a frame are what counts), views that are compressed by meshopt and have no plain ones beside them, and required
// extensions that are not known. Images as KTX2 or AVIF alone are told apart by their name, which says so.
//
// glTF's colours are linear light, ours sRGB levels: 16 bits keep each of the 256 levels. Its texture coordinates begin
// at the top of the picture, ours at the bottom, as in OBJ: v becomes 1 - v. Positions keep the file's own unit, which
// is to be the metre: see mesh_file.h for the scale to millimetres. The transforms are applied, and the origin is taken
// off, in doubles.
//
// Draco goes through libdraco: read untrusted files in a process of their own (drc.h).
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
