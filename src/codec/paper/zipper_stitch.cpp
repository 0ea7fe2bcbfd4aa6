#include "codec/paper/zipper_stitch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>
#include <tuple>
#include <unordered_map>

namespace htvm::internal::zipping {
namespace {

constexpr double bridge_reach = 4, longest_stitch = 6;  // mean sides
constexpr int longest_filled = 64;                      // edges of a hole
constexpr std::size_t most_at_vertex = 64;              // edges that are looked at

std::uint64_t directed(std::uint32_t from, std::uint32_t to) { return std::uint64_t{from} << 32 | to; }

struct Edge {
    std::uint32_t from = 0, to = 0;
    std::uint32_t next = none, previous = none;
    bool open = true;
    Direction normal;
};

struct Corner {  // candidate triangle: edge, and the corner at the end of `arriving`
    double cost = 0;
    std::uint32_t edge = 0, arriving = 0;
    auto key() const { return std::tuple(cost, edge, arriving); }
    bool operator>(const Corner& other) const { return key() > other.key(); }
};

// Grows with the directions' angle, counter-clockwise about the normal from `from`: 0 .. 4.
double turn(Direction normal, Direction from, Direction to) {
    const Direction left = cross(normal, from), ahead = cross(left, normal);
    const double x = dot(to, ahead), y = dot(to, left);
    const double size = std::abs(x) + std::abs(y);
    if (!(size > 0)) return 0;
    return y >= 0 ? 1 - x / size : 3 + x / size;
}

Direction unit_vector(Direction v) {
    const double length = std::sqrt(dot(v, v));
    return length > 0 ? Direction{v.x / length, v.y / length, v.z / length} : Direction{};
}

// The borders of the gap while it closes: edges with the gap to their left, linked to loops or to open chains.
struct Front {
    std::span<const LatticePoint> positions;
    std::span<const Direction> normals;
    std::vector<Edge> edges;
    std::unordered_map<std::uint64_t, std::uint32_t> open;                   // open edges by their ends
    std::unordered_map<std::uint64_t, std::uint8_t> taken;                   // directed sides of triangles near the gap
    std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> arriving;  // edges by the vertex where they end
    std::vector<Triangle> made;

    Direction normal_at(std::uint32_t v) const { return unit_vector(normals[v]); }
    Direction towards(std::uint32_t a, std::uint32_t b) const { return direction(positions[a], positions[b]); }

    void link(std::uint32_t a, std::uint32_t b) {
        if (a != none) edges[a].next = b;
        if (b != none) edges[b].previous = a;
    }

    void add_border(const BorderSide& side) {
        const auto id = static_cast<std::uint32_t>(edges.size());
        edges.push_back({side.from, side.to, none, none, true, side.normal});
        open.emplace(directed(side.from, side.to), id);
        arriving[side.to].push_back(id);
    }

    // At each vertex, every arriving edge goes on along the first leaving one, clockwise: the narrowest gap.
    void link_borders() {
        std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> leaving;
        for (std::uint32_t e = 0; e < edges.size(); ++e) leaving[edges[e].from].push_back(e);
        for (std::uint32_t e = 0; e < edges.size(); ++e) {
            const std::uint32_t v = edges[e].to;
            const auto at = leaving.find(v);
            if (at == leaving.end()) continue;
            std::uint32_t best = none;
            double widest = -1;
            std::size_t looked_at = 0;
            for (const std::uint32_t f : at->second) {
                if (++looked_at > most_at_vertex) break;
                if (edges[f].previous != none) continue;
                const double angle =
                    at->second.size() == 1 ? 0 : turn(normal_at(v), towards(v, edges[e].from), towards(v, edges[f].to));
                if (angle > widest) {
                    widest = angle;
                    best = f;
                }
            }
            if (best != none) link(e, best);
        }
    }

    // Whether the direction to z lies in the gap at the vertex between two edges in a row.
    bool in_sector(std::uint32_t arrives, std::uint32_t leaves, std::uint32_t z) const {
        if (arrives == none || leaves == none) return true;
        const std::uint32_t v = edges[leaves].from, x = edges[arrives].from, y = edges[leaves].to;
        if (z == x || z == y) return true;
        const Direction normal = normal_at(v), first = towards(v, y);
        const double whole = turn(normal, first, towards(v, x)), part = turn(normal, first, towards(v, z));
        return whole == 0 || part <= whole;
    }

