#include "surface/simplification.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <mutex>
#include <tuple>
#include <utility>

#include "core/lattice.h"
#include "core/parallel.h"

namespace htvm::internal {
namespace {

using Eigen::Vector3d;

// Sum of squared distances to planes, weighted by area: x'Ax + 2b'x + c, of a symmetric A.
struct Quadric {
    double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
    Vector3d b = Vector3d::Zero();
    double c = 0, weight = 0;

    // normal: of any length; weight: of the plane.
    void add_plane(const Vector3d& normal, const Vector3d& point, double of_plane) {
        const double scale = of_plane / normal.squaredNorm(), d = -normal.dot(point);
        const Vector3d n = scale * normal;
        xx += n.x() * normal.x();
        xy += n.x() * normal.y();
        xz += n.x() * normal.z();
        yy += n.y() * normal.y();
        yz += n.y() * normal.z();
        zz += n.z() * normal.z();
        b += d * n;
        c += scale * d * d;
        weight += of_plane;
    }
    void add(const Quadric& other) {
        xx += other.xx;
        xy += other.xy;
        xz += other.xz;
        yy += other.yy;
        yz += other.yz;
        zz += other.zz;
        b += other.b;
        c += other.c;
        weight += other.weight;
    }
};

// Where a merged vertex goes, and its mean squared distance to the planes that it then stands for.
struct Merged {
    Vector3d position;
    double squared_distance;
};

// Where the merged vertex has the least error; on a flat surface, where all points are equal, the midpoint. Written out
// by components, as it is what most of the time goes into.
Merged merged(const Quadric& p, const Quadric& q, const Vector3d& at_p, const Vector3d& at_q) {
    constexpr double towards_middle = 1e-2;
    const double mx = (at_p.x() + at_q.x()) / 2, my = (at_p.y() + at_q.y()) / 2, mz = (at_p.z() + at_q.z()) / 2;
    const double weight = p.weight + q.weight;
    if (!(weight > 0)) return {{mx, my, mz}, 0};
    const double xx = p.xx + q.xx, xy = p.xy + q.xy, xz = p.xz + q.xz;
    const double yy = p.yy + q.yy, yz = p.yz + q.yz, zz = p.zz + q.zz;
    const double bx = p.b.x() + q.b.x(), by = p.b.y() + q.b.y(), bz = p.b.z() + q.b.z();
    // (A + pull) x = pull * middle - b, by cofactors; not finite where there is no solution.
    const double pull = towards_middle * weight;
    const double a00 = xx + pull, a11 = yy + pull, a22 = zz + pull;
    const double c00 = a11 * a22 - yz * yz, c01 = xz * yz - xy * a22, c02 = xy * yz - xz * a11;
    const double c11 = a00 * a22 - xz * xz, c12 = xy * xz - a00 * yz, c22 = a00 * a11 - xy * xy;
    const double inverse = 1 / (a00 * c00 + xy * c01 + xz * c02);
    const double rx = pull * mx - bx, ry = pull * my - by, rz = pull * mz - bz;
    double x = (c00 * rx + c01 * ry + c02 * rz) * inverse;
    double y = (c01 * rx + c11 * ry + c12 * rz) * inverse;
    double z = (c02 * rx + c12 * ry + c22 * rz) * inverse;
    const double moved = (x - mx) * (x - mx) + (y - my) * (y - my) + (z - mz) * (z - mz);
    if (!(moved <= (at_p - at_q).squaredNorm())) x = mx, y = my, z = mz;
    const double squares = x * (xx * x + xy * y + xz * z + 2 * bx) + y * (xy * x + yy * y + yz * z + 2 * by) +
                           z * (xz * x + yz * y + zz * z + 2 * bz) + p.c + q.c;
    return {{x, y, z}, std::max(0.0, squares) / weight};
}

// The colours that a vertex stands for.
struct ColourCluster {
    double count = 1;
    std::array<double, 3> mean{};
    double squares = 0;  // sum of squared distances from their mean

