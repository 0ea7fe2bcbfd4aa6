#include "surface/surface_index.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <nanoflann.hpp>

#include "core/parallel.h"

namespace htvm::internal {

std::vector<Point3f> points_of(std::span<const LatticePoint> positions) {
    std::vector<Point3f> out;
    out.reserve(positions.size());
    for (const auto p : positions) out.push_back(point_of(p));
    return out;
}

std::vector<Point3f> points_of(std::span<const Vector3d> vectors) {
    std::vector<Point3f> out;
    out.reserve(vectors.size());
    for (const auto& v : vectors) out.push_back(to_floats(v));
    return out;
}

// ---- The tree

struct NearestPoints::Tree {
    explicit Tree(std::span<const Point3f> given) : points(given.begin(), given.end()) {
        if (!points.empty()) index = std::make_unique<Index>(3, *this, nanoflann::KDTreeSingleIndexAdaptorParams(12));
    }
    std::size_t kdtree_get_point_count() const { return points.size(); }
    float kdtree_get_pt(std::size_t i, std::size_t axis) const { return points[i][axis]; }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
        return false;
    }
    using Index =
        nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Tree>, Tree, 3, std::uint32_t>;
    std::vector<Point3f> points;
    std::unique_ptr<Index> index;
};

NearestPoints::NearestPoints(std::span<const Point3f> points) : tree_(std::make_unique<Tree>(points)) {}
NearestPoints::NearestPoints(NearestPoints&&) noexcept = default;
NearestPoints& NearestPoints::operator=(NearestPoints&&) noexcept = default;
NearestPoints::~NearestPoints() = default;

Neighbour NearestPoints::nearest(const Point3f& query) const {
    Neighbour out;
    // How many it finds is known, which newer versions of nanoflann want to be said.
    static_cast<void>(tree_->index->knnSearch(query.data(), 1, &out.index, &out.squared_distance));
    return out;
}

std::size_t NearestPoints::size() const { return tree_->points.size(); }
const Point3f& NearestPoints::point(std::size_t index) const { return tree_->points[index]; }

// ---- The grid

namespace {

constexpr std::int32_t most_cell = 1 << 24;  // coordinates beyond this are clamped to the cells at the ends

bool finite(const Point3f& p) { return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]); }

// floor(x); values that are out of range, or not a number, give an end of the range of cells.
std::int32_t floor_of(float x) {
    if (!(x > -static_cast<float>(most_cell))) return -most_cell;
    if (x >= static_cast<float>(most_cell)) return most_cell;
    const auto whole = static_cast<std::int32_t>(x);
    return whole - (static_cast<float>(whole) > x ? 1 : 0);
}

float product(const Point3f& a, const Point3f& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

float squared_distance_of(const Point3f& a, const Point3f& b) {
    const Point3f apart = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return product(apart, apart);
}

}  // namespace

OrientedPoints::OrientedPoints(std::span<const Point3f> points, std::span<const Point3f> normals, float cell)
    : side_(cell), per_side_(1 / cell) {
    mask_ = std::bit_ceil(static_cast<std::uint32_t>(std::max<std::size_t>(points.size() * 2, 64))) - 1;
    first_.assign(std::size_t{mask_} + 2, 0);
    std::vector<std::uint32_t> bucket(points.size());
    place_.assign(points.size(), no_point);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!finite(points[i])) continue;
        const std::int32_t z = cell_of(points[i][2]);
        bucket[i] = block_of(cell_of(points[i][0]), cell_of(points[i][1]), z >> 3) + static_cast<std::uint32_t>(z & 7);
        ++first_[bucket[i] + 1];
        ++kept;
    }
    for (std::size_t b = 1; b < first_.size(); ++b) first_[b] += first_[b - 1];
    entries_.resize(kept);
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!finite(points[i])) continue;
        place_[i] = next[bucket[i]]++;
        entries_[place_[i]] = {points[i], normals[i], static_cast<std::uint32_t>(i)};
    }
}

std::int32_t OrientedPoints::cell_of(float coordinate) const { return floor_of(coordinate * per_side_); }

// The first of the eight buckets of a block; z counts blocks here.
std::uint32_t OrientedPoints::block_of(std::int32_t x, std::int32_t y, std::int32_t z) const {
    const std::uint32_t h = static_cast<std::uint32_t>(x) * 73856093u ^ static_cast<std::uint32_t>(y) * 19349663u ^
                            static_cast<std::uint32_t>(z) * 83492791u;
    return ((h ^ (h >> 15)) << 3) & mask_;
}

