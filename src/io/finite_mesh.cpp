#include "io/finite_mesh.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace htvm {

namespace {

bool is_finite(const Vector3f& position) {
    return std::isfinite(position[0]) && std::isfinite(position[1]) && std::isfinite(position[2]);
}

// Keeps the elements of which `is_kept` says so; empty attributes stay empty.
template <class Element>
void keep(std::vector<Element>& elements, const std::vector<bool>& is_kept) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < elements.size(); ++i) {
        if (is_kept[i]) elements[kept++] = elements[i];
    }
    elements.resize(kept);
}

std::string counted(std::size_t count, const char* one, const char* many) {
    return count == 1 ? "1 " + std::string(one) : std::to_string(count) + " " + many;
}

tl::unexpected<Error> bad_position(std::size_t vertex, std::size_t count) {
    const std::string others = count > 1 ? ", nor are those of " + std::to_string(count - 1) + " more" : std::string();
    return fail(ErrorKind::bad_input, "the position of vertex " + std::to_string(vertex) + " is not finite" + others +
                                          ": too much of the surface to leave out");
}

void leave_out_triangles(Mesh& mesh, const std::vector<bool>& is_kept, MeshFindings& findings) {
    std::vector<bool> is_whole(mesh.triangles.size());
    std::size_t left_out = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto& triangle = mesh.triangles[t];
        is_whole[t] = is_kept[triangle[0]] && is_kept[triangle[1]] && is_kept[triangle[2]];
        left_out += !is_whole[t];
    }
    keep(mesh.triangles, is_whole);
    keep(findings.texture.part_of_triangle, is_whole);
    remark(&findings, "not-finite-triangles",
           counted(left_out, "triangle is", "triangles are") +
               " left out, as positions of their vertices are not finite numbers",
           true);
}

}  // namespace

Result<void> leave_out_not_finite(Mesh& mesh, MeshFindings& findings) {
    const std::size_t vertices = mesh.positions.size();
    if (std::all_of(mesh.positions.begin(), mesh.positions.end(), is_finite)) return {};
    std::vector<bool> is_kept(vertices), is_used(vertices);
    for (std::size_t v = 0; v < vertices; ++v) is_kept[v] = is_finite(mesh.positions[v]);
    for (const auto& triangle : mesh.triangles) {
        for (const auto vertex : triangle) is_used[vertex] = true;
    }
    std::size_t used = 0, used_badly = 0, bad = 0, first_bad = 0;
    for (std::size_t v = vertices; v-- > 0;) {
        used += is_used[v];
        if (is_kept[v]) continue;
        ++bad;
        used_badly += is_used[v];
        if (is_used[v] || used_badly == 0) first_bad = v;
    }
    constexpr std::size_t one_of = 10;
    if (used_badly * one_of > used) return bad_position(first_bad, used_badly);
    if (bad == vertices) return bad_position(first_bad, bad);
    if (bad > used_badly) {
        remark(&findings, "not-finite",
               counted(bad - used_badly, "vertex that no triangle uses is", "vertices that no triangle uses are") +
                   " left out, as their positions are not finite numbers");
    }
    if (used_badly > 0) leave_out_triangles(mesh, is_kept, findings);
    std::vector<std::uint32_t> new_index(vertices);
    std::uint32_t kept = 0;
    for (std::size_t v = 0; v < vertices; ++v) {
        new_index[v] = kept;
        kept += is_kept[v];
    }
    for (auto& triangle : mesh.triangles) {
        for (auto& vertex : triangle) vertex = new_index[vertex];
    }
    keep(mesh.positions, is_kept);
    keep(mesh.normals, is_kept);
    keep(mesh.texcoords, is_kept);
    keep(mesh.colours, is_kept);
    return {};
}

}  // namespace htvm
