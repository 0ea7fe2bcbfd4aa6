#include "io/loose_vertices.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace htvm {
namespace {

template <class Value>
void keep(const std::vector<std::uint32_t>& kept, std::vector<Value>& values) {
    if (values.empty()) return;
    for (std::size_t v = 0; v < kept.size(); ++v) values[v] = values[kept[v]];
    values.resize(kept.size());
}

}  // namespace

std::vector<std::uint32_t> drop_loose_vertices(Mesh& mesh) {
    std::vector<std::uint8_t> is_named(mesh.positions.size());
    for (const auto& triangle : mesh.triangles)
        for (const auto v : triangle) is_named[v] = 1;
    std::vector<std::uint32_t> kept, place(mesh.positions.size());
    for (std::uint32_t v = 0; v < is_named.size(); ++v) {
        place[v] = static_cast<std::uint32_t>(kept.size());
        if (is_named[v] != 0) kept.push_back(v);
    }
    for (auto& triangle : mesh.triangles)
        for (auto& v : triangle) v = place[v];
    keep(kept, mesh.positions);
    keep(kept, mesh.colours);
    keep(kept, mesh.normals);
    keep(kept, mesh.texcoords);
    return kept;
}

}  // namespace htvm
