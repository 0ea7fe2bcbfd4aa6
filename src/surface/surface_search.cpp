#include "surface/surface_search.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

namespace htvm::internal {
namespace {

using Point3d = std::array<double, 3>;

Point3d minus(const Point3f& a, const Point3f& b) {
    return {double{a[0]} - b[0], double{a[1]} - b[1], double{a[2]} - b[2]};
}
double dot(const Point3d& a, const Point3d& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Point3d cross(const Point3d& a, const Point3d& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// Corners relative to the query, so that the point sought is the one nearest to the origin.
struct Corners {
    std::array<Point3d, 3> at;
};

struct Found {
    Point3d barycentric{};
    double squared = std::numeric_limits<double>::infinity();
};

// Keeps the point of the side opposite to `corner` nearest to the origin, if it is nearer than what was found.
void try_side(const Corners& corners, std::size_t corner, Found& best) {
    const std::size_t i = (corner + 1) % 3, j = (corner + 2) % 3;
    const auto &a = corners.at[i], &b = corners.at[j];
    const Point3d side = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const double length = dot(side, side);
    const double t = length > 0 ? std::clamp(-dot(a, side) / length, 0.0, 1.0) : 0.0;
    const Point3d p = {a[0] + t * side[0], a[1] + t * side[1], a[2] + t * side[2]};
    const double squared = dot(p, p);
    if (!(squared < best.squared)) return;
    best.squared = squared;
    best.barycentric = {};
    best.barycentric[i] = 1 - t;
    best.barycentric[j] = t;
}

// The triangle's point nearest to the origin. Seen from outside, it lies on a side that has the origin's projection
// beyond it.
Found nearest_to_origin(const Corners& corners) {
    const auto& [a, b, c] = corners.at;
    const Point3d ab = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, ac = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    const Point3d normal = cross(ab, ac);
    const double area = dot(normal, normal), scale = dot(ab, ab) * dot(ac, ac);
    Found best;
    if (!(area > 1e-20 * scale)) {
        for (std::size_t corner = 0; corner < 3; ++corner) try_side(corners, corner, best);
        return best;
    }
    const double v = dot(normal, cross(ac, a)) / area, w = dot(normal, cross(a, ab)) / area, u = 1 - v - w;
    if (u >= 0 && v >= 0 && w >= 0) {
        const double height = dot(normal, a);
        return {{u, v, w}, height * height / area};
    }
    if (u < 0) try_side(corners, 0, best);
    if (v < 0) try_side(corners, 1, best);
    if (w < 0) try_side(corners, 2, best);
    return best;
}

std::array<float, 3> to_float(const Point3d& b) {
    return {static_cast<float>(b[0]), static_cast<float>(b[1]), static_cast<float>(b[2])};
}

std::size_t hash_of(const Point3f& p) {
    std::uint64_t hash = 0;
    for (const float c : p)
        hash = (hash ^ std::bit_cast<std::uint32_t>(c + 0.0f)) * 0x9E3779B97F4A7C15ull;  // -0 hashes as 0
    return static_cast<std::size_t>(hash ^ (hash >> 32));
}

// A triangle on its longest side, from a to b, with the third corner c across.
struct LongTriangle {
    Point3f a{}, b{}, c{};
    double length = 0, height = 0;
};

LongTriangle lay_along_longest_side(const Point3f& p, const Point3f& q, const Point3f& r) {
    LongTriangle best;
    const std::array<Point3f, 3> corners = {p, q, r};
    for (std::size_t i = 0; i < 3; ++i) {
        const auto &a = corners[i], &b = corners[(i + 1) % 3], &c = corners[(i + 2) % 3];
        const Point3d side = minus(b, a);
        const double length = std::sqrt(dot(side, side));
        if (!(length > best.length)) continue;
        const Point3d normal = cross(side, minus(c, a));
        best = {a, b, c, length, std::sqrt(dot(normal, normal)) / length};
    }
    return best;
}

// Rows of points parallel to the longest side, and points in the longest row.
double rows_on(const LongTriangle& t, double spacing) { return std::ceil(t.height / spacing + 0.5); }
double columns_on(const LongTriangle& t, double spacing) { return std::ceil(t.length / spacing); }
double points_on(const LongTriangle& t, double spacing) { return rows_on(t, spacing) * columns_on(t, spacing); }

// Adds about points_on(t, spacing) / 2 points, at most points_on(t, spacing).
void spread_points(const LongTriangle& t, double spacing, std::vector<Point3f>& places) {
    const double rows = rows_on(t, spacing), columns = columns_on(t, spacing);
    for (double row = 0; row < rows; ++row) {
        const double across = (row + 0.5) / rows, in_row = std::max(1.0, std::floor(columns * (1 - across)));
        for (double i = 0; i < in_row; ++i) {
            const double along = (i + 0.5) / in_row;
            Point3f p{};
            for (std::size_t k = 0; k < 3; ++k)
                p[k] = static_cast<float>((1 - across) * ((1 - along) * t.a[k] + along * t.b[k]) + across * t.c[k]);
            places.push_back(p);
        }
    }
}

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

}  // namespace

std::array<float, 3> closest_barycentric(const Point3f& query, const Point3f& a, const Point3f& b, const Point3f& c) {
    return to_float(nearest_to_origin({{minus(a, query), minus(b, query), minus(c, query)}}).barycentric);
}

SurfaceSearch::SurfaceSearch(std::span<const Point3f> positions, std::span<const Triangle> triangles)
    : vertices_(positions.size()), triangles_(triangles.begin(), triangles.end()), places_(std::span<const Point3f>{}) {
    auto places = place_vertices(positions);
    list_triangles_around_places();
    place_long_triangles(places);
    places_ = NearestPoints(places);
}

void SurfaceSearch::list_triangles_around_places() {
    first_around_.assign(vertex_at_.size() + 1, 0);
    for (const auto& t : corners_)
        for (const auto place : t) ++first_around_[place + 1];
    std::partial_sum(first_around_.begin(), first_around_.end(), first_around_.begin());
    around_.resize(corners_.size() * 3);
    std::vector<std::uint32_t> next(first_around_.begin(), first_around_.end() - 1);
    for (std::uint32_t t = 0; t < corners_.size(); ++t)
        for (const auto place : corners_[t]) around_[next[place]++] = t;
}

// Points on every triangle much longer than the median one, about as dense as the vertices elsewhere, or less so where
// that would be more points than vertices.
void SurfaceSearch::place_long_triangles(std::vector<Point3f>& places) {
    if (corners_.empty()) return;
    std::vector<LongTriangle> triangles;
    std::vector<double> lengths;
    triangles.reserve(corners_.size());
    lengths.reserve(corners_.size());
    for (const auto& t : corners_) {
        triangles.push_back(lay_along_longest_side(places[t[0]], places[t[1]], places[t[2]]));
        lengths.push_back(triangles.back().length);
    }
    const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
    std::nth_element(lengths.begin(), middle, lengths.end());
    doubtful_ = 0.09 * *middle * *middle;
    const double least = 2 * *middle;
    if (!(least > 0)) return;
    const double most_points = 1000 + static_cast<double>(places.size());
    double spacing = *middle;
    for (double points = most_points + 1; points > most_points; spacing *= 1.5) {
        points = 0;
        for (const auto& t : triangles)
            if (t.length > least) points += points_on(t, spacing * 1.5);
    }
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
        if (!(triangles[i].length > least)) continue;
        spread_points(triangles[i], spacing, places);
        spread_over_.resize(places.size() - vertex_at_.size(), i);
    }
}

// Gives every vertex of the surface its place, and returns the places: by an open hash table of vertices twice as long
// as there are vertices.
std::vector<Point3f> SurfaceSearch::place_vertices(std::span<const Point3f> positions) {
    std::vector<bool> used(positions.size(), triangles_.empty());
    for (const auto& t : triangles_)
        for (const auto v : t) used[v] = true;
    const std::size_t mask = std::bit_ceil(2 * positions.size() + 1) - 1;
    std::vector<std::uint32_t> table(mask + 1, none), place_of(positions.size(), none);
    std::vector<Point3f> places;
    for (std::uint32_t v = 0; v < positions.size(); ++v) {
        if (!used[v]) continue;
        std::size_t slot = hash_of(positions[v]) & mask;
        while (table[slot] != none && places[table[slot]] != positions[v]) slot = (slot + 1) & mask;
        if (table[slot] == none) {
            table[slot] = static_cast<std::uint32_t>(places.size());
            places.push_back(positions[v]);
            vertex_at_.push_back(v);
        }
        place_of[v] = table[slot];
    }
    corners_.reserve(triangles_.size());
    for (const auto& t : triangles_) corners_.push_back({place_of[t[0]], place_of[t[1]], place_of[t[2]]});
    return places;
}

SurfacePoint SurfaceSearch::closest(const Point3f& query) const {
    const auto nearest = places_.nearest(query);
    if (triangles_.empty()) {
        return {vertex_at_[nearest.index], {1, 0, 0}, places_.point(nearest.index), nearest.squared_distance};
    }
    Found best;
    std::uint32_t best_triangle = 0;
    constexpr std::size_t most_tried = 24;  // places; a walk longer than this is not worth its time
    std::array<std::uint32_t, most_tried> tried{};
    std::size_t count = 0;
    const auto try_triangle = [&](std::uint32_t triangle) {
        const auto& t = corners_[triangle];
        const Found found = nearest_to_origin({{minus(places_.point(t[0]), query), minus(places_.point(t[1]), query),
                                                minus(places_.point(t[2]), query)}});
        if (found.squared < best.squared) best = found, best_triangle = triangle;
    };
    const auto try_around = [&](std::uint32_t place) {
        const auto tried_end = tried.begin() + static_cast<std::ptrdiff_t>(count);
        if (count == most_tried || std::find(tried.begin(), tried_end, place) != tried_end) return;
        tried[count++] = place;
        for (std::uint32_t k = first_around_[place]; k < first_around_[place + 1]; ++k) try_triangle(around_[k]);
    };
    const auto walk_from = [&](std::uint32_t place) {
        if (place < vertex_at_.size())
            try_around(place);
        else
            try_triangle(spread_over_[place - vertex_at_.size()]);
        for (double before = std::numeric_limits<double>::infinity(); best.squared < before;) {
            before = best.squared;
            for (const auto corner : Triangle(corners_[best_triangle])) try_around(corner);
        }
    };
    walk_from(nearest.index);
    if (best.squared > doubtful_) {
        Point3f beyond{};
        for (std::size_t i = 0; i < 3; ++i) {
            double found = 0;
            for (std::size_t c = 0; c < 3; ++c)
                found += best.barycentric[c] * places_.point(corners_[best_triangle][c])[i];
            beyond[i] = static_cast<float>(2 * query[i] - found);
        }
        const auto other = places_.nearest(beyond).index;
        if (other != nearest.index) walk_from(other);
    }
    const auto& t = corners_[best_triangle];
    SurfacePoint out{best_triangle, to_float(best.barycentric), {}, static_cast<float>(best.squared)};
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t c = 0; c < 3; ++c) out.point[i] += out.barycentric[c] * places_.point(t[c])[i];
    return out;
}

}  // namespace htvm::internal
