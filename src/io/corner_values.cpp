#include "io/corner_values.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "io/mesh_check.h"

namespace htvm {

namespace {

// Twice the area; 0 if that is not finite.
double area_of(const Mesh& mesh, const Triangle& triangle) {
    const auto& p = mesh.positions;
    std::array<double, 3> a{}, b{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto origin = static_cast<double>(p[triangle[0]][axis]);
        a[axis] = static_cast<double>(p[triangle[1]][axis]) - origin;
        b[axis] = static_cast<double>(p[triangle[2]][axis]) - origin;
    }
    const double area = std::hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]);
    return std::isfinite(area) ? area : 0;
}

}  // namespace

void give_colours_of_corners(Mesh& mesh, std::span<const std::array<Colour, 3>> colours) {
    struct Sum {
        std::array<double, 3> colour{};
        double weight = 0;
    };
    std::vector<Sum> sums(mesh.positions.size());
    for (std::size_t t = 0; t < colours.size(); ++t) {
        const double weight = std::max(area_of(mesh, mesh.triangles[t]), 1e-30);  // so small: where there is no other
        for (std::size_t c = 0; c < 3; ++c) {
            auto& sum = sums[mesh.triangles[t][c]];
            sum.weight += weight;
            for (std::size_t i = 0; i < 3; ++i) sum.colour[i] += weight * colours[t][c][i];
        }
    }
    mesh.colours.assign(sums.size(), {255, 255, 255});
    for (std::size_t v = 0; v < sums.size(); ++v) {
        if (sums[v].weight <= 0) continue;
        for (std::size_t i = 0; i < 3; ++i) {
            const auto level = std::lround(sums[v].colour[i] / sums[v].weight);
            mesh.colours[v][i] = static_cast<std::uint8_t>(std::clamp(level, 0L, 255L));
        }
    }
}

Result<void> give_texcoords_of_corners(Mesh& mesh, std::span<const std::array<Vector2f, 3>> texcoords,
                                       std::uint64_t most_vertices) {
    struct Key {
        std::uint32_t vertex;
        Vector2f texcoord;
        bool operator==(const Key&) const = default;
    };
    struct Hash {
        std::size_t operator()(const Key& key) const {
            std::uint64_t h = key.vertex * 0x9e3779b97f4a7c15u;
            for (const float c : key.texcoord)
                h = (h ^ (h >> 29) ^ std::bit_cast<std::uint32_t>(c + 0.0f)) * 0xbf58476d1ce4e5b9u;
            return static_cast<std::size_t>(h ^ (h >> 32));
        }
    };
    const std::size_t before = mesh.positions.size();
    const auto most = std::min<std::uint64_t>(most_vertices, std::numeric_limits<std::uint32_t>::max());
    std::vector<bool> has_own(before);
    std::unordered_map<Key, std::uint32_t, Hash> appended;
    mesh.texcoords.assign(before, {});
    for (std::size_t t = 0; t < texcoords.size(); ++t) {
        for (std::size_t c = 0; c < 3; ++c) {
            auto& vertex = mesh.triangles[t][c];
            const auto& texcoord = texcoords[t][c];
            if (!has_own[vertex]) mesh.texcoords[vertex] = texcoord;
            has_own[vertex] = true;
            if (mesh.texcoords[vertex] == texcoord) continue;
            const auto next = static_cast<std::uint32_t>(mesh.positions.size());
            const auto [at, is_new] = appended.emplace(Key{vertex, texcoord}, next);
            if (is_new) {
                if (auto ok = check_count(std::uint64_t{next} + 1, most, "vertices or more"); !ok) return ok;
                mesh.positions.push_back(mesh.positions[vertex]);
                mesh.texcoords.push_back(texcoord);
                if (!mesh.normals.empty()) mesh.normals.push_back(mesh.normals[vertex]);
                if (!mesh.colours.empty()) mesh.colours.push_back(mesh.colours[vertex]);
            }
            vertex = at->second;
        }
    }
    return {};
}

}  // namespace htvm
