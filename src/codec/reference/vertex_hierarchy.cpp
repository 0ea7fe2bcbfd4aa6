#include "codec/reference/vertex_hierarchy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "core/geometry.h"

namespace htvm::internal {

namespace {

constexpr std::size_t most_elements = std::size_t{1} << 28;

// Where a node is, the mean of the vertices below it, and behind it their number: what is read together lies together.
using Place = std::array<double, 4>;
Vector3d centre_of(const Place& place) { return {place[0], place[1], place[2]}; }

// The nodes of one level, from which the next coarser level is built.
struct Layer {
    std::vector<std::uint32_t> vertices;  // number of vertices below each node
    std::vector<Place> place;
    std::vector<std::uint32_t> first_neighbour, neighbours;
    bool mutual = true;  // as HierarchyLevel's

    std::size_t size() const { return vertices.size(); }
    std::span<const std::uint32_t> around(std::size_t node) const {
        return std::span(neighbours).subspan(first_neighbour[node], first_neighbour[node + 1] - first_neighbour[node]);
    }
};

Layer layer_of_vertices(std::span<const LatticePoint> positions, VerticesAround around) {
    Layer layer;
    layer.vertices.assign(positions.size(), 1);
    layer.place.reserve(positions.size());
    for (const LatticePoint p : positions)
        layer.place.push_back({static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z), 1.0});
    layer.first_neighbour = std::move(around.first);
    layer.neighbours = std::move(around.vertices);
    return layer;
}

// Interleaves the bits of a point's cell, which gives an order in which near points are mostly close together.
std::uint64_t morton_code(const Vector3d& p) {
    std::uint64_t code = 0;
    std::array<std::uint32_t, 3> cell{};
    for (std::size_t c = 0; c < 3; ++c)  // 21 bits each
        cell[c] = static_cast<std::uint32_t>((p[c] + lattice_limit) / 32.0);
    for (int bit = 20; bit >= 0; --bit)
        for (std::size_t c = 0; c < 3; ++c) code = code * 2 + ((cell[c] >> bit) & 1);
    return code;
}

// The nodes by ascending number of vertices, equal ones by their own number. Nodes of a level are of similar sizes, so
// mostly they are only counted; of unusual ones the order is made by sorting.
std::vector<std::uint32_t> smallest_first(const std::vector<std::uint32_t>& vertices) {
    std::vector<std::uint32_t> order(vertices.size());
    const std::uint32_t most = vertices.empty() ? 0 : *std::max_element(vertices.begin(), vertices.end());
    if (most > 2 * vertices.size()) {
        std::iota(order.begin(), order.end(), 0u);
        std::stable_sort(order.begin(), order.end(),
                         [&](std::uint32_t a, std::uint32_t b) { return vertices[a] < vertices[b]; });
        return order;
    }
    std::vector<std::uint32_t> place(std::size_t{most} + 2, 0);
    for (const auto count : vertices) ++place[count + 1];
    std::partial_sum(place.begin(), place.end(), place.begin());
    for (std::uint32_t v = 0; v < vertices.size(); ++v) order[place[vertices[v]]++] = v;
    return order;
}

// The partner of each node, or no_node.
std::vector<std::uint32_t> match(const Layer& layer) {
    const std::size_t n = layer.size();
    std::vector<std::uint32_t> partner(n, no_node);
    const auto order = smallest_first(layer.vertices);
    std::size_t alone = n;
    for (const std::uint32_t v : order) {
        if (partner[v] != no_node) continue;
        const Vector3d own = centre_of(layer.place[v]);
        std::uint32_t best = no_node;
        double least = 0;
        for (const std::uint32_t u : layer.around(v)) {
            const Vector3d apart = centre_of(layer.place[u]) - own;
            const double score = (dot(apart, apart) + 1.0) * layer.place[u][3];
            const bool better = (partner[u] == no_node) & ((best == no_node) | (score < least));
            best = better ? u : best;
            least = better ? score : least;
        }
        if (best == no_node) continue;
        partner[v] = best;
        partner[best] = v;
        alone -= 2;
    }
    if (alone <= n / 2) return partner;
    // If there are too few pairs, the remaining nodes are paired with nodes near them in space.
    std::vector<std::pair<std::uint64_t, std::uint32_t>> left;
    left.reserve(alone);
    for (std::uint32_t v = 0; v < n; ++v)
        if (partner[v] == no_node) left.emplace_back(morton_code(centre_of(layer.place[v])), v);
    std::sort(left.begin(), left.end());
    for (std::size_t i = 0; i + 1 < left.size(); i += 2) {
        partner[left[i].second] = left[i + 1].second;
        partner[left[i + 1].second] = left[i].second;
    }
    return partner;
}

// Joins partners. Sets everything in `level` except the slopes; returns the layer of the joined nodes.
Layer join(const Layer& fine, const std::vector<std::uint32_t>& partner, HierarchyLevel& level) {
    Layer coarse;
    coarse.mutual = fine.mutual;
    std::vector<std::uint32_t> parent(fine.size());
    std::uint32_t nodes = 0;
    for (std::uint32_t v = 0; v < fine.size(); ++v) {
        const std::uint32_t u = partner[v];  // if there is none, it is beyond all
        parent[v] = u < v ? parent[u] : nodes;
        nodes += u > v;
    }
    level.first.resize(nodes);
    level.second.resize(nodes);
    level.second_share.resize(nodes);
    level.split_scale.resize(nodes);
    coarse.vertices.resize(nodes);
    coarse.place.resize(nodes);
    for (std::uint32_t v = 0; v < fine.size(); ++v) {
        const std::uint32_t u = partner[v];
        if (u < v) continue;
        const std::uint32_t node = parent[v];
        level.first[node] = v;
        level.second[node] = u;
        coarse.vertices[node] = fine.vertices[v];
        coarse.place[node] = fine.place[v];
        if (u == no_node) continue;
        const std::uint32_t a = fine.vertices[v], b = fine.vertices[u];
        Place& place = coarse.place[node];
        const double of_second = b, of_both = 1.0 * a + b;
        for (std::size_t c = 0; c < 4; ++c) place[c] += (fine.place[u][c] - place[c]) * of_second / of_both;
        coarse.vertices[node] = a + b;
        place[3] = a + b;
        level.second_share[node] = static_cast<std::uint32_t>((std::uint64_t{b} << share_bits) / (a + b));
        const double scale = std::sqrt(1.0 / a + 1.0 / b) * (1 << split_scale_bits);
        level.split_scale[node] = static_cast<std::uint16_t>(scale + 0.5);
    }
    // Whether a node was seen already cannot be foreseen, so each is written, and what follows overwrites it if it was.
    std::vector<std::uint32_t> seen(nodes, no_node);
    coarse.first_neighbour.resize(std::size_t{nodes} + 1);
    coarse.neighbours.resize(fine.neighbours.size() + 1);
    const std::span<std::uint32_t> neighbours = coarse.neighbours;
    std::size_t count = 0;
    for (std::uint32_t p = 0; p < nodes; ++p) {
        seen[p] = p;
        const std::size_t full = count + hierarchy_row_limit;
        for (const std::uint32_t child : {level.first[p], level.second[p]}) {
            if (child == no_node) continue;
            for (const std::uint32_t u : fine.around(child)) {
                const std::uint32_t q = parent[u];
                neighbours[count] = q;
                count += (seen[q] != p) & (count != full);
                seen[q] = p;
            }
        }
        coarse.first_neighbour[p + std::size_t{1}] = static_cast<std::uint32_t>(count);
        coarse.mutual &= count != full;
    }
    coarse.neighbours.resize(count);
    return coarse;
}

// Solves the symmetric m x = b by Cramer's rule.
Vector3d solve(const std::array<Vector3d, 3>& m, const Vector3d& b) {
    const Vector3d c0 = cross(m[1], m[2]), c1 = cross(m[2], m[0]), c2 = cross(m[0], m[1]);
    const double determinant = dot(m[0], c0);
    if (!(determinant > 0)) return {};
    return {(c0[0] * b[0] + c1[0] * b[1] + c2[0] * b[2]) / determinant,
            (c0[1] * b[0] + c1[1] * b[1] + c2[1] * b[2]) / determinant,
            (c0[2] * b[0] + c1[2] * b[1] + c2[2] * b[2]) / determinant};
}

// The gradient of a field around node p by least squares (neighbours weighted by vertices over squared distance),
// multiplied by the vector from second to first: this gives a fixed weight for each neighbour's mean. Slightly
// regularised, so that the direction across the surface, about which the neighbours tell nothing, has no effect.
void find_slopes(const Layer& fine, const Layer& coarse, std::uint32_t p, HierarchyLevel& level) {
    constexpr double hold = 0.01;
    const auto around = coarse.around(p);
    const Vector3d own = centre_of(coarse.place[p]);
    // By row; of four columns, since vectors of two take as long over them as over three.
    std::array<std::array<double, 4>, 3> sums{};
    double trace = 0;
    std::array<std::array<double, hierarchy_row_limit>, 3> ways;
    std::array<double, hierarchy_row_limit> weights;
    for (std::size_t k = 0; k < around.size(); ++k) {
        const Place& place = coarse.place[around[k]];
        const Vector3d way = centre_of(place) - own;
        const double length = dot(way, way);
        const double weight = weights[k] = place[3] / (length + 1.0);
        const std::array<double, 4> wide{way[0], way[1], way[2], 0.0};
        for (std::size_t i = 0; i < 3; ++i) {
            ways[i][k] = way[i];
            const double weighted = weight * way[i];
            for (std::size_t j = 0; j < 4; ++j) sums[i][j] += weighted * wide[j];
        }
        trace += weight * length;
    }
    std::array<Vector3d, 3> m;
    for (std::size_t i = 0; i < 3; ++i) {
        m[i] = {sums[i][0], sums[i][1], sums[i][2]};
        m[i][i] += hold * trace + 1e-3;
    }
    const Vector3d turned = solve(m, centre_of(fine.place[level.first[p]]) - centre_of(fine.place[level.second[p]]));
    std::int32_t* slopes = level.slopes.data() + coarse.first_neighbour[p];
    for (std::size_t k = 0; k < around.size(); ++k) {
        const double slope =
            (ways[0][k] * turned[0] + ways[1][k] * turned[1] + ways[2][k] * turned[2]) * weights[k] * (1 << slope_bits);
        constexpr double most = 1 << 15;
        // Rounded down by cutting off, as it is small.
        const double rounded = (slope < -most ? -most : slope > most ? most : slope) + 0.5;
        const auto whole = static_cast<std::int32_t>(rounded);
        slopes[k] = whole - (rounded < whole);
    }
}

}  // namespace

