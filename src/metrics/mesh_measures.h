// What every metric needs of a mesh: is it usable, how large is it, where do its vertices face, which of them coincide.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm {

// A point or vector in mm.
struct Point3 {
    std::array<double, 3> at{0, 0, 0};
    double& operator[](std::size_t i) { return at[i]; }
    double operator[](std::size_t i) const { return at[i]; }
};

inline Point3 to_point(const Vector3f& v) { return {{v[0], v[1], v[2]}}; }
inline Point3 operator+(const Point3& a, const Point3& b) { return {{a[0] + b[0], a[1] + b[1], a[2] + b[2]}}; }
inline Point3 operator-(const Point3& a, const Point3& b) { return {{a[0] - b[0], a[1] - b[1], a[2] - b[2]}}; }
inline Point3 operator*(const Point3& a, double s) { return {{a[0] * s, a[1] * s, a[2] * s}}; }
inline double dot(const Point3& a, const Point3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Point3 cross(const Point3& a, const Point3& b) {
    return {{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}};
}
double length(const Point3& a);
// a / |a|; zero stays zero.
Point3 normalised(const Point3& a);

// Coordinates beyond this are refused: squared distances would leave the float range of the search structures.
inline constexpr float largest_coordinate = 1e9f;  // mm

// bad_input unless the mesh is one that the metrics can measure: finite coordinates within +-largest_coordinate,
// triangle indices < vertex count, at most 2^31 vertices and triangles, attribute arrays empty or one entry a vertex.
// `name` says in the message which mesh it is. Every other function of src/metrics expects a mesh that passed.
Result<void> check_measurable(const Mesh& mesh, const std::string& name);

// Axis-aligned box in mm; empty until something was put in.
struct Box {
    Point3 low, high;
    bool empty = true;
};
void extend(Box& box, const Box& other);
Box bounding_box(const Mesh& mesh);
double diagonal(const Box& box);  // mm; 0 for an empty box

// Per vertex, the lowest index of a vertex at exactly the same position (itself where it is the first).
std::vector<std::uint32_t> first_coincident_vertex(const Mesh& mesh);

// Unit normals, one per vertex: the sum of the area-weighted normals of the triangles round it. Vertices at the same
// position share one normal, so that a surface cut along texture seams stays smooth. Zero where no triangle with an
// area touches the position. The mesh's own normals are not looked at.
std::vector<Vector3f> welded_normals(const Mesh& mesh);

// Mean length of the three sides over all triangles, mm; 0 without triangles.
double mean_edge_length(const Mesh& mesh);

}  // namespace htvm
