#include "codec/reference/textured_surface.h"

#include <limits>
#include <utility>

namespace htvm::internal {

namespace {

QuantisedTexcoord middle_of(const QuantisedTexcoord& a, const QuantisedTexcoord& b) {
    return {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2};
}

// The coordinates of a level's triangles, which lie on those that they were cut from. before, triangles: of these.
std::vector<CornerTexcoords> corners_of_level(const SubdivisionLevel& level, std::span<const Triangle> triangles,
                                              std::span<const CornerTexcoords> before) {
    std::vector<CornerTexcoords> out(level.triangles.size());
    for (std::size_t t = 0; t < out.size(); ++t) {
        const auto& whole = triangles[level.parent[t]];
        const auto& of_whole = before[level.parent[t]];
        const auto at = [&](std::uint32_t vertex) {
            return of_whole[vertex == whole[0] ? 0 : vertex == whole[1] ? 1 : 2];
        };
        // One that is degenerate stays as it is, with coordinates for each time that it names a vertex.
        if (level.triangles[t] == whole) {
            out[t] = of_whole;
            continue;
        }
        for (std::size_t i = 0; i < 3; ++i) {
            const auto v = level.triangles[t][i];
            if (v < level.first) {
                out[t][i] = at(v);
                continue;
            }
            const auto& edge = level.stencils[v - level.first];
            out[t][i] = middle_of(at(edge.a), at(edge.b));
        }
    }
    return out;
}

// What is shown of these triangles, whose corners lie there in the picture.
Result<TexturedSurface> with_copies(std::size_t vertices, std::span<const Triangle> triangles,
                                    std::span<const CornerTexcoords> corners) {
    TexturedSurface out;
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
        const auto first = with(a, corners[t][0]);
        const auto second = with(b, corners[t][1]);
        out.triangles.push_back({first, second, with(c, corners[t][2])});
    }
    if (too_many) return fail(ErrorKind::corrupt_stream, "charts: a vertex lies in too many of them");
    return out;
}

}  // namespace

Result<TexturedSurface> textured_surface(std::size_t vertices, std::span<const Triangle> triangles,
                                         std::vector<CornerTexcoords> corners) {
    return textured_surface(vertices, triangles, std::move(corners), {}, 0);
}

Result<TexturedSurface> textured_surface(std::size_t vertices, std::span<const Triangle> triangles,
                                         std::vector<CornerTexcoords> corners, const SurfaceDetail& detail,
                                         std::size_t shown) {
    std::vector<CornerTexcoords> fine;
    for (std::size_t k = 0; k < shown; ++k) {
        const auto& level = detail.levels[k];
        fine = corners_of_level(level, k == 0 ? triangles : detail.triangles(k), k == 0 ? corners : fine);
        vertices += level.stencils.size();
    }
    auto out =
        shown == 0 ? with_copies(vertices, triangles, corners) : with_copies(vertices, detail.triangles(shown), fine);
    if (out) out->corners = std::move(corners);
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

LatticeMesh shown_mesh(LatticeMesh mesh, const TexturedSurface& textured) {
    if (textured.empty()) return mesh;
    mesh.triangles = textured.triangles;
    mesh.texcoords = textured.texcoords;
    const auto repeat = [&](auto& values) {
        if (values.empty()) return;
        values.reserve(values.size() + textured.copied.size());
        for (const auto v : textured.copied) values.push_back(values[v]);
    };
    repeat(mesh.positions);
    repeat(mesh.colours);
    repeat(mesh.normals);
    return mesh;
}

}  // namespace htvm::internal
