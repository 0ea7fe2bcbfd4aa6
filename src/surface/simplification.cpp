#include "surface/simplification.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>

namespace htvm::internal {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Sum of squared distances to planes, weighted by area: x'Ax + 2b'x + c.
struct Quadric {
    Matrix3d a = Matrix3d::Zero();
    Vector3d b = Vector3d::Zero();
    double c = 0, weight = 0;

    void add_plane(const Vector3d& normal, const Vector3d& point, double area) {
        const double d = -normal.dot(point);
        a += area * normal * normal.transpose();
        b += area * d * normal;
        c += area * d * d;
        weight += area;
    }
    void add(const Quadric& other) {
        a += other.a;
        b += other.b;
        c += other.c;
        weight += other.weight;
    }
    // Mean squared distance from a point to the planes.
    double mean(const Vector3d& x) const {
        return weight > 0 ? std::max(0.0, x.dot(a * x) + 2 * b.dot(x) + c) / weight : 0;
    }
};

// The colours that a vertex stands for.
struct ColourCluster {
    double count = 1;
    std::array<double, 3> mean{};
    double squares = 0;  // sum of squared distances from their mean

    ColourCluster merged(const ColourCluster& other) const {
        ColourCluster out;
        out.count = count + other.count;
        double between = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            const double d = other.mean[i] - mean[i];
            between += d * d;
            out.mean[i] = mean[i] + d * other.count / out.count;
        }
        out.squares = squares + other.squares + between * count * other.count / out.count;
        return out;
    }
};

struct Collapse {
    std::uint32_t keep = 0, drop = 0;
    std::uint64_t age = 0;  // sum of the ages of both ends when the edge was judged
};

// Cheapest first, to within a hundredth; of those that cost the same, what came first. Most collapses that wait are
// overtaken by others around them, so a queue that sorts them exactly would take more time than all else: here each
// waits in a bucket by the leading bits of its cost.
class CollapseQueue {
public:
    bool empty() const { return size_ == 0; }
    void push(double cost, const Collapse& collapse) {  // cost: 0 to 1
        const std::size_t bucket = bucket_of(cost);
        waiting_[bucket].collapses.push_back(collapse);
        lowest_ = std::min(lowest_, bucket);
        ++size_;
    }
    Collapse pop() {
        while (waiting_[lowest_].next == waiting_[lowest_].collapses.size()) waiting_[lowest_++] = {};
        --size_;
        return waiting_[lowest_].collapses[waiting_[lowest_].next++];
    }

private:
    static constexpr int mantissa_bits = 7, exponents = 24;  // what costs less than 2^-24 is one bucket
    static std::size_t bucket_of(double cost) {
        const auto bits = std::bit_cast<std::uint64_t>(std::max(cost, std::ldexp(1.0, -exponents)));
        constexpr auto least = std::bit_cast<std::uint64_t>(1.0) >> (52 - mantissa_bits);
        return (bits >> (52 - mantissa_bits)) - (least - (std::uint64_t{exponents} << mantissa_bits));
    }
    struct Bucket {
        std::vector<Collapse> collapses;
        std::size_t next = 0;
    };
    std::vector<Bucket> waiting_ = std::vector<Bucket>((std::size_t{exponents} << mantissa_bits) + 1);
    std::size_t lowest_ = 0, size_ = 0;
};

struct Simplifier {
    const SimplificationOptions& options;
    std::vector<Vector3d> positions{};
    std::vector<Triangle> triangles{};
    std::vector<bool> triangle_lives{};
    std::vector<std::vector<std::uint32_t>> fans{};  // triangles around each vertex, including dead ones
    std::vector<std::uint32_t> dead{};               // the number of dead ones among them; fewer than half
    std::vector<Quadric> quadrics{};
    std::vector<ColourCluster> colours{};
    std::vector<std::uint64_t> age{};
    std::vector<bool> lives{};
    CollapseQueue queue{};
    std::vector<std::uint32_t> ring_a{}, ring_b{};  // reused between calls
    mutable std::uint64_t looked_at = 0;            // triangles examined

