#include "io/texture_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "core/geometry.h"

namespace htvm {

namespace {

constexpr Colour white{255, 255, 255}, grey_of_exporters{204, 204, 204};

Colour colour_of(const TextureReference::Part& part) { return part.colour.value_or(white); }

}  // namespace

std::size_t part_of_triangle(const TextureReference& texture, std::size_t triangle) {
    if (triangle >= texture.part_of_triangle.size()) return 0;
    const std::size_t part = texture.part_of_triangle[triangle];
    return part < texture.parts.size() ? part : 0;
}

std::vector<bool> worn_parts(const Mesh& mesh, const TextureReference& texture) {
    std::vector<bool> out(texture.parts.size());
    if (out.empty()) return out;
    if (texture.part_of_triangle.empty()) out[0] = !mesh.triangles.empty();
    for (std::size_t t = 0; t < mesh.triangles.size() && !texture.part_of_triangle.empty(); ++t)
        out[part_of_triangle(texture, t)] = true;
    return out;
}

std::vector<Colour> colours_of_parts(const Mesh& mesh, const TextureReference& texture) {
    const auto worn = worn_parts(mesh, texture);
    std::vector<Colour> different;
    bool any = false;
    for (std::size_t p = 0; p < worn.size(); ++p) {
        const auto& part = texture.parts[p];
        if (!worn[p]) continue;
        if (part.image) return {};
        any = any || part.colour;
        if (std::ranges::find(different, colour_of(part)) == different.end()) different.push_back(colour_of(part));
    }
    const bool says_nothing = different.size() == 1 && (different[0] == white || different[0] == grey_of_exporters);
    if (!any || says_nothing) return {};
    std::vector<std::array<double, 4>> sums(mesh.positions.size());  // of levels by area, and of area
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Colour colour = colour_of(texture.parts[part_of_triangle(texture, t)]);
        // Triangles without an area count a little, so that each vertex of one has a colour.
        constexpr double least = 1e-12;
        const double area =
            std::max(internal::length(internal::area_vector(std::span(mesh.positions), mesh.triangles[t])), least);
        for (const auto v : mesh.triangles[t]) {
            for (std::size_t c = 0; c < 3; ++c) sums[v][c] += area * colour[c];
            sums[v][3] += area;
        }
    }
    std::vector<Colour> out;
    out.reserve(sums.size());
    for (const auto& sum : sums) {
        Colour& mean = out.emplace_back(white);
        for (std::size_t c = 0; c < 3 && sum[3] > 0; ++c)
            mean[c] = static_cast<std::uint8_t>(std::clamp(std::lround(sum[c] / sum[3]), 0L, 255L));
    }
    return out;
}

bool is_one_colour(const std::vector<Colour>& colours) {
    return !colours.empty() && std::ranges::all_of(colours, [&](const Colour& c) { return c == colours.front(); });
}

}  // namespace htvm
