#include "metrics/mesh_measures.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/equal_floats.h"

namespace htvm {

Result<void> check_measurable(const Mesh& mesh, const std::string& name) {
    constexpr std::size_t most = std::size_t{1} << 31;
    const std::size_t vertices = mesh.positions.size();
    if (vertices > most || mesh.triangles.size() > most)
        return fail(ErrorKind::limit, "The " + name + " has more than 2^31 vertices or triangles.");
    auto fits = [&](std::size_t count) { return count == 0 || count == vertices; };
    if (!fits(mesh.colours.size()) || !fits(mesh.normals.size()) || !fits(mesh.texcoords.size()))
        return fail(ErrorKind::bad_input,
                    "The " + name + " has an attribute array that is not as long as its vertices.");
    for (std::size_t v = 0; v < vertices; ++v)
        for (float c : mesh.positions[v])
            if (!(std::abs(c) <= largest_coordinate))  // true for NaN as well
                return fail(ErrorKind::bad_input, "Vertex " + std::to_string(v) + " of the " + name +
                                                      " has a coordinate that is not a number within 1e9 mm.");
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::uint32_t v : mesh.triangles[t])
            if (v >= vertices)
                return fail(ErrorKind::bad_input, "Triangle " + std::to_string(t) + " of the " + name +
                                                      " refers to vertex " + std::to_string(v) + " of " +
                                                      std::to_string(vertices) + ".");
    return {};
}

std::vector<bool> shown_vertices(const Mesh& mesh) {
    std::vector<bool> shown(mesh.positions.size(), mesh.triangles.empty());
    for (const auto& t : mesh.triangles)
        for (const std::uint32_t v : t) shown[v] = true;
    return shown;
}

std::optional<Mesh> without_hidden_vertices(const Mesh& mesh) {
    const auto shown = shown_vertices(mesh);
    if (std::ranges::all_of(shown, [](bool is) { return is; })) return std::nullopt;
    Mesh out;
    std::vector<std::uint32_t> number(shown.size());
    const auto keep = [](const auto& from, std::size_t v, auto& to) {
        if (!from.empty()) to.push_back(from[v]);
    };
    for (std::size_t v = 0; v < shown.size(); ++v) {
        if (!shown[v]) continue;
        number[v] = static_cast<std::uint32_t>(out.positions.size());
        keep(mesh.positions, v, out.positions);
        keep(mesh.colours, v, out.colours);
        keep(mesh.normals, v, out.normals);
        keep(mesh.texcoords, v, out.texcoords);
    }
    for (const auto& t : mesh.triangles) out.triangles.push_back({number[t[0]], number[t[1]], number[t[2]]});
    return out;
}

void extend(Box& box, const Box& other) {
    if (other.empty) return;
    if (box.empty) {
        box = other;
        return;
    }
    for (std::size_t i = 0; i < 3; ++i) {
        box.low[i] = std::min(box.low[i], other.low[i]);
        box.high[i] = std::max(box.high[i], other.high[i]);
    }
}

Box bounding_box(const Mesh& mesh) {
    Box box;
    const auto shown = shown_vertices(mesh);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v)
        if (shown[v]) extend(box, Box{to_point(mesh.positions[v]), to_point(mesh.positions[v]), false});
    return box;
}

double diagonal(const Box& box) { return length(box.high - box.low); }

double surface_area(std::span<const Vector3f> positions, std::span<const Triangle> triangles) {
    double area = 0;
    for (const auto& t : triangles) {
        const Point3 a = to_point(positions[t[0]]);
        area += length(cross(to_point(positions[t[1]]) - a, to_point(positions[t[2]]) - a)) / 2;
    }
    return area;
}

std::vector<std::uint32_t> first_coincident_vertex(const Mesh& mesh) {
    return internal::first_equal(std::span(mesh.positions));
}

std::vector<Vector3f> welded_normals(const Mesh& mesh) {
    const auto first = first_coincident_vertex(mesh);
    std::vector<Triangle> triangles;
    triangles.reserve(mesh.triangles.size());
    for (const auto& t : mesh.triangles) triangles.push_back({first[t[0]], first[t[1]], first[t[2]]});
    const auto by_place = internal::vertex_normals(mesh.positions, triangles);
    std::vector<Vector3f> normals;
    normals.reserve(first.size());
    for (const auto place : first) normals.push_back(internal::to_floats(by_place[place]));
    return normals;
}

}  // namespace htvm