    double merged_squares(const ColourCluster& other) const {
        double between = 0;
        for (std::size_t i = 0; i < 3; ++i) between += (other.mean[i] - mean[i]) * (other.mean[i] - mean[i]);
        return squares + other.squares + between * count * other.count / (count + other.count);
    }
    void add(const ColourCluster& other) {
        squares = merged_squares(other);
        const double share = other.count / (count + other.count);
        for (std::size_t i = 0; i < 3; ++i) mean[i] += (other.mean[i] - mean[i]) * share;
        count += other.count;
    }
};

struct Collapse {
    std::uint32_t keep = 0, drop = 0;
    std::uint32_t age = 0;  // sum of the ages of both ends when the edge was judged
};

// Cheapest first, to within a hundredth; of those that cost the same, what came first. Most collapses that wait are
// overtaken by others around them, so a queue that sorts them exactly would take more time than all else: here each
// waits in a bucket by the leading bits of its cost. Buckets are lists through one array, in which places come free.
class CollapseQueue {
public:
    bool empty() const { return size_ == 0; }
    void push(double cost, const Collapse& collapse) {  // cost: 0 to 1
        const std::size_t bucket = bucket_of(cost);
        const std::uint32_t place = free_ == none ? static_cast<std::uint32_t>(waiting_.size()) : free_;
        if (free_ == none)
            waiting_.emplace_back();
        else
            free_ = waiting_[place].next;
        waiting_[place] = {collapse, none};
        auto& [first, last] = buckets_[bucket];
        (first == none ? first : waiting_[last].next) = place;
        last = place;
        lowest_ = std::min(lowest_, bucket);
        ++size_;
    }
    Collapse pop() {
        while (buckets_[lowest_].first == none) ++lowest_;
        --size_;
        const auto place = buckets_[lowest_].first;
        auto& waiting = waiting_[place];
        buckets_[lowest_].first = waiting.next;
        waiting.next = free_;
        free_ = place;
        return waiting.collapse;
    }

private:
    static constexpr std::uint32_t none = ~std::uint32_t{0};
    static constexpr int mantissa_bits = 7, exponents = 24;  // what costs less than 2^-24 is one bucket
    static std::size_t bucket_of(double cost) {
        constexpr double cheapest = 1.0 / (1 << exponents);
        const auto bits = std::bit_cast<std::uint64_t>(std::max(cost, cheapest));
        constexpr auto least = std::bit_cast<std::uint64_t>(1.0) >> (52 - mantissa_bits);
        return (bits >> (52 - mantissa_bits)) - (least - (std::uint64_t{exponents} << mantissa_bits));
    }
    struct Waiting {
        Collapse collapse;
        std::uint32_t next = none;
    };
    struct Bucket {
        std::uint32_t first = none, last = none;
    };
    std::vector<Waiting> waiting_;
    std::vector<Bucket> buckets_ = std::vector<Bucket>((std::size_t{exponents} << mantissa_bits) + 1);
    std::uint32_t free_ = none;
    std::size_t lowest_ = 0, size_ = 0;
};

// The triangles around a vertex. Dead ones among them are left out when they are next looked at.
struct Fan {
    std::uint32_t* triangles = nullptr;
    std::uint32_t size = 0, room = 0;
    std::uint32_t live = 0;  // of `size`
};

// Where fans that grow lie. What was given out stays until all is given back.
class FanMemory {
public:
    std::uint32_t* take(std::size_t size) {
        constexpr std::size_t usual = 1 << 14;
        if (left_ < size) {
            left_ = std::max(size, usual);
            chunks_.push_back(std::make_unique<std::uint32_t[]>(left_));
            next_ = chunks_.back().get();
        }
        left_ -= size;
        return std::exchange(next_, next_ + size);
    }

private:
    std::vector<std::unique_ptr<std::uint32_t[]>> chunks_;
    std::uint32_t* next_ = nullptr;
    std::size_t left_ = 0;
};

constexpr std::uint32_t dead = ~std::uint32_t{0};  // the first corner of a dead triangle
constexpr std::uint32_t dropped = 1 << 30;         // the age of a vertex that is gone; two of them are no age of others

// A mesh that is being simplified.
struct Work {
    const SimplificationOptions& options;
    std::vector<Vector3d> positions{};
    std::vector<Triangle> triangles{};
    std::vector<std::uint32_t> incident{};  // triangles around each vertex, as they are at first
    std::vector<Fan> fans{};
    std::vector<Quadric> quadrics{};
    std::vector<ColourCluster> colours{};
    std::vector<std::uint32_t> ages{};
    std::vector<std::uint32_t> marks{};  // what a walk around a vertex has met
    std::vector<std::uint8_t> regions{};
    std::vector<float> finer{};  // as SimplificationOptions::finer, or none
};

Vector3d area_normal(const Vector3d& a, const Vector3d& b, const Vector3d& c) { return (b - a).cross(c - a); }

Vector3d normal_of(const Work& work, std::uint32_t t) {
    const auto& [a, b, c] = work.triangles[t];
    return area_normal(work.positions[a], work.positions[b], work.positions[c]);
}

void find_fans(Work& work) {
    auto& fans = work.fans;
    fans.resize(work.positions.size());
    std::size_t corners = 0;
    for (auto& triangle : work.triangles) {
        const auto [a, b, c] = triangle;
        if (a == b || b == c || a == c) {
            triangle[0] = dead;
            continue;
        }
        for (const auto v : triangle) ++fans[v].room;
        corners += 3;
    }
    work.incident.resize(corners);
    auto* next = work.incident.data();
    for (auto& fan : fans) {
        fan.triangles = next;
        next += fan.room;
    }
    for (std::uint32_t t = 0; t < work.triangles.size(); ++t)
        if (work.triangles[t][0] != dead)
            for (const auto v : work.triangles[t]) fans[v].triangles[fans[v].size++] = t;
    for (auto& fan : fans) fan.live = fan.size;
}

// An edge of one triangle, or of more than two, is a border.
struct Border {
    std::uint32_t from, to, triangle;
};

// Adds those of edges from v to higher vertices. sides: for reuse.
void find_borders(const Work& work, std::uint32_t v, std::vector<std::uint64_t>& sides, std::vector<Border>& borders) {
    sides.clear();  // the other end of the edge, and the triangle
    const auto& fan = work.fans[v];
    for (std::uint32_t i = 0; i < fan.size; ++i)
        for (const auto corner : work.triangles[fan.triangles[i]])
            if (corner > v) sides.push_back(std::uint64_t{corner} << 32 | fan.triangles[i]);
    std::sort(sides.begin(), sides.end());
    for (std::size_t i = 0, j = 0; i < sides.size(); i = j) {
        const auto other = static_cast<std::uint32_t>(sides[i] >> 32);
        for (j = i + 1; j < sides.size() && sides[j] >> 32 == other; ++j) {
        }
        for (std::size_t s = i; j - i != 2 && s < j; ++s)
            borders.push_back({v, other, static_cast<std::uint32_t>(sides[s])});
    }
}

void find_quadrics(Work& work) {
    constexpr std::size_t triangles_at_once = 4096, vertices_at_once = 1024;
    const auto& threads = work.options.threads;
    std::vector<Vector3d> normals(work.triangles.size());
    parallel_for(normals.size(), threads, triangles_at_once, [&](std::size_t begin, std::size_t end) {
        for (auto t = static_cast<std::uint32_t>(begin); t < end; ++t)
            if (work.triangles[t][0] != dead) normals[t] = normal_of(work, t);
    });
    std::mutex found;
    std::vector<Border> borders;
    parallel_for(work.fans.size(), threads, vertices_at_once, [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint64_t> sides;
        std::vector<Border> own;
        for (auto v = static_cast<std::uint32_t>(begin); v < end; ++v) {
            const auto& fan = work.fans[v];
            for (std::uint32_t i = 0; i < fan.size; ++i) {
                const auto& normal = normals[fan.triangles[i]];
                const double length = normal.norm();
                if (length > 0) work.quadrics[v].add_plane(normal, work.positions[v], length / 2);
            }
            find_borders(work, v, sides, own);
        }
        const std::lock_guard lock(found);
        borders.insert(borders.end(), own.begin(), own.end());
    });
    // In an order that does not depend on which thread was faster.
    std::sort(borders.begin(), borders.end(), [](const Border& x, const Border& y) {
        return std::tie(x.from, x.to, x.triangle) < std::tie(y.from, y.to, y.triangle);
    });
    // A plane perpendicular to the triangle keeps the border in place.
    for (const auto& [a, b, t] : borders) {
        const Vector3d edge = work.positions[b] - work.positions[a];
        const Vector3d across = edge.cross(normals[t]);
        if (!(across.squaredNorm() > 0)) continue;
        for (const auto v : {a, b}) work.quadrics[v].add_plane(across, work.positions[a], edge.squaredNorm());
    }
}

// ---- Regions --------------------------------------------------------------------------------------------------------

// Collapses go one after the other, but what happens at a foot does not depend on what happens at the head. So large
// meshes are cut into regions across their longest extent, whose collapses go on side by side; the larger the mesh, the
// more, since the cheapest collapse may be anywhere in a region, and where its vertices do not fit in a cache, each
// waits for memory. Where vertices have neighbours in another region, at the rim, nothing is touched until all regions
// are done. A collapse reads and writes its ends, their neighbours and their triangles; neighbours of a vertex that is
// not at the rim are in its region, and so no two regions touch the same.
constexpr std::uint8_t rim = 255;

// Returns how many there are: small meshes are one, and no vertex of theirs is at the rim.
std::uint8_t find_regions(Work& work) {
    constexpr std::size_t least_regions = 4, most_regions = 64;
    constexpr std::size_t least_of_region = 2048;  // vertices: with fewer each, the rims are too much of the whole
    constexpr std::size_t most_of_region = 16384;
    const auto& positions = work.positions;
    const auto vertices = positions.size();
    work.regions.assign(vertices, 0);
    if (vertices < least_regions * least_of_region) return 1;
    const auto regions = std::clamp(vertices / most_of_region, least_regions, most_regions);
    Vector3d low = positions[0], high = positions[0];
    for (const auto& p : positions) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    Eigen::Index axis = 0;
    (high - low).maxCoeff(&axis);
    std::vector<double> along;
    along.reserve(vertices);
    for (const auto& p : positions) along.push_back(p[axis]);
    std::vector<double> cuts;
    auto from = along.begin();
    for (std::size_t r = 1; r < regions; ++r) {
        const auto middle = along.begin() + static_cast<std::ptrdiff_t>(vertices * r / regions);
        std::nth_element(from, middle, along.end());
        cuts.push_back(*middle);
        from = middle;
    }
    for (std::size_t v = 0; v < vertices; ++v)
        work.regions[v] =
            static_cast<std::uint8_t>(std::upper_bound(cuts.begin(), cuts.end(), positions[v][axis]) - cuts.begin());
    std::vector<std::uint8_t> at_rim(vertices, 0);
    for (const auto& [a, b, c] : work.triangles) {
        if (a == dead || (work.regions[a] == work.regions[b] && work.regions[b] == work.regions[c])) continue;
        at_rim[a] = at_rim[b] = at_rim[c] = 1;
    }
    for (std::size_t v = 0; v < vertices; ++v)
        if (at_rim[v]) work.regions[v] = rim;
    return static_cast<std::uint8_t>(regions);
}

// ---- Collapses ------------------------------------------------------------------------------------------------------

// A collapse at a vertex examines all its triangles, and so does every attempt. At a hub of thousands of triangles this
// would take time in proportion to the square of their number. So hubs stay where they are; everything around them can
// still be collapsed.
constexpr std::size_t most_around = 256;

// The sum of a triangle's squared sides; for an equilateral one 2 sqrt(3) times the size of its area normal.
double squared_sides(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    return (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
}

// The collapses of one region, or of all that is left.
struct Simplifier {
    Work& work;
    std::uint8_t region = 0;
    bool everywhere = false;
    std::uint32_t mark = 0;  // the last one in Work::marks
    CollapseQueue queue{};
    FanMemory memory{};
    std::vector<std::uint32_t> ring{};  // reused between calls, as the next
    std::vector<Vector3d> normals{};
    std::uint64_t looked_at = 0;  // triangles

    bool may_move(std::uint32_t v) const { return everywhere || work.regions[v] == region; }
    std::span<const std::uint32_t> around(std::uint32_t v);
    void find_ring(std::uint32_t v);
    Merged merged(std::uint32_t a, std::uint32_t b) const {
        return internal::merged(work.quadrics[a], work.quadrics[b], work.positions[a], work.positions[b]);
    }
    void judge(std::uint32_t a, std::uint32_t b);
    bool is_linked_well(std::uint32_t a, std::uint32_t b);
    bool keeps_shape(std::uint32_t moving, std::uint32_t other, const Vector3d& to);
    void collapse(std::uint32_t keep, std::uint32_t drop, const Vector3d& to);
    void judge_all();
    void run();
};

// The live triangles around a vertex.
std::span<const std::uint32_t> Simplifier::around(std::uint32_t v) {
    auto& fan = work.fans[v];
    looked_at += fan.size;
    if (fan.size != fan.live) {
        std::uint32_t kept = 0;
        for (std::uint32_t i = 0; i < fan.size; ++i)
            if (work.triangles[fan.triangles[i]][0] != dead) fan.triangles[kept++] = fan.triangles[i];
        fan.size = kept;
    }
    return {fan.triangles, fan.size};
}

// The neighbours of v.
void Simplifier::find_ring(std::uint32_t v) {
    ring.clear();
    ++mark;
    for (const auto t : around(v))
        for (const auto corner : work.triangles[t])
            if (corner != v && std::exchange(work.marks[corner], mark) != mark) ring.push_back(corner);
}

void Simplifier::judge(std::uint32_t a, std::uint32_t b) {
    const auto& options = work.options;
    if (!may_move(a) || !may_move(b)) return;
    if (work.fans[a].live > most_around || work.fans[b].live > most_around) return;
    const double longest = options.longest_edge;
    if (longest > 0 && (work.positions[a] - work.positions[b]).squaredNorm() > longest * longest) return;
    const auto &colour_a = work.colours[a], &colour_b = work.colours[b];
    double cost = colour_a.merged_squares(colour_b) / (colour_a.count + colour_b.count) /
                  (options.colour_error * options.colour_error);
    if (!(cost <= 1)) return;
    const double finer = work.finer.empty() ? 1 : static_cast<double>(std::max(work.finer[a], work.finer[b]));
    cost += merged(a, b).squared_distance * finer * finer / (options.surface_error * options.surface_error);
    if (cost <= 1) queue.push(cost, {std::min(a, b), std::max(a, b), work.ages[a] + work.ages[b]});
}

// The link condition: the common neighbours of both ends are exactly the corners opposite to the edge. And, where asked
// for, these keep a triangle.
bool Simplifier::is_linked_well(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t of_a = mark + 1, of_b = mark + 2;
    mark += 2;
    std::size_t shared_triangles = 0, shared = 0, neighbours = 0;
    for (const auto t : around(a)) {
        const auto& corners = work.triangles[t];
        const bool is_shared = std::find(corners.begin(), corners.end(), b) != corners.end();
        if (is_shared) ++shared_triangles;
        for (const auto corner : corners) {
            if (corner == a) continue;
            if (is_shared && corner != b && work.options.keep_tips && work.fans[corner].live == 1) return false;
            if (std::exchange(work.marks[corner], of_a) != of_a) ++neighbours;
        }
    }
    if (shared_triangles < 1 || shared_triangles > 2) return false;
    for (const auto t : around(b))
        for (const auto corner : work.triangles[t]) {
            if (corner == b) continue;
            const auto before = std::exchange(work.marks[corner], of_b);
            if (before == of_a) ++shared;
            if (before != of_a && before != of_b) ++neighbours;
        }
    // Collapsing an edge of a tetrahedron would leave two triangles on top of each other.
    return shared == shared_triangles && neighbours > 4;
}

// Whether the triangles around a vertex neither flip nor become slivers when it moves (those of the collapsed edge
// disappear). Triangles without area, as captures on a coarse grid have, must end up facing the way their neighbours
// do.
bool Simplifier::keeps_shape(std::uint32_t moving, std::uint32_t other, const Vector3d& to) {
    constexpr double least_turn = 0.3, least_facing = 0.2, least_roundness = 0.3;
    const double full = 2 * std::sqrt(3.0);
    const auto& positions = work.positions;
    const double longest = work.options.longest_edge;
    const auto fan = around(moving);
    normals.clear();
    Vector3d facing = Vector3d::Zero();  // the area-weighted mean normal
    for (const auto t : fan) {
        normals.push_back(normal_of(work, t));
        facing += normals.back();
    }
    const double facing_size = facing.norm();
    for (std::size_t i = 0; i < fan.size(); ++i) {
        const auto [a, b, c] = work.triangles[fan[i]];
        if (a == other || b == other || c == other) continue;
        const auto &before_a = positions[a], &before_b = positions[b], &before_c = positions[c];
        const auto &after_a = a == moving ? to : before_a, &after_b = b == moving ? to : before_b,
                   &after_c = c == moving ? to : before_c;
        const auto& was = normals[i];
        const Vector3d is = area_normal(after_a, after_b, after_c);
        const double was_size = was.norm(), is_size = is.norm();
        if (was.dot(is) < least_turn * was_size * is_size) return false;
        const bool faced = was_size > 0 && was.dot(facing) >= least_facing * was_size * facing_size;
        if ((faced || !(was_size > 0)) && is.dot(facing) < least_facing * is_size * facing_size) return false;
        // Roundness is 1 for an equilateral triangle, 0 for one without area.
        const double sides = squared_sides(after_a, after_b, after_c);
        if (full * is_size < least_roundness * sides &&
            is_size * squared_sides(before_a, before_b, before_c) < was_size * sides)
            return false;
        if (longest > 0)
            for (const auto* p : {&after_a, &after_b, &after_c})
                if ((*p - to).squaredNorm() > longest * longest) return false;
    }
    return true;
}

void Simplifier::collapse(std::uint32_t keep, std::uint32_t drop, const Vector3d& to) {
    work.positions[keep] = to;
    work.quadrics[keep].add(work.quadrics[drop]);
    work.colours[keep].add(work.colours[drop]);
    if (!work.finer.empty()) work.finer[keep] = std::max(work.finer[keep], work.finer[drop]);
    work.ages[drop] = dropped;
    ++work.ages[keep];
    ring.clear();  // the triangles that keep takes over
    for (const auto t : around(drop)) {
        auto& corners = work.triangles[t];
        if (std::find(corners.begin(), corners.end(), keep) == corners.end()) {
            std::replace(corners.begin(), corners.end(), drop, keep);
            ring.push_back(t);
            continue;
        }
        for (const auto v : corners)
            if (--work.fans[v].live == 0 && v != keep && v != drop) work.ages[v] = dropped;
        corners[0] = dead;
    }
    work.fans[drop] = {};
    const auto kept = around(keep);
    auto& fan = work.fans[keep];
    const auto size = static_cast<std::uint32_t>(kept.size() + ring.size());
    if (size > fan.room) {
        fan.room = 2 * size;
        fan.triangles = std::copy(kept.begin(), kept.end(), memory.take(fan.room)) - kept.size();
    }
    std::copy(ring.begin(), ring.end(), fan.triangles + fan.size);
    fan.size = fan.live = size;
    find_ring(keep);
    for (const auto v : ring) judge(keep, v);
}

// Judges all edges that may be collapsed, but those of which a region has judged all.
void Simplifier::judge_all() {
    for (std::uint32_t v = 0; v < work.positions.size(); ++v) {
        if (work.regions[v] != region || work.ages[v] >= dropped) continue;
        find_ring(v);
        for (const auto other : ring)
            if (other > v || work.regions[other] != region) judge(std::min(v, other), std::max(v, other));
    }
}

void Simplifier::run() {
    judge_all();
    while (!queue.empty()) {
        const auto [a, b, age] = queue.pop();
        if (work.ages[a] + work.ages[b] != age) continue;
        // The ends may have become hubs since the edge was judged.
        if (work.fans[a].live > most_around || work.fans[b].live > most_around || !is_linked_well(a, b)) continue;
        const Vector3d to = merged(a, b).position;
        if (keeps_shape(a, b, to) && keeps_shape(b, a, to)) collapse(a, b, to);
    }
}

SimplifiedMesh compacted(const Work& work, bool coloured) {
    SimplifiedMesh out;
    std::vector<std::uint32_t> number(work.positions.size(), 0);
    for (std::size_t v = 0; v < number.size(); ++v) {
        if (work.ages[v] >= dropped) continue;
        number[v] = static_cast<std::uint32_t>(out.positions.size());
        out.positions.push_back(work.positions[v]);
        if (coloured) out.colours.push_back(work.colours[v].mean);
    }
    for (const auto& [a, b, c] : work.triangles)
        if (a != dead) out.triangles.push_back({number[a], number[b], number[c]});
    return out;
}

}  // namespace

SimplifiedMesh simplify(std::span<const Vector3d> positions, std::span<const Triangle> triangles,
                        std::span<const Colour> colours, const SimplificationOptions& options) {
    Work work{.options = options,
              .positions = {positions.begin(), positions.end()},
              .triangles = {triangles.begin(), triangles.end()}};
    const auto vertices = positions.size();
    work.ages.assign(vertices, 0);
    work.finer.assign(options.finer.begin(), options.finer.end());
    work.colours.resize(vertices);
    for (std::size_t v = 0; v < colours.size(); ++v)
        for (std::size_t c = 0; c < 3; ++c) work.colours[v].mean[c] = colours[v][c];
    find_fans(work);
    if (!(options.surface_error > 0)) return compacted(work, !colours.empty());
    work.quadrics.resize(vertices);
    work.marks.assign(vertices, 0);
    find_quadrics(work);
    const auto regions = find_regions(work);
    std::vector<Simplifier> simplifiers;
    for (std::uint8_t r = 0; r < regions; ++r) simplifiers.push_back({.work = work, .region = r});
    parallel_for(regions, options.threads, 1, [&](std::size_t begin, std::size_t end) {
        for (auto r = begin; r < end; ++r) simplifiers[r].run();
    });
    if (regions > 1) {
        Simplifier rest{.work = work, .region = rim, .everywhere = true};
        for (const auto& simplifier : simplifiers) rest.mark = std::max(rest.mark, simplifier.mark);
        rest.run();
        simplifiers.push_back(std::move(rest));
    }
    auto out = compacted(work, !colours.empty());
    for (const auto& simplifier : simplifiers) out.looked_at += simplifier.looked_at;
    return out;
}

LatticeMesh simplified_mesh(const LatticeMesh& mesh, const SimplificationOptions& options) {
    std::vector<Vector3d> points;
    points.reserve(mesh.positions.size());
    for (const auto p : mesh.positions) points.emplace_back(p.x, p.y, p.z);
    auto simple = simplify(points, mesh.triangles, mesh.colours, options);
    LatticeMesh out;
    const auto whole = [](double c) { return within_lattice(std::llround(c)); };
    for (const auto& p : simple.positions) out.positions.push_back({whole(p.x()), whole(p.y()), whole(p.z())});
    out.triangles = std::move(simple.triangles);
    const auto level = [](double c) { return static_cast<std::uint8_t>(std::lround(std::clamp(c, 0.0, 255.0))); };
    for (const auto& c : simple.colours) out.colours.push_back({level(c[0]), level(c[1]), level(c[2])});
    return out;
}

}  // namespace htvm::internal