Result<VertexHierarchy> build_vertex_hierarchy(std::span<const LatticePoint> positions,
                                               std::span<const Triangle> triangles, const VerticesAround* around) {
    if (positions.size() > most_elements || triangles.size() > most_elements)
        return fail(ErrorKind::limit, "vertex hierarchy: more than 2^28 vertices or triangles");
    for (std::size_t v = 0; v < positions.size(); ++v)
        if (!on_lattice(positions[v]))
            return fail(ErrorKind::bad_input, "vertex hierarchy: vertex " + std::to_string(v) + " is off the lattice");
    for (std::size_t t = 0; t < triangles.size(); ++t)
        for (const std::uint32_t v : triangles[t])
            if (v >= positions.size())
                return fail(ErrorKind::bad_input,
                            "vertex hierarchy: triangle " + std::to_string(t) + " names a vertex that does not exist");
    VertexHierarchy hierarchy;
    hierarchy.vertex_count = positions.size();
    Layer fine = layer_of_vertices(positions, around ? *around : vertices_around(positions.size(), triangles));
    while (fine.size() > 1) {
        HierarchyLevel level;
        Layer coarse = join(fine, match(fine), level);
        level.slopes.assign(coarse.neighbours.size(), 0);
        for (std::uint32_t p = 0; p < level.size(); ++p)
            if (level.second[p] != no_node) find_slopes(fine, coarse, p, level);
        level.vertices = coarse.vertices;
        level.mutual = coarse.mutual;
        level.first_neighbour = coarse.first_neighbour;
        level.neighbours = coarse.neighbours;
        hierarchy.levels.push_back(std::move(level));
        fine = std::move(coarse);
    }
    return hierarchy;
}

}  // namespace htvm::internal
