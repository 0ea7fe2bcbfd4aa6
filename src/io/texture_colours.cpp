#include "io/texture_colours.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/equal_floats.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "core/srgb.h"

namespace htvm {

using namespace internal;

namespace {

// What a vertex's colour is the mean of.
struct ColourSum {
    std::array<double, 3> colour{};
    double area = 0;
};

// The sums that a triangle adds to its corners.
using CornerSums = std::array<ColourSum, 3>;

// Points spread evenly over the triangle, `spacing` texels apart or a little less, each with its share of the area and
// the level of the image that is as fine as the points are.
CornerSums sums_of(const Mesh& mesh, const Triangle& t, const ImagePyramid& texture, double spacing) {
    constexpr int most_steps = 32;  // along a side: more texels than that are averaged beforehand
    const Vector2f &a = mesh.texcoords[t[0]], &b = mesh.texcoords[t[1]], &c = mesh.texcoords[t[2]];
    const auto texels = [&](const Vector2f& p, const Vector2f& q) {
        return std::hypot(static_cast<double>(p[0] - q[0]) * texture.image().width,
                          static_cast<double>(p[1] - q[1]) * texture.image().height);
    };
    const double longest = std::max({texels(a, b), texels(b, c), texels(c, a)});
    const int steps = static_cast<int>(std::clamp(std::ceil(longest / spacing), 1.0, static_cast<double>(most_steps)));
    const std::size_t level = texture.level_for(longest / steps);
    // Triangles without an area count a little, so that each vertex of one has a colour.
    const double area = std::max(length(area_vector(std::span(mesh.positions), t)), 1e-12) / (steps * steps);
    CornerSums out;
    const auto add = [&](double x, double y) {  // shares of the second and the third corner
        const std::array<double, 3> shares{1 - x - y, x, y};
        const auto place = [&](std::size_t i) {
            return static_cast<float>(shares[0] * static_cast<double>(a[i]) + shares[1] * static_cast<double>(b[i]) +
                                      shares[2] * static_cast<double>(c[i]));
        };
        const auto colour = texture.at(place(0), place(1), level);
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const double weight = area * shares[corner];
            out[corner].area += weight;
            for (std::size_t i = 0; i < 3; ++i) out[corner].colour[i] += weight * static_cast<double>(colour[i]);
        }
    };
    // The middles of the small triangles that a grid of lines makes of it: upright ones, and those between them.
    for (int i = 0; i < steps; ++i)
        for (int j = 0; i + j < steps; ++j) {
            add((i + 1.0 / 3) / steps, (j + 1.0 / 3) / steps);
            if (i + j + 1 < steps) add((i + 2.0 / 3) / steps, (j + 2.0 / 3) / steps);
        }
    return out;
}

std::vector<ColourSum> sums_of_vertices(const Mesh& mesh, const Image& image, Threads threads, double spacing) {
    const ImagePyramid texture(image);
    std::vector<CornerSums> of_triangles(mesh.triangles.size());
    parallel_for(mesh.triangles.size(), threads, 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t) of_triangles[t] = sums_of(mesh, mesh.triangles[t], texture, spacing);
    });
    // In the order of the triangles, so that the result does not depend on the number of threads.
    std::vector<ColourSum> out(mesh.positions.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::size_t corner = 0; corner < 3; ++corner) {
            ColourSum& sum = out[mesh.triangles[t][corner]];
            const ColourSum& more = of_triangles[t][corner];
            sum.area += more.area;
            for (std::size_t i = 0; i < 3; ++i) sum.colour[i] += more.colour[i];
        }
    for (std::size_t v = 0; v < out.size(); ++v) {
        if (out[v].area > 0) continue;
        const auto colour = texture.at(mesh.texcoords[v][0], mesh.texcoords[v][1]);
        out[v].area = 1e-12;
        for (std::size_t i = 0; i < 3; ++i) out[v].colour[i] = 1e-12 * static_cast<double>(colour[i]);
    }
    return out;
}

Colour mean_of(const ColourSum& sum) {
    Colour out{};
    for (std::size_t i = 0; i < 3; ++i)
        out[i] = static_cast<std::uint8_t>(std::clamp(std::lround(sum.colour[i] / sum.area), 0L, 255L));
    return out;
}

// The same with its mean multiplied by that colour, in light.
ColourSum multiplied(ColourSum sum, const Colour& by) {
    const Colour mean = mean_of(sum);
    for (std::size_t i = 0; i < 3; ++i) sum.colour[i] = sum.area * level_of(light_of(mean[i]) * light_of(by[i]));
    return sum;
}

// The sums of all vertices, multiplied by the colours that these have.
std::vector<ColourSum> sums_with_own_colours(const TexturedMesh& captured, Threads threads, double spacing) {
    auto out = sums_of_vertices(captured.mesh, *captured.texture, threads, spacing);
    const auto& colours = captured.mesh.colours;
    for (std::size_t v = 0; v < colours.size(); ++v) out[v] = multiplied(out[v], colours[v]);
    return out;
}

}  // namespace

std::vector<Colour> colours_from_texture(const Mesh& mesh, const Image& image, Threads threads) {
    std::vector<Colour> out;
    out.reserve(mesh.positions.size());
    for (const auto& sum : sums_of_vertices(mesh, image, threads, 1)) out.push_back(mean_of(sum));
    return out;
}

std::vector<Colour> colours_with_texture(const TexturedMesh& captured, Threads threads, double spacing) {
    std::vector<Colour> out;
    out.reserve(captured.mesh.positions.size());
    for (const auto& sum : sums_with_own_colours(captured, threads, spacing)) out.push_back(mean_of(sum));
    return out;
}

Mesh with_vertex_colours(const TexturedMesh& captured, Threads threads, double spacing) {
    const Mesh& mesh = captured.mesh;
    const auto sums = sums_with_own_colours(captured, threads, spacing);
    Mesh out;
    std::vector<ColourSum> merged;
    std::vector<std::uint32_t> new_of(mesh.positions.size());
    FloatsTable<6> known;  // by where a vertex is and how it is turned: those that agree in both are one
    known.reserve(mesh.positions.size());
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        const auto& p = mesh.positions[v];
        const auto n = mesh.normals.empty() ? Vector3f{} : mesh.normals[v];
        const auto [at, is_new] =
            known.emplace(std::array{p[0], p[1], p[2], n[0], n[1], n[2]}, static_cast<std::uint32_t>(merged.size()));
        new_of[v] = at->second;
        if (is_new) {
            out.positions.push_back(p);
            if (!mesh.normals.empty()) out.normals.push_back(n);
            merged.emplace_back();
        }
        ColourSum& sum = merged[at->second];
        sum.area += sums[v].area;
        for (std::size_t i = 0; i < 3; ++i) sum.colour[i] += sums[v].colour[i];
    }
    for (const auto& sum : merged) out.colours.push_back(mean_of(sum));
    for (const Triangle& t : mesh.triangles) {
        const Triangle moved{new_of[t[0]], new_of[t[1]], new_of[t[2]]};
        const auto collapses = [](const Triangle& triangle) {
            return triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0];
        };
        // Those that were degenerate before stay, as in any capture.
        if (!collapses(moved) || collapses(t)) out.triangles.push_back(moved);
    }
    return out;
}

}  // namespace htvm
