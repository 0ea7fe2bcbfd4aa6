#include "metrics/mesh_measures.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace htvm {

double length(const Point3& a) { return std::sqrt(dot(a, a)); }

Point3 normalised(const Point3& a) {
    const double norm = length(a);
    return norm > 0 ? a * (1 / norm) : Point3{};
}

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
            if (!(std::abs(c) <= largest_coordinate))  // also true for NaN
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
    for (const auto& p : mesh.positions) extend(box, Box{to_point(p), to_point(p), false});
    return box;
}

double diagonal(const Box& box) { return length(box.high - box.low); }

std::vector<std::uint32_t> first_coincident_vertex(const Mesh& mesh) {
    std::vector<std::uint32_t> order(mesh.positions.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return mesh.positions[a] != mesh.positions[b] ? mesh.positions[a] < mesh.positions[b] : a < b;
    });
    std::vector<std::uint32_t> first(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        const bool same = i > 0 && mesh.positions[order[i]] == mesh.positions[order[i - 1]];
        first[order[i]] = same ? first[order[i - 1]] : order[i];
    }
    return first;
}

std::vector<Vector3f> welded_normals(const Mesh& mesh) {
    const auto first = first_coincident_vertex(mesh);
    std::vector<Point3> sums(mesh.positions.size());
    for (const auto& t : mesh.triangles) {
        const Point3 a = to_point(mesh.positions[t[0]]);
        const Point3 n = cross(to_point(mesh.positions[t[1]]) - a, to_point(mesh.positions[t[2]]) - a);
        for (std::uint32_t v : t) sums[first[v]] = sums[first[v]] + n;
    }
    std::vector<Vector3f> normals(sums.size());
    for (std::size_t v = 0; v < sums.size(); ++v) {
        const Point3 n = normalised(sums[first[v]]);
        normals[v] = {static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])};
    }
    return normals;
}

double mean_edge_length(const Mesh& mesh) {
    double sum = 0;
    for (const auto& t : mesh.triangles)
        for (std::size_t i = 0; i < 3; ++i)
            sum += length(to_point(mesh.positions[t[i]]) - to_point(mesh.positions[t[(i + 1) % 3]]));
    return mesh.triangles.empty() ? 0 : sum / (3.0 * static_cast<double>(mesh.triangles.size()));
}

}  // namespace htvm