    // Whether the triangle on edge e with its third corner where `arrives` ends may be made.
    bool allowed(std::uint32_t e, std::uint32_t arrives) const {
        const Edge& edge = edges[e];
        const std::uint32_t a = edge.from, b = edge.to, c = edges[arrives].to;
        if (a == c || b == c || taken.contains(directed(a, b)) || taken.contains(directed(b, c)) ||
            taken.contains(directed(c, a)))
            return false;
        return true;
    }
    bool well_shaped(std::uint32_t e, std::uint32_t arrives) const {
        const Edge& edge = edges[e];
        const std::uint32_t a = edge.from, b = edge.to, c = edges[arrives].to;
        const Direction normal = cross(towards(a, b), towards(a, c));
        if (!(dot(normal, edge.normal) > 0) || !(dot(normal, normals[a]) > 0) || !(dot(normal, normals[b]) > 0) ||
            !(dot(normal, normals[c]) > 0))
            return false;
        const std::uint32_t leaves = edges[arrives].next;
        return in_sector(edge.previous, e, c) && in_sector(e, edge.next, c) && in_sector(arrives, leaves, a) &&
               in_sector(arrives, leaves, b);
    }

    void close(std::uint32_t e) {
        edges[e].open = false;
        open.erase(directed(edges[e].from, edges[e].to));
    }

    std::uint32_t open_edge(std::uint32_t from, std::uint32_t to, Direction normal) {
        const auto id = static_cast<std::uint32_t>(edges.size());
        edges.push_back({from, to, none, none, true, normal});
        return id;
    }

    // A new edge that meets an old one closes with it.
    void settle(std::uint32_t e) {
        const std::uint32_t from = edges[e].from, to = edges[e].to;
        const auto other = open.find(directed(to, from));
        if (other != open.end()) {
            const std::uint32_t o = other->second;
            const std::uint32_t before = edges[e].previous, after = edges[e].next;
            const std::uint32_t other_before = edges[o].previous, other_after = edges[o].next;
            if (before != o) link(before, other_after);
            if (other_before != e) link(other_before, after);
            close(o);
            edges[e].open = false;
        } else if (taken.contains(directed(from, to))) {
            if (edges[e].previous != none) edges[edges[e].previous].next = none;
            if (edges[e].next != none) edges[edges[e].next].previous = none;
            edges[e].open = false;
        } else {
            open.emplace(directed(from, to), e);
            arriving[to].push_back(e);
        }
    }

    // Gives the two new edges, open or not.
    std::array<std::uint32_t, 2> add_triangle(std::uint32_t e, std::uint32_t arrives) {
        const std::uint32_t a = edges[e].from, b = edges[e].to, c = edges[arrives].to;
        const std::uint32_t before = edges[e].previous, after = edges[e].next, leaves = edges[arrives].next;
        made.push_back({a, b, c});
        taken[directed(a, b)] = taken[directed(b, c)] = taken[directed(c, a)] = 1;
        const Direction normal = cross(towards(a, b), towards(a, c));
        close(e);
        const std::uint32_t first = open_edge(a, c, normal), second = open_edge(c, b, normal);
        link(before, first);
        link(first, leaves);
        link(arrives, second);
        link(second, after);
        settle(second);
        settle(first);
        return {first, second};
    }
};

using Queue = std::priority_queue<Corner, std::vector<Corner>, std::greater<>>;

struct Zip {
    Front& front;
    const Gap& gap;
    bool both_sides = true;  // a stitch has vertices of both meshes
    double longest = 0;      // squared, of new edges
    bool shaped = true;
    Queue queue;

