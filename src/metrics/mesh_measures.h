// What every metric needs to know about a mesh: whether it is usable, how large it is, where its vertices face, and
// which of them coincide.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/geometry.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm {

// A point or vector in mm.
using Point3 = Vector3d;
using internal::operator+, internal::operator-, internal::operator*;
using internal::cross, internal::dot, internal::length, internal::normalised;
inline Point3 to_point(const Vector3f& v) { return internal::to_vector(v); }

// Coordinates beyond this are refused: squared distances would leave the float range of the search structures.
inline constexpr float largest_coordinate = 1e9f;  // mm

// bad_input unless the metrics can measure the mesh: finite coordinates within +-largest_coordinate, triangle indices <
// vertex count, at most 2^31 vertices and triangles, attribute arrays empty or with one entry per vertex. `name`
// identifies the mesh in the message. Every other function of src/metrics expects a mesh that passed this check.
Result<void> check_measurable(const Mesh& mesh, const std::string& name);

// Vertices that no triangle names are not shown, and no metric counts them. In a mesh without triangles, a point cloud,
// all are shown.
std::vector<bool> shown_vertices(const Mesh& mesh);
// The mesh without the others; nothing if it has none.
std::optional<Mesh> without_hidden_vertices(const Mesh& mesh);

// Axis-aligned box in mm; empty until something is put in.
struct Box {
    Point3 low{}, high{};
    bool empty = true;
};
void extend(Box& box, const Box& other);
Box bounding_box(const Mesh& mesh);  // of what is shown
double diagonal(const Box& box);     // mm; 0 for an empty box

double surface_area(std::span<const Vector3f> positions, std::span<const Triangle> triangles);  // mm^2

// For each vertex, the lowest index of a vertex at exactly the same position (its own if it is the first).
std::vector<std::uint32_t> first_coincident_vertex(const Mesh& mesh);

// Unit normals, one per vertex: the sum of the area-weighted normals of the triangles around it. Vertices at the same
// position share one normal, so that a surface cut along texture seams stays smooth. Zero if no triangle with an area
// touches the position. The mesh's own normals are ignored.
std::vector<Vector3f> welded_normals(const Mesh& mesh);

}  // namespace htvm