    void prepare(std::span<const Colour> input_colours);
    void add_borders();
    void judge(std::uint32_t a, std::uint32_t b);
    Vector3d merged_position(std::uint32_t a, std::uint32_t b) const;
    bool allowed(std::uint32_t a, std::uint32_t b, const Vector3d& to);
    Vector3d facing(std::uint32_t v) const;
    bool keeps_shape(std::uint32_t moving, std::uint32_t other, const Vector3d& to) const;
    void collapse(std::uint32_t keep, std::uint32_t drop, const Vector3d& to);
    void neighbours(std::uint32_t v, std::vector<std::uint32_t>& out) const;
    std::size_t valence(std::uint32_t v) const { return fans[v].size() - dead[v]; }
    void bury(std::uint32_t v);
    template <class Visit>  // calls visit(triangle) for all live triangles around a vertex
    void for_each_around(std::uint32_t v, const Visit& visit) const {
        looked_at += fans[v].size();
        for (const auto t : fans[v])
            if (triangle_lives[t]) visit(t);
    }
};

// A collapse at a vertex examines all its triangles, and so does every attempt. At a hub of thousands of triangles this
// would take time in proportion to the square of their number. So hubs stay where they are; everything around them can
// still be collapsed.
constexpr std::size_t most_around = 256;

Vector3d area_normal(const Vector3d& a, const Vector3d& b, const Vector3d& c) { return (b - a).cross(c - a); }

void Simplifier::neighbours(std::uint32_t v, std::vector<std::uint32_t>& out) const {
    out.clear();
    for_each_around(v, [&](std::uint32_t t) {
        for (const auto corner : triangles[t])
            if (corner != v) out.push_back(corner);
    });
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
}

// A side of a triangle, from its lower to its higher vertex.
struct Side {
    std::uint32_t low, high, triangle;
};

// By vertices, then by triangle. They are first laid into a row per lower vertex, since sorting many short rows is much
// faster than sorting all at once.
std::vector<Side> sorted_sides(std::span<const Triangle> triangles, std::size_t vertices) {
    const auto over_all = [&](const auto& visit) {
        for (std::uint32_t t = 0; t < triangles.size(); ++t)
            for (std::size_t i = 0; i < 3; ++i) {
                const auto a = triangles[t][i], b = triangles[t][(i + 1) % 3];
                visit(Side{std::min(a, b), std::max(a, b), t});
            }
    };
    std::vector<std::size_t> row(vertices + 1, 0);
    over_all([&](const Side& side) { ++row[side.low + std::size_t{1}]; });
    for (std::size_t v = 0; v < vertices; ++v) row[v + 1] += row[v];
    std::vector<Side> sides(3 * triangles.size());
    auto next = row;
    over_all([&](const Side& side) { sides[next[side.low]++] = side; });
    for (std::size_t v = 0; v < vertices; ++v)
        std::sort(sides.begin() + static_cast<std::ptrdiff_t>(row[v]),
                  sides.begin() + static_cast<std::ptrdiff_t>(row[v + 1]), [](const Side& x, const Side& y) {
                      return x.high != y.high ? x.high < y.high : x.triangle < y.triangle;
                  });
    return sides;
}

// An edge of one triangle, or of more than two, is a border: a plane perpendicular to the triangle keeps it in place.
void Simplifier::add_borders() {
    const auto sides = sorted_sides(triangles, positions.size());
    for (std::size_t i = 0, j = 0; i < sides.size(); i = j) {
        for (j = i + 1; j < sides.size() && sides[j].low == sides[i].low && sides[j].high == sides[i].high; ++j) {
        }
        const auto [a, b, first] = sides[i];
        if (j - i != 2)
            for (std::size_t s = i; s < j; ++s) {
                const auto& t = triangles[sides[s].triangle];
                const Vector3d edge = positions[b] - positions[a];
                const Vector3d across = edge.cross(area_normal(positions[t[0]], positions[t[1]], positions[t[2]]));
                const double length = across.norm();
                if (!(length > 0)) continue;
                for (const auto v : {a, b}) quadrics[v].add_plane(across / length, positions[a], edge.squaredNorm());
            }
        judge(a, b);
    }
}

void Simplifier::prepare(std::span<const Colour> input_colours) {
    fans.resize(positions.size());
    dead.assign(positions.size(), 0);
    quadrics.resize(positions.size());
    age.assign(positions.size(), 0);
    lives.assign(positions.size(), true);
    triangle_lives.assign(triangles.size(), true);
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
        const auto& [a, b, c] = triangles[t];
        if (a == b || b == c || a == c) {
            triangle_lives[t] = false;
            continue;
        }
        for (const auto v : triangles[t]) fans[v].push_back(t);
        const Vector3d normal = area_normal(positions[a], positions[b], positions[c]);
        const double length = normal.norm();
        if (!(length > 0)) continue;
        for (const auto v : triangles[t]) quadrics[v].add_plane(normal / length, positions[a], length / 2);
    }
    colours.resize(positions.size());
    for (std::size_t v = 0; v < input_colours.size(); ++v)
        for (std::size_t c = 0; c < 3; ++c) colours[v].mean[c] = input_colours[v][c];
}

