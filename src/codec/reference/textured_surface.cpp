#include "codec/reference/textured_surface.h"

#include <limits>
#include <utility>

namespace htvm::internal {

Result<TexturedSurface> textured_surface(std::size_t vertices, std::span<const Triangle> triangles,
                                         std::vector<CornerTexcoords> corners) {
    TexturedSurface out;
    out.corners = std::move(corners);
    out.texcoords.resize(vertices);
    std::vector<std::uint8_t> pairs(vertices, 0);
    bool too_many = false;
    constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
    // The copies of each vertex, the newest first, as a list through the vertices as shown.
    std::vector<std::uint32_t> next(vertices, none);
    const auto with = [&](std::uint32_t v, const QuantisedTexcoord& at) {
        if (pairs[v] == 0) {
            pairs[v] = 1;
            out.texcoords[v] = at;
            return v;
        }
        if (out.texcoords[v] == at) return v;
        for (auto copy = next[v]; copy != none; copy = next[copy])
            if (out.texcoords[copy] == at) return copy;
        if (pairs[v] == most_texcoords_of_vertex) {
            too_many = true;
            return v;
        }
        ++pairs[v];
        const auto copy = static_cast<std::uint32_t>(out.texcoords.size());
        out.copied.push_back(v);
        out.texcoords.push_back(at);
        next.push_back(next[v]);
        next[v] = copy;
        return copy;
    };
    out.triangles.reserve(triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        const auto& [a, b, c] = triangles[t];
        const auto first = with(a, out.corners[t][0]);
        const auto second = with(b, out.corners[t][1]);
        out.triangles.push_back({first, second, with(c, out.corners[t][2])});
    }
    if (too_many) return fail(ErrorKind::corrupt_stream, "charts: a vertex lies in too many of them");
    return out;
}

std::vector<CornerTexcoords> corners_that_stay(std::span<const CornerTexcoords> before,
                                               std::span<const Triangle> triangles_before, std::size_t vertices_before,
                                               std::span<const std::uint32_t> stays) {
    std::vector<bool> is_there(vertices_before, false);
    for (const auto v : stays) is_there[v] = true;
    std::vector<CornerTexcoords> out;
    for (std::size_t t = 0; t < triangles_before.size(); ++t) {
        const auto& [a, b, c] = triangles_before[t];
        if (is_there[a] && is_there[b] && is_there[c]) out.push_back(before[t]);
    }
    return out;
}

LatticeMesh shown_mesh(const LatticeMesh& mesh, const TexturedSurface& textured) {
    if (textured.empty()) return mesh;
    LatticeMesh out = mesh;
    out.triangles = textured.triangles;
    out.texcoords = textured.texcoords;
    for (const auto v : textured.copied) {
        out.positions.push_back(mesh.positions[v]);
        if (!mesh.colours.empty()) out.colours.push_back(mesh.colours[v]);
        if (!mesh.normals.empty()) out.normals.push_back(mesh.normals[v]);
    }
    return out;
}

}  // namespace htvm::internal