void OrientedPoints::look_at(std::uint32_t begin, std::uint32_t end, const Query& query, OrientedMatch& best) const {
    for (std::uint32_t e = begin; e < end; ++e) {
        const Entry& entry = entries_[e];
        const Point3f apart = {entry.point[0] - query.point[0], entry.point[1] - query.point[1],
                               entry.point[2] - query.point[2]};
        const float d = product(apart, apart);
        if (d > best.squared_distance) continue;
        if (d == best.squared_distance && best.found && entry.index >= best.index) continue;
        if (product(entry.normal, query.normal) < query.agreement && entry.normal != Point3f{}) continue;
        best = {entry.index, d, true};
    }
}

// Searches all cells that are within the radius and within the best distance so far. True if this covered all points.
bool OrientedPoints::look_into_ball(float radius, const Query& query, OrientedMatch& best) const {
    const auto& p = query.point;
    const float rounding = 1e-6f * (side_ + std::abs(p[0]) + std::abs(p[1]) + std::abs(p[2]));
    Cell low{}, high{};
    double cells = 1;
    for (std::size_t k = 0; k < 3; ++k) {
        low[k] = cell_of(p[k] - radius - rounding);
        high[k] = cell_of(p[k] + radius + rounding);
        cells *= static_cast<double>(high[k]) - low[k] + 1;
    }
    if (cells > 8.0 * static_cast<double>(entries_.size())) {  // trying all points is faster
        look_at(0, static_cast<std::uint32_t>(entries_.size()), query, best);
        return true;
    }
    const auto squared_gap = [&](std::size_t axis, std::int32_t cell) {
        if (std::abs(cell) >= most_cell) return 0.0f;
        const float below = static_cast<float>(cell) * side_ - p[axis];
        const float gap = std::max({below - rounding, -below - side_ - rounding, 0.0f});
        return gap * gap;
    };
    for (std::int32_t x = low[0]; x <= high[0]; ++x) {
        const float gap_x = squared_gap(0, x);
        if (gap_x > best.squared_distance) continue;
        for (std::int32_t y = low[1]; y <= high[1]; ++y) {
            if (gap_x + squared_gap(1, y) > best.squared_distance) continue;
            for (std::int32_t z = low[2]; z <= high[2];) {
                const std::int32_t last = std::min(z | 7, high[2]);
                const std::uint32_t block = block_of(x, y, z >> 3);
                look_at(first_[block + static_cast<std::uint32_t>(z & 7)],
                        first_[block + static_cast<std::uint32_t>(last & 7) + 1], query, best);
                z = last + 1;
            }
        }
    }
    return false;
}

OrientedMatch OrientedPoints::nearest(const Point3f& query, const Point3f& normal, float reach, float agreement,
                                      std::uint32_t guess) const {
    OrientedMatch best;
    if (entries_.empty() || !finite(query)) return best;
    best.squared_distance = reach * reach;
    const Query wanted{query, normal, agreement};
    if (guess < place_.size() && place_[guess] != no_point) look_at(place_[guess], place_[guess] + 1, wanted, best);
    const std::int32_t z = cell_of(query[2]);
    const std::uint32_t own =
        block_of(cell_of(query[0]), cell_of(query[1]), z >> 3) + static_cast<std::uint32_t>(z & 7);
    look_at(first_[own], first_[own + 1], wanted, best);
    // Balls whose radius doubles until the best match lies within.
    for (float radius = 0.5f * side_;; radius *= 2) {
        const float bound = std::sqrt(best.squared_distance);
        const bool all = look_into_ball(std::min(radius, bound), wanted, best);
        if (all || radius >= bound || best.squared_distance <= radius * radius) break;
    }
    return best;
}

// ---- Surfaces

namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

TrianglePoint closest_on(std::span<const Point3f> positions, const Triangle& t, const Vector3d& query) {
    return closest_on_triangle(query, to_vector(positions[t[0]]), to_vector(positions[t[1]]),
                               to_vector(positions[t[2]]));
}

SurfacePoint surface_point(const SurfaceIndex& surface, std::uint32_t triangle, const std::array<float, 3>& shares,
                           float squared_distance) {
    SurfacePoint out{triangle, shares, {}, squared_distance};
    const auto& t = surface.triangles[triangle];
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t c = 0; c < 3; ++c) out.point[i] += out.shares[c] * surface.positions[t[c]][i];
    return out;
}

