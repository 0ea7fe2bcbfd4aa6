#include <bit>
#include <string>

#include "core/bytes.h"
#include "io/ply.h"

namespace htvm {

using namespace internal;

namespace {

template <std::size_t N>
void put_floats(ByteWriter& out, const std::array<float, N>& values) {
    for (const float value : values) out.u32(std::bit_cast<std::uint32_t>(value));
}

std::string header_of(const Mesh& mesh, std::string_view timestamp, std::string_view texture, std::string_view fps,
                      bool is_shifted) {
    std::string text = "ply\nformat binary_little_endian 1.0\n";
    if (!timestamp.empty()) text.append("comment timestamp ").append(timestamp).append("\n");
    if (!fps.empty()) text.append("comment fps ").append(fps).append("\n");
    if (!texture.empty()) text.append("comment TextureFile ").append(texture).append("\n");
    text += "element vertex " + std::to_string(mesh.positions.size());
    text += is_shifted ? "\nproperty double x\nproperty double y\nproperty double z\n"
                       : "\nproperty float x\nproperty float y\nproperty float z\n";
    if (!mesh.normals.empty()) text += "property float nx\nproperty float ny\nproperty float nz\n";
    if (!mesh.texcoords.empty()) text += "property float s\nproperty float t\n";
    if (!mesh.colours.empty()) text += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    text += "element face " + std::to_string(mesh.triangles.size());
    return text + "\nproperty list uchar uint vertex_indices\nend_header\n";
}

}  // namespace

Result<std::vector<std::uint8_t>> write_ply(const Mesh& mesh, std::string_view timestamp, std::string_view texture,
                                            std::string_view fps, const std::array<double, 3>& origin) {
    if (auto ok = check_mesh(mesh); !ok) return tl::unexpected(ok.error());
    const bool is_shifted = origin != std::array<double, 3>{};
    ByteWriter out;
    for (const char c : header_of(mesh, timestamp, texture, fps, is_shifted)) out.u8(static_cast<std::uint8_t>(c));
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        for (std::size_t c = 0; is_shifted && c < 3; ++c)
            out.u64(std::bit_cast<std::uint64_t>(static_cast<double>(mesh.positions[v][c]) + origin[c]));
        if (!is_shifted) put_floats(out, mesh.positions[v]);
        if (!mesh.normals.empty()) put_floats(out, mesh.normals[v]);
        if (!mesh.texcoords.empty()) put_floats(out, mesh.texcoords[v]);
        if (!mesh.colours.empty()) out.bytes(mesh.colours[v]);
    }
    for (const Triangle& triangle : mesh.triangles) {
        out.u8(3);
        for (const std::uint32_t index : triangle) out.u32(index);
    }
    return out.take();
}

}  // namespace htvm
