// PLY, the polygon file format: reads text and binary files of either byte order, writes binary little-endian.
//
// Read: the element "vertex" (x y z; nx ny nz; s t, u v, texture_u texture_v and the like; red green blue, r g b,
// diffuse_red ... or a list "color"), of the element "face" the list "vertex_indices" or "vertex_index", and the same
// of "tristrips", triangle strips parted by -1. Everything else is skipped. Polygons become triangles as polygon.h
// says, keeping their orientation; faces with fewer than three corners are left out. Normals, colours and texture
// coordinates that are not finite become 0; normals are not normalised. Vertices that are not finite: finite_mesh.h.
//
// Colours of one byte are 0..255; the range of others is the options', or else the one that the mesh's own levels speak
// for. Colours of faces (red green blue, or the list "color", also of each corner) become those of vertices, on
// average, where vertices have none. Texture coordinates of faces' corners (the list "texcoord") split vertices. The
// faces' "texnumber" says which of several images is theirs: each image is a part of the texture, and faces that name
// none that there is are a part without one.
//
// Headers: as ply_header.h says. Text bodies may have comments and empty lines anywhere, decimal commas, and 1.#QNAN
// and the like for what is not a number.
//
// A comment in the header may say when the frame was captured: "comment timestamp 1.25", in any form that parse_time()
// reads (timestamps.h), which images are the texture: "comment TextureFile NAME", once for each, and how many frames a
// second its camera means to send: "comment fps 29.97".
//
// Positions keep the file's own unit: see mesh_file.h for the scale to millimetres.
//
// Errors: bad_input, with the vertex or face (counted from 0), if the file is truncated, too many positions are not
// finite or an index is out of range; limit; unsupported. Nothing is allocated for a count that the available bytes
// cannot hold.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "io/mesh_reading.h"

namespace htvm {

struct PlyAtStart {
    Mesh mesh;
    MeshFindings findings;
    std::string timestamp, fps;      // what the header's comments say; empty: nothing
    std::size_t bytes_consumed = 0;  // the position at which the next PLY may begin
};

// Reads the one PLY at the beginning of the bytes (white space, zero bytes and a byte-order mark before it are
// skipped); others may follow.
Result<PlyAtStart> read_ply_at_start(std::span<const std::uint8_t> bytes, const MeshReadOptions& options = {});

// Reads the bytes of a file. Trailing bytes are ignored, but a second PLY is an error, so that no mesh is dropped
// silently.
Result<Mesh> read_ply(std::span<const std::uint8_t> bytes, const MeshReadOptions& options = {},
                      MeshFindings* findings = nullptr);

// The text after "comment timestamp" in the header of the PLY at the start of the stream; empty if there is none.
Result<std::string> read_ply_timestamp(std::istream& stream);

// Binary little-endian: float x y z, then, if the mesh has them, float nx ny nz, float s t, uchar red green blue; faces
// as uchar, uint vertex_indices. timestamp, texture and fps: for the comments; empty: none. origin: added to the
// positions, which are then doubles; zeros: they stay floats. Fails (bad_input) if check_mesh does.
Result<std::vector<std::uint8_t>> write_ply(const Mesh& mesh, std::string_view timestamp = {},
                                            std::string_view texture = {}, std::string_view fps = {},
                                            const std::array<double, 3>& origin = {});

// Reads PLYs that follow one another in a stream. One mesh is held at a time, and the stream is not read past the end
// of the mesh returned, so the meshes of a live stream are available as soon as they are complete.
class PlyStreamReader {
public:
    // The stream must outlive the reader.
    explicit PlyStreamReader(std::istream& stream, const MeshReadOptions& options = {});
    // The next mesh; nothing at the end of the stream. After an error it is unknown where the next mesh begins, so the
    // same error (which names the mesh, counted from 0) is returned again.
    Result<std::optional<Mesh>> next();
    // For the mesh that next() returned, as from read_ply_timestamp().
    const std::string& timestamp() const { return timestamp_; }
    const std::string& fps() const { return fps_; }
    // Likewise, what was found besides the mesh.
    const MeshFindings& findings() const { return findings_; }

private:
    std::istream& stream_;
    MeshReadOptions options_;
    std::string timestamp_, fps_;
    MeshFindings findings_;
    std::size_t meshes_read_ = 0;
    std::optional<Error> error_;
};

}  // namespace htvm