double area_of(std::span<const Point3f> positions, std::span<const Triangle> triangles) {
    double doubled = 0;
    for (const auto& t : triangles) doubled += length(area_vector(positions, t));
    return doubled / 2;
}

// The spacing of `count` points that are spread over `area`.
float gap_of(double area, std::size_t count) {
    const double gap = count > 0 ? std::sqrt(area / static_cast<double>(count)) : 0;
    return std::isfinite(gap) ? static_cast<float>(gap) : 0.0f;
}

}  // namespace

// ---- Surfaces: from anywhere

namespace {

std::size_t hash_of(const Point3f& p) {
    std::uint64_t hash = 0;
    for (const float c : p)
        hash = (hash ^ std::bit_cast<std::uint32_t>(c + 0.0f)) * 0x9E3779B97F4A7C15ull;  // so that -0 hashes like 0
    return static_cast<std::size_t>(hash ^ (hash >> 32));
}

// A triangle seen on its longest side, from a to b; c is the opposite corner.
struct LongTriangle {
    Point3f a{}, b{}, c{};
    double length = 0, height = 0;
};

LongTriangle lay_along_longest_side(const Point3f& p, const Point3f& q, const Point3f& r) {
    LongTriangle best;
    const std::array<Point3f, 3> corners = {p, q, r};
    for (std::size_t i = 0; i < 3; ++i) {
        const auto &a = corners[i], &b = corners[(i + 1) % 3], &c = corners[(i + 2) % 3];
        const Vector3d side = to_vector(b) - to_vector(a);
        const double long_side = length(side);
        if (!(long_side > best.length)) continue;
        best = {a, b, c, long_side, length(cross(side, to_vector(c) - to_vector(a))) / long_side};
    }
    return best;
}

// The number of rows of points parallel to the longest side, and of points in the longest row.
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

}  // namespace

struct SurfaceIndex::Anywhere {
    explicit Anywhere(const SurfaceIndex& surface);
    void place_vertices(const SurfaceIndex& surface);
    void spread_over_long_triangles();
    std::vector<Point3f> places;             // the distinct positions of the surface's vertices, then points on long
                                             // triangles
    std::vector<std::uint32_t> vertex_at;    // for each of these positions, the mesh's first vertex there
    std::vector<Triangle> corners;           // the triangles, as indices into places
    TrianglesAround around;                  // the triangles around each place that is a vertex
    std::vector<std::uint32_t> spread_over;  // for each point on a long triangle, that triangle
    double doubtful = 0;                     // squared distance beyond which another sheet of the surface may be nearer
    NearestPoints tree{std::span<const Point3f>{}};
};

SurfaceIndex::Anywhere::Anywhere(const SurfaceIndex& surface) {
    place_vertices(surface);
    around = triangles_around(places.size(), corners);
    spread_over_long_triangles();
    tree = NearestPoints(places);
}

// Merges vertices at the same position, with an open-addressing hash table of twice as many slots as vertices.
void SurfaceIndex::Anywhere::place_vertices(const SurfaceIndex& surface) {
    const auto& vertices = surface.positions;
    std::vector<bool> used(vertices.size(), surface.triangles.empty());
    for (const auto& t : surface.triangles)
        for (const auto v : t) used[v] = true;
    const std::size_t mask = std::bit_ceil(2 * vertices.size() + 1) - 1;
    std::vector<std::uint32_t> table(mask + 1, none), place_of(vertices.size(), none);
    for (std::uint32_t v = 0; v < vertices.size(); ++v) {
        if (!used[v]) continue;
        std::size_t slot = hash_of(vertices[v]) & mask;
        while (table[slot] != none && places[table[slot]] != vertices[v]) slot = (slot + 1) & mask;
        if (table[slot] == none) {
            table[slot] = static_cast<std::uint32_t>(places.size());
            places.push_back(vertices[v]);
            vertex_at.push_back(v);
        }
        place_of[v] = table[slot];
    }
    corners.reserve(surface.triangles.size());
    for (const auto& t : surface.triangles) corners.push_back({place_of[t[0]], place_of[t[1]], place_of[t[2]]});
}

