#include "io/polygon.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace htvm {

namespace {

using Point = std::array<double, 2>;
using Vector = std::array<double, 3>;

Vector from_to(const Vector3f& a, const Vector3f& b) {
    return {static_cast<double>(b[0]) - static_cast<double>(a[0]),
            static_cast<double>(b[1]) - static_cast<double>(a[1]),
            static_cast<double>(b[2]) - static_cast<double>(a[2])};
}

Vector cross(const Vector& a, const Vector& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Twice the area of the triangle a b c, below 0 if it turns clockwise.
double turn(const Point& a, const Point& b, const Point& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// The number of looks at a corner that a mesh may take: about a second.
constexpr std::uint64_t most_looks = std::uint64_t{1} << 26;

// A polygon in its plane, counterclockwise, from which ears are cut off. Kept from one polygon to the next for its
// memory.
struct Outline {
    std::vector<std::uint32_t> vertices;  // of the corners, in the mesh
    std::vector<Point> points;
    std::vector<std::uint32_t> before, after;  // the corners that are left, as a ring
    std::vector<std::uint32_t> reflex;         // corners that were not convex at first: what may lie within an ear
    std::vector<Triangle> triangles;           // what was cut off
};

// The normal of each of the fan's triangles, as long as twice its area.
Vector normal_of(const Mesh& mesh, const Triangle& triangle) {
    const auto& first = mesh.positions[triangle[0]];
    return cross(from_to(first, mesh.positions[triangle[1]]), from_to(first, mesh.positions[triangle[2]]));
}

// Whether a triangle faces away from the polygon by more than rounding has it; sets the polygon's normal.
bool folds_over(const Mesh& mesh, std::span<const Triangle> fan, Vector& normal) {
    constexpr double tolerance = 1e-4;  // of the polygon's area
    normal = {};
    for (const auto& triangle : fan) {
        const auto of_triangle = normal_of(mesh, triangle);
        for (std::size_t axis = 0; axis < 3; ++axis) normal[axis] += of_triangle[axis];
    }
    const double least = -tolerance * dot(normal, normal);
    if (!(least < 0)) return false;
    for (const auto& triangle : fan) {
        if (dot(normal_of(mesh, triangle), normal) < least) return true;
    }
    return false;
}

double turn_at(const Outline& outline, std::uint32_t corner) {
    const auto& points = outline.points;
    return turn(points[outline.before[corner]], points[corner], points[outline.after[corner]]);
}

// Looks at the polygon along the axis that its normal is closest to.
void flatten(const Mesh& mesh, std::span<const Triangle> fan, const Vector& normal, Outline& outline) {
    std::size_t axis = 0;
    for (std::size_t other = 1; other < 3; ++other) {
        if (std::abs(normal[other]) > std::abs(normal[axis])) axis = other;
    }
    std::size_t across = (axis + 1) % 3, up = (axis + 2) % 3;
    if (normal[axis] < 0) std::swap(across, up);
    outline.vertices = {fan[0][0], fan[0][1]};
    for (const auto& triangle : fan) outline.vertices.push_back(triangle[2]);
    const auto corners = static_cast<std::uint32_t>(outline.vertices.size());
    outline.points.resize(corners);
    outline.before.resize(corners);
    outline.after.resize(corners);
    outline.reflex.clear();
    outline.triangles.clear();
    for (std::uint32_t c = 0; c < corners; ++c) {
        const auto place = from_to(mesh.positions[outline.vertices[0]], mesh.positions[outline.vertices[c]]);
        outline.points[c] = {place[across], place[up]};
        outline.before[c] = c == 0 ? corners - 1 : c - 1;
        outline.after[c] = c + 1 == corners ? 0 : c + 1;
    }
    for (std::uint32_t c = 0; c < corners; ++c) {
        if (!(turn_at(outline, c) > 0)) outline.reflex.push_back(c);
    }
}

// Whether the triangle at a convex corner holds no other corner. Those at the places of its own corners do not count:
// the two edges between an outline and its hole meet there.
bool is_ear(const Outline& outline, std::uint32_t corner, std::uint64_t& looks) {
    const auto& points = outline.points;
    const auto first = outline.before[corner], last = outline.after[corner];
    const auto &a = points[first], &b = points[corner], &c = points[last];
    for (const auto other : outline.reflex) {
        ++looks;
        if (outline.after[other] == other) continue;  // it was cut off
        const auto& p = points[other];
        if (p == a || p == b || p == c) continue;
        if (turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0) return false;
    }
    return true;
}

// False if there comes a time when no ear is left, or if it takes too many looks.
bool cut_ears(Outline& outline, std::uint64_t& looks) {
    auto& [vertices, points, before, after, reflex, triangles] = outline;
    std::uint32_t corner = 0;
    std::size_t left = points.size(), passed = 0;
    while (left > 3) {
        if (looks > most_looks || passed > 2 * left) return false;
        ++looks;
        const double turns = turn_at(outline, corner);
        // Corners on a straight line are ears only where nothing else is: a round later.
        const bool is_cut = turns > 0 ? is_ear(outline, corner, looks) : turns == 0 && passed > left;
        const auto next = after[corner], previous = before[corner];
        if (!is_cut) {
            corner = next;
            ++passed;
            continue;
        }
        triangles.push_back({vertices[previous], vertices[corner], vertices[next]});
        after[previous] = next;
        before[next] = previous;
        after[corner] = corner;
        corner = next;
        --left;
        passed = 0;
    }
    if (turn_at(outline, corner) < 0) return false;
    triangles.push_back({vertices[before[corner]], vertices[corner], vertices[after[corner]]});
    return true;
}

}  // namespace

void mend_fans(Mesh& mesh, std::span<const Fan> fans) {
    Outline outline;
    std::uint64_t looks = 0;
    for (const auto& [first, count] : fans) {
        const auto fan = std::span(mesh.triangles).subspan(first, count);
        Vector normal{};
        if (count < 2 || !folds_over(mesh, fan, normal)) continue;
        if (looks > most_looks) return;
        flatten(mesh, fan, normal, outline);
        if (cut_ears(outline, looks)) std::copy(outline.triangles.begin(), outline.triangles.end(), fan.begin());
    }
}

}  // namespace htvm
