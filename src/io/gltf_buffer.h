// What both writers of glTF share: the numbers of meshes in a buffer, and the JSON that describes them.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <vector>

#include "htvm/mesh.hpp"

namespace htvm::internal {

// The lists of the JSON that grow with each mesh, and the bytes of the buffer that they refer to.
struct GltfBuffer {
    nlohmann::json views = nlohmann::json::array(), accessors = nlohmann::json::array(),
                   meshes = nlohmann::json::array(), images = nlohmann::json::array();
    std::vector<std::uint8_t> bytes;  // those not yet written elsewhere
    std::uint64_t written = 0;        // how many were before them
    std::uint64_t size() const { return written + bytes.size(); }
};

// Triangles and texture coordinates in the buffer, which the next mesh may have too.
struct GltfTopology {
    std::vector<Triangle> triangles;
    std::vector<Vector2f> texcoords;
    std::size_t triangle_accessor = 0, texcoord_accessor = 0;
    bool known = false;
};

// Whose a mesh's triangles are. Those of one frame alone take two bytes an index where they can.
enum class GltfTriangles { of_many_frames, of_one_frame };

// Adds the file of an image, PNG or JPEG, and gives its number.
std::size_t add_image(GltfBuffer& buffer, std::span<const std::uint8_t> file);

// Adds a mesh that has vertices, whose positions are in the file's unit, and gives its number in `meshes`. Without
// triangles it is drawn as points. Triangles and texture coordinates that equal those of `topology` are not repeated;
// afterwards it holds the mesh's. image: the number of its texture's, if it has one, in whose place it then has no
// colours.
std::size_t add_mesh(GltfBuffer& buffer, const Mesh& mesh, GltfTopology& topology,
                     std::optional<std::size_t> image = std::nullopt,
                     GltfTriangles triangles = GltfTriangles::of_many_frames);

// An accessor of single floats, or of rows of three, as samplers of animations need them; bounds are given in the JSON.
std::size_t add_numbers(GltfBuffer& buffer, std::span<const float> numbers);
std::size_t add_rows(GltfBuffer& buffer, std::span<const Vector3f> rows);

// At most this many bytes of JSON and buffer go into a .glb.
inline constexpr std::uint64_t most_glb_bytes = 0xFFFFFFFFu - 64;

// What comes before the buffer's bytes, which are a multiple of four: the header, the JSON made of `root` and the
// buffer's lists, and the header of the binary chunk.
std::vector<std::uint8_t> glb_front(nlohmann::json root, const GltfBuffer& buffer);

}  // namespace htvm::internal
