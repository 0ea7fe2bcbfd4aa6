// Volograms (.vols): all frames of a capture in one file, or in sequence files beside a header, of versions 1.0 to 1.3.
//
// A key frame has vertices, triangles and texture coordinates; those that follow have vertices alone, and go on with
// its triangles. Files are left-handed, as Unity is: x is mirrored and triangles are turned round, as the vendor's own
// converter does. Positions are in metres, texture coordinates begin at the bottom of the picture. The pictures are in
// a video beside the file; such as are compressed inside of it (Basis, KTX2) are not read.
//
// Nothing that the file says of sizes is believed: each array is inside of its file before it is read.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "io/mesh_reading.h"

namespace htvm {

// Bytes of a file, without reading all of it: false if they are not there.
struct ByteSource {
    std::uint64_t size = 0;
    std::function<bool(std::uint64_t offset, std::span<std::uint8_t> out)> read;
};
ByteSource byte_source(std::span<const std::uint8_t> bytes);  // lent
Result<ByteSource> byte_source(const std::filesystem::path& path);

struct VologramArray {
    std::uint64_t offset = 0, bytes = 0;
};

struct VologramFrame {
    std::size_t source = 0;  // in which of the sources
    VologramArray vertices, normals, triangles, texcoords;
    std::size_t key_frame = 0;  // the frame whose triangles and texture coordinates it has
};

struct Vologram {
    std::uint32_t version = 0;  // 10 to 13
    bool has_normals = false;
    bool has_pictures = false;        // inside of it
    double frames_per_second = 0;     // 0: it does not say
    std::vector<ByteSource> sources;  // with the frames, in order
    std::vector<VologramFrame> frames;
};

// header: a file with its frames in it, or without any: then they are in `sequences`. Errors: bad_input, unsupported.
Result<Vologram> open_vologram(ByteSource header, std::vector<ByteSource> sequences = {});

// The mesh of a frame. Errors: bad_input, limit.
Result<Mesh> read_vologram_frame(const Vologram& vologram, std::size_t frame, const MeshReadOptions& options = {},
                                 MeshFindings* findings = nullptr);

}  // namespace htvm
