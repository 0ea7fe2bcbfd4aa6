#include <nlohmann/json.hpp>

#include "io/gltf.h"
#include "io/gltf_buffer.h"

namespace htvm {

using namespace internal;

Result<std::vector<std::uint8_t>> write_gltf(const Mesh& mesh, std::span<const std::uint8_t> image,
                                             const std::array<double, 3>& origin) {
    if (auto ok = check_mesh(mesh); !ok) return tl::unexpected(ok.error());
    GltfBuffer buffer;
    nlohmann::json root = {{"asset", {{"version", "2.0"}, {"generator", "htvm"}}}, {"scene", 0}};
    nlohmann::json scene = nlohmann::json::object();  // an empty list of nodes is not allowed
    if (!mesh.positions.empty()) {
        GltfTopology topology;
        std::optional<std::size_t> texture;
        if (!image.empty() && !mesh.texcoords.empty()) texture = add_image(buffer, image);
        const auto number = add_mesh(buffer, mesh, topology, texture);
        nlohmann::json node = {{"mesh", number}};
        if (origin != std::array<double, 3>{}) node["translation"] = origin;
        root["nodes"].push_back(std::move(node));
        scene["nodes"].push_back(0);
    }
    root["scenes"].push_back(std::move(scene));
    auto out = glb_front(std::move(root), buffer);
    if (out.size() + buffer.size() > most_glb_bytes)
        return fail(ErrorKind::limit, "the mesh needs more than the 4 GiB that a .glb can hold");
    out.insert(out.end(), buffer.bytes.begin(), buffer.bytes.end());
    return out;
}

}  // namespace htvm
