#include "io/mesh_finite.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

namespace htvm {
namespace {

bool is_finite(const Vector3f& p) { return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]); }

template <class T>
void keep_only(std::vector<T>& of_vertices, const std::vector<bool>& is_kept) {
    if (of_vertices.empty()) return;
    std::size_t next = 0;
    for (std::size_t v = 0; v < is_kept.size(); ++v)
        if (is_kept[v]) of_vertices[next++] = of_vertices[v];
    of_vertices.resize(next);
}

// Gives the number of triangles that were left out.
std::size_t keep_triangles(Mesh& mesh, std::vector<std::uint16_t>& part_of_triangle, const std::vector<bool>& is_kept) {
    const auto count = mesh.triangles.size();
    std::size_t next = 0;
    for (std::size_t t = 0; t < count; ++t) {
        const auto& [a, b, c] = mesh.triangles[t];
        if (!is_kept[a] || !is_kept[b] || !is_kept[c]) continue;
        if (!part_of_triangle.empty()) part_of_triangle[next] = part_of_triangle[t];
        mesh.triangles[next++] = mesh.triangles[t];
    }
    mesh.triangles.resize(next);
    if (!part_of_triangle.empty()) part_of_triangle.resize(next);
    return count - next;
}

}  // namespace

Result<void> leave_out_not_finite(Mesh& mesh, std::vector<std::uint16_t>& part_of_triangle, MeshFindings* findings) {
    const auto first = std::find_if_not(mesh.positions.begin(), mesh.positions.end(), is_finite);
    if (first == mesh.positions.end()) return {};
    constexpr std::size_t one_of = 10;  // triangles: more than this share is damage
    const auto first_place = first - mesh.positions.begin();
    std::vector<bool> is_kept(mesh.positions.size());
    std::vector<std::uint32_t> place(mesh.positions.size());
    std::uint32_t kept = 0;
    for (std::size_t v = 0; v < is_kept.size(); ++v) {
        is_kept[v] = is_finite(mesh.positions[v]);
        place[v] = kept;
        if (is_kept[v]) ++kept;
    }
    const auto vertices_left_out = mesh.positions.size() - kept;
    const auto triangles = mesh.triangles.size();
    const auto triangles_left_out = keep_triangles(mesh, part_of_triangle, is_kept);
    if (triangles_left_out * one_of > triangles || kept == 0)
        return fail(ErrorKind::bad_input, "the position of vertex " + std::to_string(first_place) + " is not finite");
    for (auto& triangle : mesh.triangles)
        for (auto& index : triangle) index = place[index];
    keep_only(mesh.colours, is_kept);
    keep_only(mesh.normals, is_kept);
    keep_only(mesh.texcoords, is_kept);
    keep_only(mesh.positions, is_kept);
    auto text = std::to_string(vertices_left_out) + " of its vertices have positions that are no numbers";
    text += triangles_left_out > 0 ? ", and are left out with " + std::to_string(triangles_left_out) + " triangles"
                                   : ", and are left out";
    remark(findings, "not-finite", std::move(text), triangles_left_out > 0);
    return {};
}

}  // namespace htvm
