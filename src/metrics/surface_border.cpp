#include "metrics/surface_border.h"

#include <algorithm>
#include <array>
#include <tuple>

#include "metrics/mesh_measures.h"

namespace htvm {
namespace {

// A side of a triangle, its ends in order. `opposite` is the third corner, and one of the ends where the triangle has a
// corner twice: then it is no surface beside the edge.
struct Side {
    std::uint32_t low, high, opposite, triangle;
    std::uint8_t corner;  // where it begins in the triangle
    bool is_of_surface() const { return opposite != low && opposite != high; }
};

std::vector<Side> sorted_sides(const Mesh& mesh, const std::vector<std::uint32_t>& place) {
    std::vector<Side> sides;
    sides.reserve(mesh.triangles.size() * 3);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::uint8_t i = 0; i < 3; ++i) {
            const auto& v = mesh.triangles[t];
            const auto [low, high] = std::minmax({place[v[i]], place[v[(i + 1u) % 3]]});
            if (low != high) sides.push_back({low, high, place[v[(i + 2u) % 3]], t, i});
        }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
        return std::tie(a.low, a.high, a.opposite, a.triangle) < std::tie(b.low, b.high, b.opposite, b.triangle);
    });
    return sides;
}

}  // namespace

SurfaceBorder::SurfaceBorder(const Mesh& mesh) : of_triangles_(mesh.triangles.size()) {
    const auto place = first_coincident_vertex(mesh);
    const auto sides = sorted_sides(mesh, place);
    std::vector<bool> at_border(mesh.positions.size());
    for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
        std::size_t surfaces = 0;
        for (; end < sides.size() && sides[end].low == sides[begin].low && sides[end].high == sides[begin].high; ++end)
            surfaces += sides[end].is_of_surface() && (end == begin || sides[end].opposite != sides[end - 1].opposite);
        ++edges_;
        if (surfaces > 1) continue;
        ++border_edges_;
        at_border[sides[begin].low] = at_border[sides[begin].high] = true;
        for (std::size_t i = begin; i < end; ++i)
            of_triangles_[sides[i].triangle] |= static_cast<std::uint8_t>(1u << sides[i].corner);
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::size_t i = 0; i < 3; ++i)
            if (at_border[place[mesh.triangles[t][i]]]) of_triangles_[t] |= static_cast<std::uint8_t>(8u << i);
}

bool SurfaceBorder::has(std::uint32_t triangle, const Vector3d& shares) const {
    const std::uint8_t bits = of_triangles_[triangle];
    if (bits == 0) return false;
    const std::array<bool, 3> on = {shares[0] > 0, shares[1] > 0, shares[2] > 0};
    if (on[0] && on[1] && on[2]) return false;
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t next = (i + 1) % 3, last = (i + 2) % 3;
        if (on[i] && !on[next] && !on[last]) return (bits & (8u << i)) != 0;
        if (on[i] && on[next]) return (bits & (1u << i)) != 0;
    }
    return false;
}

bool is_open(const Mesh& mesh) {
    const SurfaceBorder border(mesh);
    return 100 * border.border_edges() > border.edges();
}

}  // namespace htvm