    void push(std::uint32_t e) {
        if (e == none || !front.edges[e].open) return;
        const std::uint32_t n = front.edges[e].next;
        if (n == none) return;
        const std::uint32_t a = front.edges[e].from, b = front.edges[e].to, c = front.edges[n].to;
        const bool coded_a = a < gap.coded_vertices, coded_b = b < gap.coded_vertices, coded_c = c < gap.coded_vertices;
        if (both_sides && coded_a == coded_b && coded_b == coded_c) return;
        const double cost = static_cast<double>(squared_distance(gap.positions[a], gap.positions[c]));
        if (cost <= longest) queue.push({cost, e, n});
    }
    // The corners that a change at an edge may open or close.
    void push_around(std::uint32_t e) {
        if (e == none || !front.edges[e].open) return;
        const std::uint32_t before = front.edges[e].previous;
        if (before != none) push(front.edges[before].previous);
        push(before);
        push(e);
        push(front.edges[e].next);
    }
    void add(std::uint32_t e, std::uint32_t arrives) {
        const std::uint32_t before = front.edges[e].previous, after = front.edges[arrives].next;
        const auto [first, second] = front.add_triangle(e, arrives);
        for (const std::uint32_t changed : {before, first, second, after}) push_around(changed);
    }
    void run() {
        while (!queue.empty()) {
            const Corner corner = queue.top();
            queue.pop();
            const std::uint32_t e = corner.edge;
            if (!front.edges[e].open || front.edges[e].next != corner.arriving) continue;
            if (!front.allowed(e, corner.arriving) || (shaped && !front.well_shaped(e, corner.arriving))) continue;
            add(e, corner.arriving);
        }
    }
};

// The vertices of the animated border nearest to each coded edge, by length.
std::vector<std::pair<double, std::array<std::uint32_t, 2>>> bridges(const Gap& gap, const Front& front) {
    const SurfaceGrid grid(gap.positions, gap.around, gap.cut, static_cast<std::int64_t>(bridge_reach * gap.unit) + 1);
    std::vector<std::pair<double, std::array<std::uint32_t, 2>>> out;
    for (std::uint32_t e = 0; e < gap.coded.size(); ++e) {
        const LatticePoint a = gap.positions[gap.coded[e].from], b = gap.positions[gap.coded[e].to];
        const LatticePoint middle = {static_cast<std::int32_t>(divide_rounded(a.x + b.x, 2)),
                                     static_cast<std::int32_t>(divide_rounded(a.y + b.y, 2)),
                                     static_cast<std::int32_t>(divide_rounded(a.z + b.z, 2))};
        const SurfacePoint at = grid.nearest(middle, gap.coded[e].normal);
        if (at.triangle == none) continue;
        for (const std::uint32_t c : gap.around[at.triangle]) {
            if (!front.arriving.contains(c)) continue;
            const double cost = static_cast<double>(
                std::max(squared_distance(gap.positions[c], a), squared_distance(gap.positions[c], b)));
            out.push_back({cost, {e, c}});
        }
    }
    std::sort(out.begin(), out.end());
    return out;
}

void zip(const Gap& gap, Front& front) {
    Zip zipper{front, gap, true, longest_stitch * gap.unit * (longest_stitch * gap.unit), true, {}};
    for (const auto& [cost, bridge] : bridges(gap, front)) {
        const auto [e, c] = bridge;
        if (!front.edges[e].open || cost > zipper.longest) continue;
        const std::vector<std::uint32_t>& ends = front.arriving[c];
        std::uint32_t found = none;
        for (std::size_t i = 0; i < ends.size() && i < most_at_vertex && found == none; ++i)
            if (front.edges[ends[i]].open && front.allowed(e, ends[i]) && front.well_shaped(e, ends[i]))
                found = ends[i];
        if (found == none) continue;
        zipper.add(e, found);
        zipper.run();
    }
}

// Closes loops of at most longest_filled edges.
void fill(const Gap& gap, Front& front, bool shaped) {
    Zip filler{front, gap, false, 1e18, shaped, {}};
    std::vector<std::uint8_t> seen(front.edges.size());
    for (std::uint32_t e = 0; e < seen.size(); ++e) {
        if (!front.edges[e].open || seen[e]) continue;
        int length = 0;
        std::uint32_t at = e;
        do {
            seen[at] = 1;
            ++length;
            at = front.edges[at].next;
        } while (at != none && at != e && !seen[at]);
        if (at != e || length > longest_filled) continue;
        do {
            filler.push(at);
            at = front.edges[at].next;
        } while (at != e);
    }
    filler.run();
}

}  // namespace

std::vector<Triangle> stitch(const Gap& gap) {
    Front front;
    front.positions = gap.positions;
    front.normals = gap.normals;
    for (const BorderSide& side : gap.coded) front.add_border(side);
    for (const BorderSide& side : gap.animated) front.add_border(side);
    for (const Triangle& t : gap.around)
        for (std::size_t i = 0; i < 3; ++i) front.taken[directed(t[i], t[(i + 1) % 3])] = 1;
    front.link_borders();
    zip(gap, front);
    fill(gap, front, true);
    fill(gap, front, false);
    return front.made;
}

}  // namespace htvm::internal::zipping
