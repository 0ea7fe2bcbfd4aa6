#include "surface/hole_filling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/geometry.h"
#include "core/lattice.h"
#include "surface/open_border.h"
#include "surface/surface_index.h"

namespace htvm::internal {
namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

// The sides of a border, each in the direction of its triangle, by the vertex that they leave; `none` where several do.
struct BorderSides {
    std::vector<std::uint32_t> to;        // the vertex that the side leads to, or none
    std::vector<std::uint32_t> triangle;  // that it belongs to
};

BorderSides border_sides(const LatticeMesh& mesh) {
    const std::size_t vertices = mesh.positions.size();
    const auto from_border = edges_from_border(points_of(mesh.positions), mesh.triangles);
    // Sides between two vertices of the border, sorted so that those that run against each other are found.
    struct Side {
        std::uint32_t low, high, triangle;
        bool ascends;
        auto key() const { return std::pair(low, high); }
    };
    std::vector<Side> sides;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::size_t i = 0; i < 3; ++i) {
            const auto a = mesh.triangles[t][i], b = mesh.triangles[t][(i + 1) % 3];
            if (from_border[a] == 0 && from_border[b] == 0) sides.push_back({std::min(a, b), std::max(a, b), t, a < b});
        }
    std::ranges::sort(sides, {}, &Side::key);
    BorderSides out{std::vector<std::uint32_t>(vertices, none), std::vector<std::uint32_t>(vertices, none)};
    std::vector<std::uint8_t> leaving(vertices, 0);
    for (std::size_t i = 0; i < sides.size();) {
        std::size_t end = i;
        while (end < sides.size() && sides[end].key() == sides[i].key()) ++end;
        if (end - i == 1) {
            const auto from = sides[i].ascends ? sides[i].low : sides[i].high;
            out.to[from] = sides[i].ascends ? sides[i].high : sides[i].low;
            out.triangle[from] = sides[i].triangle;
            if (leaving[from] < 2) ++leaving[from];
        }
        i = end;
    }
    for (std::size_t v = 0; v < vertices; ++v)
        if (leaving[v] > 1) out.to[v] = none;
    return out;
}

// Around a hole the sides run so that, seen from the front, they go round it against the clock's other hand: what they
// enclose faces away from the triangles beside them.
bool is_flat_hole(const LatticeMesh& mesh, const BorderSides& sides, std::span<const std::uint32_t> rim,
                  const Vector3d& middle, const HoleFillingOptions& options) {
    Vector3d enclosed{}, facing{};
    double around = 0;
    for (const auto v : rim) {
        const auto from = to_vector(mesh.positions[v]) - middle, to = to_vector(mesh.positions[sides.to[v]]) - middle;
        enclosed = enclosed + cross(from, to);
        facing = facing + normalised(area_vector(std::span<const LatticePoint>(mesh.positions),
                                                 mesh.triangles[sides.triangle[v]]));
        around += length(to - from);
    }
    if (around > options.longest.value || !(dot(enclosed, facing) < 0)) return false;
    const auto across = normalised(enclosed);
    return std::ranges::all_of(rim, [&](std::uint32_t v) {
        return std::abs(dot(to_vector(mesh.positions[v]) - middle, across)) <= options.flat * around;
    });
}

void close(LatticeMesh& mesh, const BorderSides& sides, std::span<const std::uint32_t> rim, const Vector3d& middle) {
    const auto centre = static_cast<std::uint32_t>(mesh.positions.size());
    const auto whole = [](double c) { return within_lattice(std::llround(c)); };
    mesh.positions.push_back({whole(middle[0]), whole(middle[1]), whole(middle[2])});
    if (!mesh.colours.empty()) {
        std::array<std::size_t, 3> sum{};
        for (const auto v : rim)
            for (std::size_t c = 0; c < 3; ++c) sum[c] += mesh.colours[v][c];
        Colour mean{};
        for (std::size_t c = 0; c < 3; ++c) mean[c] = static_cast<std::uint8_t>(sum[c] / rim.size());
        mesh.colours.push_back(mean);
    }
    for (const auto v : rim) mesh.triangles.push_back({sides.to[v], v, centre});
}

}  // namespace

std::size_t fill_small_holes(LatticeMesh& mesh, const HoleFillingOptions& options) {
    const auto sides = border_sides(mesh);
    const auto vertices = static_cast<std::uint32_t>(mesh.positions.size());
    std::vector<bool> seen(vertices, false);
    std::vector<std::uint32_t> rim;
    std::size_t filled = 0;
    for (std::uint32_t start = 0; start < vertices; ++start) {
        if (sides.to[start] == none || seen[start]) continue;
        rim.clear();
        std::uint32_t v = start;
        for (; v != none && !seen[v]; v = sides.to[v]) {
            seen[v] = true;
            rim.push_back(v);
        }
        if (v != start || rim.size() < 3 || rim.size() > options.most_sides) continue;
        Vector3d middle{};
        for (const auto r : rim)
            middle = middle + to_vector(mesh.positions[r]) * (1.0 / static_cast<double>(rim.size()));
        if (!is_flat_hole(mesh, sides, rim, middle, options)) continue;
        close(mesh, sides, rim, middle);
        ++filled;
    }
    return filled;
}

}  // namespace htvm::internal