// Puts points on every triangle much longer than the median one: about as dense as the vertices elsewhere, or sparser
// if that would give more points than there are vertices.
void SurfaceIndex::Anywhere::spread_over_long_triangles() {
    if (corners.empty()) return;
    std::vector<LongTriangle> laid;
    std::vector<double> lengths;
    laid.reserve(corners.size());
    lengths.reserve(corners.size());
    for (const auto& t : corners) {
        laid.push_back(lay_along_longest_side(places[t[0]], places[t[1]], places[t[2]]));
        lengths.push_back(laid.back().length);
    }
    const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
    std::nth_element(lengths.begin(), middle, lengths.end());
    doubtful = 0.09 * *middle * *middle;
    const double least = 2 * *middle;
    if (!(least > 0)) return;
    const double most_points = 1000 + static_cast<double>(places.size());
    double spacing = *middle;
    for (double count = most_points + 1; count > most_points; spacing *= 1.5) {
        count = 0;
        for (const auto& t : laid)
            if (t.length > least) count += points_on(t, spacing * 1.5);
    }
    for (std::uint32_t i = 0; i < laid.size(); ++i) {
        if (!(laid[i].length > least)) continue;
        spread_points(laid[i], spacing, places);
        spread_over.resize(places.size() - vertex_at.size(), i);
    }
}

struct SurfaceIndex::OnDemand {
    std::once_flag once, grid_once;
    std::unique_ptr<const Anywhere> anywhere;
    std::unique_ptr<const OrientedPoints> grid;
};

const OrientedPoints& SurfaceIndex::grid() const {
    std::call_once(on_demand_->grid_once,
                   [&] { on_demand_->grid = std::make_unique<OrientedPoints>(positions, normals, cell_); });
    return *on_demand_->grid;
}

const SurfaceIndex::Anywhere& SurfaceIndex::anywhere() const {
    std::call_once(on_demand_->once, [&] { on_demand_->anywhere = std::make_unique<Anywhere>(*this); });
    return *on_demand_->anywhere;
}

SurfacePoint SurfaceIndex::closest(const Point3f& query) const {
    const Anywhere& search = anywhere();
    const auto nearest = search.tree.nearest(query);
    if (triangles.empty())
        return {search.vertex_at[nearest.index], {1, 0, 0}, search.places[nearest.index], nearest.squared_distance};
    const Vector3d from = to_vector(query);
    TrianglePoint best;
    best.squared_distance = std::numeric_limits<double>::infinity();
    std::uint32_t best_triangle = 0;
    constexpr std::size_t most_tried = 24;  // number of places after which a walk is given up as not worth its time
    std::array<std::uint32_t, most_tried> tried{};
    std::size_t count = 0;
    const auto try_triangle = [&](std::uint32_t triangle) {
        const auto found = closest_on(search.places, search.corners[triangle], from);
        if (found.squared_distance < best.squared_distance) best = found, best_triangle = triangle;
    };
    const auto try_around = [&](std::uint32_t place) {
        const auto tried_end = tried.begin() + static_cast<std::ptrdiff_t>(count);
        if (count == most_tried || std::find(tried.begin(), tried_end, place) != tried_end) return;
        tried[count++] = place;
        for (const auto triangle : search.around.of(place)) try_triangle(triangle);
    };
    const auto walk_from = [&](std::uint32_t place) {
        if (place < search.vertex_at.size())
            try_around(place);
        else
            try_triangle(search.spread_over[place - search.vertex_at.size()]);
        for (double before = std::numeric_limits<double>::infinity(); best.squared_distance < before;) {
            before = best.squared_distance;
            for (const auto corner : Triangle(search.corners[best_triangle])) try_around(corner);
        }
    };
    walk_from(nearest.index);
    if (best.squared_distance > search.doubtful) {
        const auto& t = triangles[best_triangle];
        const Vector3d found =
            point_at(best.shares, to_vector(positions[t[0]]), to_vector(positions[t[1]]), to_vector(positions[t[2]]));
        const auto other = search.tree.nearest(to_floats(from * 2 - found)).index;
        if (other != nearest.index) walk_from(other);
    }
    return surface_point(*this, best_triangle, to_floats(best.shares), static_cast<float>(best.squared_distance));
}

// ---- Surfaces: facing the same way