// Where the merged vertex has the least error; on a flat surface, where all points are equal, the midpoint.
Vector3d Simplifier::merged_position(std::uint32_t a, std::uint32_t b) const {
    constexpr double towards_middle = 1e-2;
    Quadric q = quadrics[a];
    q.add(quadrics[b]);
    const Vector3d middle = (positions[a] + positions[b]) / 2;
    if (!(q.weight > 0)) return middle;
    const double pull = towards_middle * q.weight;
    const Matrix3d system = q.a + pull * Matrix3d::Identity();
    const Vector3d found = system.inverse() * (pull * middle - q.b);
    const double reach = (positions[a] - positions[b]).squaredNorm();
    return found.allFinite() && (found - middle).squaredNorm() <= reach ? found : middle;
}

void Simplifier::judge(std::uint32_t a, std::uint32_t b) {
    if (valence(a) > most_around || valence(b) > most_around) return;
    if (options.longest_edge > 0 && (positions[a] - positions[b]).norm() > options.longest_edge) return;
    Quadric q = quadrics[a];
    q.add(quadrics[b]);
    const double allowed_surface = options.surface_error * options.surface_error;
    double cost = q.mean(merged_position(a, b)) / allowed_surface;
    const auto colour = colours[a].merged(colours[b]);
    cost += colour.squares / colour.count / (options.colour_error * options.colour_error);
    if (cost <= 1) queue.push(cost, {std::min(a, b), std::max(a, b), age[a] + age[b]});
}

// 1 for an equilateral triangle, 0 for one without area.
double roundness(const Vector3d& area_normal, const std::array<Vector3d, 3>& p) {
    const double sides = (p[1] - p[0]).squaredNorm() + (p[2] - p[1]).squaredNorm() + (p[0] - p[2]).squaredNorm();
    return sides > 0 ? 2 * std::sqrt(3.0) * area_normal.norm() / sides : 0;
}

// The area-weighted mean normal of the triangles around a vertex.
Vector3d Simplifier::facing(std::uint32_t v) const {
    Vector3d out = Vector3d::Zero();
    for_each_around(v, [&](std::uint32_t t) {
        const auto& [a, b, c] = triangles[t];
        out += area_normal(positions[a], positions[b], positions[c]);
    });
    return out;
}

// Whether the triangles around a vertex neither flip nor become slivers when it moves (those of the collapsed edge
// disappear). Triangles without area, as captures on a coarse grid have, must end up facing the way their neighbours
// do.
bool Simplifier::keeps_shape(std::uint32_t moving, std::uint32_t other, const Vector3d& to) const {
    constexpr double least_turn = 0.3, least_facing = 0.2, least_roundness = 0.3;
    const Vector3d around = facing(moving);
    const double around_size = around.norm();
    looked_at += fans[moving].size();
    for (const auto t : fans[moving]) {
        if (!triangle_lives[t]) continue;
        const auto& corners = triangles[t];
        if (std::find(corners.begin(), corners.end(), other) != corners.end()) continue;
        std::array<Vector3d, 3> before, after;
        for (std::size_t i = 0; i < 3; ++i) {
            before[i] = positions[corners[i]];
            after[i] = corners[i] == moving ? to : before[i];
        }
        const Vector3d was = area_normal(before[0], before[1], before[2]);
        const Vector3d is = area_normal(after[0], after[1], after[2]);
        const double was_size = was.norm(), is_size = is.norm();
        if (was.dot(is) < least_turn * was_size * is_size) return false;
        const bool faced = was_size > 0 && was.dot(around) >= least_facing * was_size * around_size;
        if ((faced || !(was_size > 0)) && is.dot(around) < least_facing * is_size * around_size) return false;
        const double round = roundness(is, after);
        if (round < least_roundness && round < roundness(was, before)) return false;
        if (options.longest_edge > 0)
            for (std::size_t i = 0; i < 3; ++i)
                if (corners[i] != moving && (after[i] - to).norm() > options.longest_edge) return false;
    }
    return true;
}