void SurfaceIndex::find_directions(const SurfaceIndexOptions& options) {
    cell_ = options.cell;
    double area = 0;
    const auto find_normals = [&] {
        std::vector<Vector3d> sums(positions.size(), Vector3d{});
        for (const auto& t : triangles) {
            const Vector3d across = area_vector(std::span<const Point3f>(positions), t);
            area += length(across) / 2;
            for (const auto v : t) sums[v] = sums[v] + across;
        }
        normals.reserve(positions.size());
        for (const auto& sum : sums) normals.push_back(to_floats(normalised(sum)));
    };
    parallel_invoke(options.threads, find_normals, [&] { around = triangles_around(positions.size(), triangles); });
    fine_gap = gap_of(area, positions.size());
    const std::size_t count = std::min(options.samples, positions.size());
    coarse_gap = gap_of(area, count);
    const auto index_samples = [&] {
        std::vector<Point3f> chosen_points(count), chosen_normals(count);
        samples.resize(count);
        for (std::size_t i = 0; i < count; ++i) {
            samples[i] = static_cast<std::uint32_t>(i * positions.size() / count);
            chosen_points[i] = positions[samples[i]];
            chosen_normals[i] = normals[samples[i]];
        }
        // Samples are spaced more widely than vertices, by the square root of the ratio of their numbers.
        const float wider =
            count == 0 ? 1.0f : std::sqrt(static_cast<float>(positions.size()) / static_cast<float>(count));
        coarse = OrientedPoints(chosen_points, chosen_normals, options.cell * wider);
    };
    parallel_invoke(options.threads, index_samples,
                    [&] { fans_ = VertexFans(positions, normals, triangles, around, options.threads); });
}

// The closest point so far.
struct SurfaceIndex::Best {
    std::uint32_t side = none;      // three times the triangle's index, and which of its corners was tried first
    Triangle corners{};             // in the order in which they were tried
    std::array<float, 3> shares{};  // of these
    Point3f point{};
    float squared_distance = std::numeric_limits<float>::infinity();
};