// The link condition (the common neighbours of both ends are exactly the corners opposite to the edge), and the shape.
bool Simplifier::allowed(std::uint32_t a, std::uint32_t b, const Vector3d& to) {
    // The ends may have become hubs since the edge was judged.
    if (valence(a) > most_around || valence(b) > most_around) return false;
    std::size_t shared_triangles = 0;
    for_each_around(a, [&](std::uint32_t t) {
        if (std::find(triangles[t].begin(), triangles[t].end(), b) != triangles[t].end()) ++shared_triangles;
    });
    if (shared_triangles < 1 || shared_triangles > 2) return false;
    neighbours(a, ring_a);
    neighbours(b, ring_b);
    std::size_t shared = 0;
    for (std::size_t i = 0, j = 0; i < ring_a.size() && j < ring_b.size();)
        if (ring_a[i] == ring_b[j])
            ++shared, ++i, ++j;
        else
            ring_a[i] < ring_b[j] ? ++i : ++j;
    // Collapsing an edge of a tetrahedron would leave two triangles on top of each other.
    if (shared != shared_triangles || ring_a.size() + ring_b.size() - shared <= 4) return false;
    return keeps_shape(a, b, to) && keeps_shape(b, a, to);
}

// Counts a dead triangle of v. Dead triangles are removed from the list once they are half of it, so that a hub that
// loses its triangles one by one is not scanned for each of them.
void Simplifier::bury(std::uint32_t v) {
    if (2 * ++dead[v] < fans[v].size()) return;
    looked_at += fans[v].size();
    std::erase_if(fans[v], [&](std::uint32_t t) { return !triangle_lives[t]; });
    dead[v] = 0;
}

void Simplifier::collapse(std::uint32_t keep, std::uint32_t drop, const Vector3d& to) {
    positions[keep] = to;
    quadrics[keep].add(quadrics[drop]);
    colours[keep] = colours[keep].merged(colours[drop]);
    lives[drop] = false;
    for_each_around(drop, [&](std::uint32_t t) {
        auto& corners = triangles[t];
        if (std::find(corners.begin(), corners.end(), keep) != corners.end()) {
            triangle_lives[t] = false;
            for (const auto v : corners)
                if (v != drop) bury(v);
            return;
        }
        std::replace(corners.begin(), corners.end(), drop, keep);
        fans[keep].push_back(t);
    });
    fans[drop].clear();
    dead[drop] = 0;
    ++age[keep];
    neighbours(keep, ring_a);
    for (const auto v : ring_a) judge(keep, v);
}

SimplifiedMesh compacted(const Simplifier& simplifier, bool coloured) {
    SimplifiedMesh out;
    out.looked_at = simplifier.looked_at;
    std::vector<std::uint32_t> number(simplifier.positions.size(), 0);
    for (std::size_t v = 0; v < number.size(); ++v) {
        if (!simplifier.lives[v]) continue;
        number[v] = static_cast<std::uint32_t>(out.positions.size());
        out.positions.push_back(simplifier.positions[v]);
        if (coloured) out.colours.push_back(simplifier.colours[v].mean);
    }
    for (std::size_t t = 0; t < simplifier.triangles.size(); ++t) {
        if (!simplifier.triangle_lives[t]) continue;
        const auto& corners = simplifier.triangles[t];
        out.triangles.push_back({number[corners[0]], number[corners[1]], number[corners[2]]});
    }
    return out;
}

}  // namespace

SimplifiedMesh simplify(std::span<const Vector3d> positions, std::span<const Triangle> triangles,
                        std::span<const Colour> colours, const SimplificationOptions& options) {
    Simplifier simplifier{.options = options,
                          .positions = {positions.begin(), positions.end()},
                          .triangles = {triangles.begin(), triangles.end()}};
    simplifier.prepare(colours);
    if (options.surface_error > 0) simplifier.add_borders();
    while (!simplifier.queue.empty()) {
        const auto next = simplifier.queue.pop();
        const auto a = next.keep, b = next.drop;
        if (!simplifier.lives[a] || !simplifier.lives[b] || simplifier.age[a] + simplifier.age[b] != next.age) continue;
        const auto to = simplifier.merged_position(a, b);
        if (simplifier.allowed(a, b, to)) simplifier.collapse(a, b, to);
    }
    return compacted(simplifier, !colours.empty());
}

}  // namespace htvm::internal