namespace {

Point3f difference(const Point3f& a, const Point3f& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

// The place between a and b, both as seen from the query, that is nearest to it: how far from a, and squared distance.
std::pair<float, float> closest_on_side(const Point3f& a, const Point3f& b) {
    const Point3f side = difference(b, a);
    const float squared_length = product(side, side);
    const float t = squared_length > 0 ? std::clamp(-product(a, side) / squared_length, 0.0f, 1.0f) : 0.0f;
    const Point3f p = {a[0] + side[0] * t, a[1] + side[1] * t, a[2] + side[2] * t};
    return {t, product(p, p)};
}

}  // namespace

NearOnTriangle near_on_triangle(const Point3f& first, const Point3f& second, const Point3f& third, const Point3f& query,
                                float least, const Facing* facing) {
    // Seen from the query.
    const Point3f a = difference(first, query), b = difference(second, query), c = difference(third, query);
    const Point3f ab = difference(b, a), ac = difference(c, a);
    const Point3f across = {ab[1] * ac[2] - ab[2] * ac[1], ab[2] * ac[0] - ab[0] * ac[2],
                            ab[0] * ac[1] - ab[1] * ac[0]};
    const float whole = product(across, across), height = product(across, a);
    NearOnTriangle out;
    if (height * height > least * whole) return out;
    if (facing) {
        const float along = product(across, facing->normal), agreement = facing->agreement;
        const float wanted = agreement * agreement * whole;
        const bool agrees =
            agreement > 0 ? along > 0 && along * along >= wanted : along >= 0 || along * along <= wanted;
        if (!agrees || !(whole > 0)) return out;
    }
    const float bb = product(ab, ab), bc = product(ab, ac), cc = product(ac, ac);
    const float from_b = -product(a, ab), from_c = -product(a, ac);
    const float v = cc * from_b - bc * from_c, w = bb * from_c - bc * from_b, u = whole - v - w;
    const bool thin = !(whole > 1e-4f * bb * cc);
    if (!thin && u >= 0 && v >= 0 && w >= 0) return {{u / whole, v / whole, w / whole}, height * height / whole};
    const std::array<Point3f, 3> corners = {a, b, c};
    const std::array<float, 3> within = {u, v, w}, squared_sides = {bb + cc - 2 * bc, cc, bb};
    for (std::size_t corner = 0; corner < 3; ++corner) {
        if (!thin && within[corner] >= 0) continue;
        // How far the query lies beyond the line of the opposite side, in the triangle's plane, tells most of those
        // that are too far away.
        const float squared_side = squared_sides[corner];
        if (!thin && height * height * squared_side + within[corner] * within[corner] > least * whole * squared_side)
            continue;
        const std::size_t i = (corner + 1) % 3, j = (corner + 2) % 3;
        const auto [along, squared] = closest_on_side(corners[i], corners[j]);
        if (!(squared < out.squared_distance)) continue;
        out = {{}, squared};
        out.shares[i] = 1 - along;
        out.shares[j] = along;
    }
    return out;
}

// Tries the triangles around a vertex.
void SurfaceIndex::try_around(std::uint32_t vertex, const Point3f& query, const Facing* facing, Best& best) const {
    const auto& fan = fans_[vertex];
    const auto try_side = [&](std::uint32_t side, const Triangle& corners, const Point3f& b, const Point3f& c,
                              const Facing* must) {
        const auto near = near_on_triangle(fan.own, b, c, query, best.squared_distance, must);
        if (!(near.squared_distance < best.squared_distance)) return;
        best = {side, corners, near.shares, {}, near.squared_distance};
        for (std::size_t i = 0; i < 3; ++i)
            best.point[i] = near.shares[0] * fan.own[i] + near.shares[1] * b[i] + near.shares[2] * c[i];
    };
    if (fan.regular()) {
        const auto near = fans_.nearest(vertex, query, facing);
        if (!(near.squared_distance < best.squared_distance)) return;
        const std::size_t lane = near.lane, next = (lane + 1) % VertexFan::lanes;
        try_side(fan.side[lane], {vertex, fan.neighbour[lane], fan.neighbour[next]}, fan.place(lane), fan.place(next),
                 nullptr);
        return;
    }
    for (const auto triangle : around.of(vertex)) {
        const auto& t = triangles[triangle];
        const std::uint32_t at = t[0] == vertex ? 0 : t[1] == vertex ? 1 : 2;
        const auto b = t[(at + 1) % 3], c = t[(at + 2) % 3];
        try_side(3 * triangle + at, {vertex, b, c}, positions[b], positions[c], facing);
    }
}

Neighbour SurfaceIndex::nearest_along(const Point3f& query, std::uint32_t from) const {
    Neighbour best{from, squared_distance_of(fans_[from].own, query)};
    for (;;) {
        const auto walk = fans_.walk(query, best.index, best.squared_distance);
        if (walk.vertex != best.index) {
            // To a walk distances that differ by less than a millionth are equal: only what is truly nearer counts, or
            // two vertices could lead to each other for ever.
            const Neighbour there{walk.vertex, squared_distance_of(fans_[walk.vertex].own, query)};
            if (!(there.squared_distance < best.squared_distance)) return best;
            best = there;
        }
        if (walk.ended) return best;
        const auto here = best.index;
        for (const auto t : around.of(here))
            for (const auto beside : triangles[t])
                if (const float squared = squared_distance_of(positions[beside], query);
                    squared < best.squared_distance)
                    best = {beside, squared};
        if (best.index == here) return best;
    }
}

float SurfaceIndex::begins_near() const { return 4 * fine_gap; }

OrientedMatch SurfaceIndex::nearest_facing(const Point3f& query, const Point3f& normal, const FacingReach& within,
                                           std::uint32_t guess) const {
    constexpr float as_near_as_can_be = 1;  // spacings of the vertices
    if (within.along && guess < positions.size()) {
        if (squared_distance_of(fans_[guess].own, query) < begins_near() * begins_near()) {
            const auto found = nearest_along(query, guess);
            const float most = std::min(within.reach, as_near_as_can_be * fine_gap);
            if (found.squared_distance <= most * most && product(fans_[found.index].normal, normal) >= within.agreement)
                return {found.index, found.squared_distance, true};
            guess = found.index;
        }
    }
    return grid().nearest(query, normal, within.reach, within.agreement, guess);
}

// The closest point of the triangles around a vertex; from where it lies on their rim, they go on beyond.
SurfaceIndex::Best SurfaceIndex::closest_around(std::uint32_t vertex, const Point3f& query,
                                                const Facing* facing) const {
    constexpr std::size_t most_tried = 12;  // number of vertices after which a walk is given up as not worth its time
    Best best;
    std::array<std::uint32_t, most_tried> tried{};
    std::size_t count = 0;
    const auto try_at = [&](std::uint32_t at) {
        const auto end = tried.begin() + static_cast<std::ptrdiff_t>(count);
        if (count == most_tried || std::find(tried.begin(), end, at) != end) return;
        tried[count++] = at;
        try_around(at, query, facing, best);
    };
    try_at(vertex);
    for (auto last = none; best.side != last;) {
        last = best.side;
        const auto shares = best.shares;
        const auto corners = best.corners;
        for (std::size_t i = 0; i < 3; ++i)
            if (shares[i] == 0)
                for (const std::size_t corner : {(i + 1) % 3, (i + 2) % 3})
                    if (shares[corner] > 0) try_at(corners[corner]);
    }
    return best;
}

// With the shares in the order of the triangle's corners.
SurfacePoint SurfaceIndex::found(const Best& best) const {
    if (best.side == none) return {};
    SurfacePoint out{best.side / 3, {}, best.point, best.squared_distance};
    for (std::size_t i = 0; i < 3; ++i) out.shares[(best.side + i) % 3] = best.shares[i];
    return out;
}

SurfacePoint SurfaceIndex::closest_facing(const Point3f& query, const Point3f& normal, const FacingReach& within,
                                          std::uint32_t& guess) const {
    const auto match = nearest_facing(query, normal, within, guess);
    if (!match.found) return {};
    guess = match.index;
    const Facing facing{normal, within.agreement};
    Best best;
    if (within.along)
        best = closest_around(match.index, query, &facing);
    else
        try_around(match.index, query, &facing, best);
    return found(best);
}

SurfacePoint SurfaceIndex::closest_within(const Point3f& query, float reach, std::uint32_t& guess) const {
    // The corners of a triangle within reach may be farther away.
    constexpr float longest_side = 4;  // spacings of the vertices
    const auto match = nearest_facing(query, {}, {.reach = reach + longest_side * fine_gap, .agreement = -2}, guess);
    if (!match.found) return {};
    guess = match.index;
    const auto best = closest_around(match.index, query, nullptr);
    return best.squared_distance > reach * reach ? SurfacePoint{} : found(best);
}

std::vector<SurfacePoint> closest_facing(const SurfaceIndex& surface, std::span<const Point3f> queries,
                                         std::span<const Point3f> normals, const FacingReach& within, Threads threads,
                                         std::span<std::uint32_t> guesses) {
    std::vector<SurfacePoint> out(queries.size());
    // Guesses may decide what is found, so they must not depend on how the threads cut the range.
    constexpr std::size_t in_a_row = 512, ahead = 6;
    parallel_for((queries.size() + in_a_row - 1) / in_a_row, threads, 2, [&](std::size_t begin, std::size_t end) {
        for (std::size_t row = begin; row < end; ++row) {
            std::uint32_t last = OrientedPoints::no_point;
            const std::size_t first = row * in_a_row, after = std::min(queries.size(), first + in_a_row);
            if (within.along && !guesses.empty())
                surface.walk_all(queries.subspan(first, after - first), surface.begins_near(),
                                 guesses.subspan(first, after - first));
            for (std::size_t i = first; i < after; ++i) {
                if (i + ahead < after && !guesses.empty()) surface.expect(guesses[i + ahead]);
                if (!guesses.empty() && guesses[i] != OrientedPoints::no_point) last = guesses[i];
                out[i] = surface.closest_facing(queries[i], normals[i], within, last);
                if (!guesses.empty()) guesses[i] = last;
            }
        }
    });
    return out;
}

SurfaceIndex::SurfaceIndex(std::span<const Point3f> mesh_positions, std::span<const Triangle> mesh_triangles,
                           const SurfaceIndexOptions& options)
    : positions(mesh_positions.begin(), mesh_positions.end()),
      triangles(mesh_triangles.begin(), mesh_triangles.end()),
      on_demand_(std::make_unique<OnDemand>()) {
    if (options.cell > 0) find_directions(options);
}
SurfaceIndex::SurfaceIndex(SurfaceIndex&&) noexcept = default;
SurfaceIndex& SurfaceIndex::operator=(SurfaceIndex&&) noexcept = default;
SurfaceIndex::~SurfaceIndex() = default;

float point_gap(std::span<const Point3f> positions, std::span<const Triangle> triangles, std::size_t count) {
    return gap_of(area_of(positions, triangles), count);
}

}  // namespace htvm::internal
