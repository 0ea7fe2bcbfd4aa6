#include "codec/reference/deformation_nodes.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <tuple>
#include <utility>

#include "core/disjoint_sets.h"
#include "core/geometry.h"

namespace htvm::internal {
namespace {

using Distance = std::uint32_t;
constexpr Distance unreached = std::numeric_limits<Distance>::max();

// The steps from each vertex, in rows, and how long they are.
struct Graph {
    VerticesAround around;
    std::vector<Distance> lengths;   // of each step
    std::vector<Distance> shortest;  // of the steps from each vertex
    Distance longest = 0;            // of all
    std::size_t size() const { return shortest.size(); }
    // Calls take(vertex, length) for each step.
    template <class Take>
    void from(std::uint32_t vertex, const Take& take) const {
        const std::uint32_t end = around.first[vertex + std::size_t{1}];
        for (std::uint32_t i = around.first[vertex]; i < end; ++i) take(around.vertices[i], lengths[i]);
    }
};

// How far apart the ends of each step are, rounded down. Squared distances are below 2^52, so that doubles are exact,
// and a root is rounded up to a whole number only if it is one.
void measure(std::span<const LatticePoint> positions, Graph& graph) {
    const auto& first = graph.around.first;
    graph.lengths.resize(graph.around.vertices.size());
    graph.shortest.resize(positions.size());
    constexpr std::size_t at_once = 16;
    std::array<double, at_once> x, y, z;
    for (std::uint32_t v = 0; v < positions.size(); ++v) {
        const LatticePoint here = positions[v];
        Distance shortest = unreached;
        for (std::size_t i = first[v]; i < first[v + std::size_t{1}]; i += at_once) {
            const std::size_t count = std::min<std::size_t>(first[v + std::size_t{1}] - i, at_once);
            for (std::size_t k = 0; k < count; ++k) {
                const LatticePoint apart = positions[graph.around.vertices[i + k]] - here;
                x[k] = apart.x, y[k] = apart.y, z[k] = apart.z;
            }
            Distance* lengths = graph.lengths.data() + i;
            for (std::size_t k = 0; k < count; ++k)
                lengths[k] = static_cast<Distance>(
                    static_cast<std::int32_t>(std::sqrt(x[k] * x[k] + y[k] * y[k] + z[k] * z[k])));
            for (std::size_t k = 0; k < count; ++k) {
                shortest = std::min(shortest, lengths[k]);
                graph.longest = std::max(graph.longest, lengths[k]);
            }
        }
        graph.shortest[v] = shortest;
    }
}

using VertexPair = std::pair<std::uint32_t, std::uint32_t>;

// Numbers ascending by their upper half, those with the same one in the order in which they are: sorted by their
// digits.
void sort_by_upper_half(std::vector<std::uint64_t>& numbers) {
    constexpr int digit_bits = 11;
    std::uint32_t differ = 0;
    for (const auto n : numbers) differ |= static_cast<std::uint32_t>((n ^ numbers.front()) >> 32);
    std::vector<std::uint64_t> sorted(numbers.size());
    std::array<std::uint32_t, 1 << digit_bits> place;
    for (int shift = 0; shift < 32 && differ >> shift != 0; shift += digit_bits) {
        const auto digit = [&](std::uint64_t n) { return n >> (32 + shift) & (place.size() - 1); };
        place.fill(0);
        for (const auto n : numbers) ++place[digit(n)];
        std::uint32_t count = 0;
        for (auto& p : place) count += std::exchange(p, count);
        for (const auto n : numbers) sorted[place[digit(n)]++] = n;
        numbers.swap(sorted);
    }
}

// Links each vertex with the next one at the same place. Most vertices differ in x already, so numbers are sorted
// instead of points.
void link_coincident(std::span<const LatticePoint> positions, DisjointSets& pieces, std::vector<VertexPair>& links) {
    std::vector<std::uint64_t> order;  // x and vertex
    order.reserve(positions.size());
    for (std::uint32_t v = 0; v < positions.size(); ++v)
        order.push_back(std::uint64_t{static_cast<std::uint32_t>(positions[v].x) ^ 0x80000000u} << 32 | v);
    sort_by_upper_half(order);
    std::vector<std::pair<LatticePoint, std::uint32_t>> plane;  // across x
    for (std::size_t i = 0, end = 0; i < order.size(); i = end) {
        for (end = i + 1; end < order.size() && order[end] >> 32 == order[i] >> 32; ++end) {
        }
        if (end == i + 1) continue;
        plane.clear();
        for (std::size_t k = i; k < end; ++k) {
            const auto v = static_cast<std::uint32_t>(order[k]);
            plane.emplace_back(positions[v], v);
        }
        std::sort(plane.begin(), plane.end());
        for (std::size_t k = 1; k < plane.size(); ++k)
            if (plane[k - 1].first == plane[k].first) {
                links.emplace_back(plane[k - 1].second, plane[k].second);
                pieces.join(plane[k - 1].second, plane[k].second);
            }
    }
}

using Cell = std::array<std::int32_t, 3>;

// Vertices by their cell of a cubic grid; ascending within a cell.
struct CellEntry {
    Cell cell;
    std::uint32_t vertex;
    // Not <=>, which std::array does not have in libc++ 14.
    bool operator<(const CellEntry& other) const { return std::tie(cell, vertex) < std::tie(other.cell, other.vertex); }
};

std::vector<CellEntry> by_cell(std::span<const LatticePoint> positions, std::int32_t side) {
    const auto down = [&](std::int32_t c) { return c >= 0 ? c / side : -((-c - 1) / side) - 1; };
    std::vector<CellEntry> out;
    out.reserve(positions.size());
    for (std::uint32_t v = 0; v < positions.size(); ++v)
        out.push_back({{down(positions[v].x), down(positions[v].y), down(positions[v].z)}, v});
    std::sort(out.begin(), out.end());
    return out;
}

// Links each vertex with the nearest one of another piece within reach. Of crowded cells only a part is searched. The
// cells around one are nine rows of three; as the cells are gone through in order, so is each of these rows.
void link_near(std::span<const LatticePoint> positions, std::int32_t reach, DisjointSets& pieces,
               std::vector<VertexPair>& links) {
    bool several = false;
    for (std::uint32_t v = 1; v < positions.size() && !several; ++v) several = pieces.of(v) != pieces.of(0);
    if (!several || reach <= 0) return;
    constexpr std::size_t most_a_cell = 24;
    const auto entries = by_cell(positions, reach);
    std::array<std::size_t, 9> rows{};
    std::vector<std::uint32_t> around;
    for (std::size_t i = 0, end = 0; i < entries.size(); i = end) {
        const Cell middle = entries[i].cell;
        for (end = i; end < entries.size() && entries[end].cell == middle; ++end) {
        }
        around.clear();
        bool others = false;
        for (int r = 0; r < 9; ++r) {
            const std::int32_t x = middle[0] + r / 3 - 1, y = middle[1] + r % 3 - 1;
            auto& row = rows[static_cast<std::size_t>(r)];
            while (row < entries.size() && entries[row].cell < Cell{x, y, middle[2] - 1}) ++row;
            std::size_t in_cell = 0;
            for (auto at = row; at < entries.size() && entries[at].cell <= Cell{x, y, middle[2] + 1}; ++at) {
                in_cell = at > row && entries[at].cell == entries[at - 1].cell ? in_cell + 1 : 0;
                if (in_cell >= most_a_cell) continue;
                around.push_back(entries[at].vertex);
                others = others || pieces.of(entries[at].vertex) != pieces.of(entries[i].vertex);
            }
        }
        if (!others && std::all_of(entries.begin() + static_cast<std::ptrdiff_t>(i),
                                   entries.begin() + static_cast<std::ptrdiff_t>(end), [&](const CellEntry& entry) {
                                       return pieces.of(entry.vertex) == pieces.of(entries[i].vertex);
                                   }))
            continue;
        for (auto at = i; at < end; ++at) {
            const auto v = entries[at].vertex;
            std::pair<std::int64_t, std::uint32_t> best{std::int64_t{reach} * reach, unreached};
            for (const auto other : around)
                if (pieces.of(other) != pieces.of(v))
                    best = std::min(best, {squared_distance(positions[v], positions[other]), other});
            if (best.second != unreached) links.emplace_back(v, best.second);
        }
    }
}

// Adds links to the rows of those that share a triangle, behind these and without repeats. links: ascending.
VerticesAround with_links(const VerticesAround& around, std::span<const VertexPair> links) {
    VerticesAround out;
    out.first.reserve(around.first.size());
    out.first.push_back(0);
    out.vertices.reserve(around.vertices.size() + links.size());
    std::size_t link = 0;
    for (std::uint32_t v = 0; v + std::size_t{1} < around.first.size(); ++v) {
        const auto row = static_cast<std::ptrdiff_t>(out.vertices.size());
        const auto own = around.of(v);
        out.vertices.insert(out.vertices.end(), own.begin(), own.end());
        for (; link < links.size() && links[link].first == v; ++link) {
            const auto u = links[link].second;
            if (u != v && std::find(out.vertices.begin() + row, out.vertices.end(), u) == out.vertices.end())
                out.vertices.push_back(u);
        }
        out.first.push_back(static_cast<std::uint32_t>(out.vertices.size()));
    }
    return out;
}

Graph mesh_graph(std::span<const LatticePoint> positions, std::span<const Triangle> triangles, std::int32_t reach,
                 const VerticesAround* around) {
    DisjointSets pieces(positions.size());
    for (const auto& t : triangles) {
        pieces.join(t[0], t[1]);
        pieces.join(t[1], t[2]);
    }
    std::vector<VertexPair> links;
    link_coincident(positions, pieces, links);
    link_near(positions, reach, pieces, links);
    for (std::size_t i = 0, count = links.size(); i < count; ++i) links.emplace_back(links[i].second, links[i].first);
    std::sort(links.begin(), links.end());
    Graph graph;
    graph.around = around ? *around : vertices_around(positions.size(), triangles);
    if (!links.empty()) graph.around = with_links(graph.around, links);
    measure(positions, graph);
    return graph;
}

// The vertices reached so far from the nodes within the spacing, and the nodes' own vertices.
struct Cover {
    std::vector<Distance> distance;
    std::vector<std::uint8_t> reached;  // for each vertex, how many nodes were nearer than all nodes before them
    std::vector<std::uint32_t> nodes;
    std::uint64_t searched = 0;
};
// On surfaces a few are enough. In a star whose rays are nodes, each a little nearer to the hub than the last, every
// node could otherwise search everything behind the hub.
constexpr std::uint8_t most_reached = 16;

using CoverQueue = std::vector<std::pair<Distance, std::uint32_t>>;  // a heap of vertices by their distance

// Dijkstra's algorithm from the vertices in the queue, no further than `spacing`, and only where they are nearer than
// all nodes before.
void reach_from(const Graph& graph, CoverQueue& queue, Distance spacing, Cover& cover) {
    while (!queue.empty()) {
        std::pop_heap(queue.begin(), queue.end(), std::greater<>());
        const auto [distance, vertex] = queue.back();
        queue.pop_back();
        if (distance != cover.distance[vertex]) continue;
        ++cover.reached[vertex];
        ++cover.searched;
        graph.from(vertex, [&, so_far = distance](std::uint32_t u, Distance length) {
            const Distance there = so_far + length;  // both are below 2^26
            if (there > spacing || there >= cover.distance[u]) return;
            if (cover.reached[u] == most_reached) return;
            cover.distance[u] = there;
            queue.emplace_back(there, u);
            std::push_heap(queue.begin(), queue.end(), std::greater<>());
        });
    }
}

// Those of the first so many vertices that are one step from a vertex of some kind, ascending. Ways lead back as they
// lead there, so it is enough to look around these, which are few.
template <class IsOfKind>
std::vector<std::uint32_t> around(const Graph& graph, std::size_t count, const IsOfKind& is_of_kind) {
    std::vector<std::uint32_t> out;
    if (count == 0) return out;
    for (std::uint32_t v = 0; v < graph.size(); ++v)
        if (is_of_kind(v))
            for (const auto u : graph.around.of(v))
                if (u < count) out.push_back(u);
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
    return out;
}

// Starts with what kept nodes reach; what they do not reach of the vertices that stay and of the patch is for others.
void cover_by_kept(const Graph& graph, const KeptNodes& kept, Distance spacing, Cover& cover) {
    for (std::size_t v = 0; v < kept.near.size(); ++v) {
        const auto& nearest = kept.near[v].near[0];
        if (kept.near[v].count > 0 && nearest.distance <= spacing) cover.distance[v] = nearest.distance;
    }
    CoverQueue queue;
    for (const std::uint32_t v :
         around(graph, kept.near.size(), [&](std::uint32_t u) { return cover.distance[u] == unreached; }))
        if (cover.distance[v] != unreached) queue.emplace_back(cover.distance[v], v);
    std::make_heap(queue.begin(), queue.end(), std::greater<>());
    reach_from(graph, queue, spacing, cover);
}

// Covers all vertices with nodes, or stops if more than most_nodes are needed.
bool cover_all(const Graph& graph, const KeptNodes& kept, Distance spacing, std::size_t most_nodes, Cover& cover) {
    const std::size_t vertices = graph.size();
    cover.distance.assign(vertices, unreached);
    cover.reached.assign(vertices, 0);
    cover.nodes = kept.vertex;
    cover_by_kept(graph, kept, spacing, cover);
    CoverQueue queue;
    for (std::uint32_t v = 0; v < vertices; ++v) {
        if (cover.distance[v] != unreached) continue;
        if (cover.nodes.size() >= most_nodes) return false;
        cover.nodes.push_back(v);
        cover.distance[v] = 0;
        queue.assign(1, {0, v});
        reach_from(graph, queue, spacing, cover);
    }
    return true;
}

// A node and how far it is, as a number in the order of NearNode.
using NodeKey = std::uint64_t;
constexpr int key_node_bits = 16;
constexpr NodeKey no_key = std::numeric_limits<NodeKey>::max();
NodeKey key_of(const NearNode& near) { return NodeKey{near.distance} << key_node_bits | near.node; }
Distance distance_of(NodeKey key) { return static_cast<Distance>(key >> key_node_bits); }
NearNode near_of(NodeKey key) { return {distance_of(key), static_cast<std::uint16_t>(key)}; }

// The nearest nodes of a vertex, ascending, then no_key.
using NodeKeys = std::array<NodeKey, near_nodes>;

// Enters a node if it is one of the nearest, or nearer than known; returns whether it was. Which place it takes cannot
// be foreseen, so nothing here branches on it.
bool enter(NodeKeys& list, NodeKey candidate) {
    if (list.back() <= candidate) return false;
    std::size_t end = near_nodes - 1;  // the one that goes: the same node, or else the farthest
    for (std::size_t k = 0; k < near_nodes; ++k)
        end = static_cast<std::uint16_t>(list[k]) == static_cast<std::uint16_t>(candidate) ? k : end;
    if (list[end] <= candidate) return false;
    for (std::size_t k = near_nodes - 1; k > 0; --k)
        list[k] = k <= end ? std::min(list[k], std::max(list[k - 1], candidate)) : list[k];
    list[0] = std::min(list[0], candidate);
    return true;
}

struct Visit {
    NodeKey key = 0;
    std::uint32_t vertex = 0;
};

// A queue for Dijkstra's algorithm, in buckets by distance (Dial 1969). A visit leads to another one of its bucket only
// over a step that is shorter than a bucket is wide, as between vertices at the same place. Visits of vertices with
// such steps come first, by distance, then by node; those of all others, which is most, may then come in any order. The
// node is part of the order because a vertex would otherwise be visited again for every lower node at the same
// distance.
class BucketQueue {
public:
    // reach: how far apart the distances in the queue can be.
    BucketQueue(const Graph& graph, Distance reach)
        : shortest_(graph.shortest),
          width_bits_(std::max(0, static_cast<int>(std::bit_width(reach)) - most_bucket_bits)),
          buckets_(std::bit_ceil((std::size_t{reach} >> width_bits_) + 2)),
          mask_(static_cast<Distance>(buckets_.size() - 1)) {}
    bool empty() const { return size_ == 0; }
    void push(const Visit& visit) {
        ++size_;
        const Distance bucket = distance_of(visit.key) >> width_bits_;
        if (bucket == now_) {
            push_first(visit);
            return;
        }
        auto& into = buckets_[bucket & mask_];
        if (into.capacity() == 0) into.reserve(likely_visits);
        into.push_back(visit);
    }
    Visit pop() {
        if (first_.empty() && others_.empty()) next_bucket();
        --size_;
        auto& from = first_.empty() ? others_ : first_;
        if (!first_.empty()) std::pop_heap(first_.begin(), first_.end(), later);
        const Visit visit = from.back();
        from.pop_back();
        return visit;
    }

private:
    static constexpr int most_bucket_bits = 10;
    static constexpr std::size_t likely_visits = 16;  // of a bucket
    static bool later(const Visit& a, const Visit& b) { return a.key > b.key; }
    void push_first(const Visit& visit) {
        first_.push_back(visit);
        std::push_heap(first_.begin(), first_.end(), later);
    }
    void next_bucket() {
        do {
            ++now_;
        } while (buckets_[now_ & mask_].empty());
        auto& bucket = buckets_[now_ & mask_];
        for (const Visit& visit : bucket)
            if (shortest_[visit.vertex] >> width_bits_ == 0)
                push_first(visit);
            else
                others_.push_back(visit);
        bucket.clear();
    }
    std::span<const Distance> shortest_;
    int width_bits_;
    std::vector<std::vector<Visit>> buckets_;  // a ring
    Distance mask_;                            // of their numbers
    std::vector<Visit> first_, others_;        // of the bucket whose turn it is; the first are a heap
    Distance now_ = unreached;                 // its number; before the first, so that the next is 0
    std::size_t size_ = 0;
};

// The shortest paths from all nodes at once. A node that is not among the nearest of a vertex is not among those of any
// vertex that it reaches through it either, so the short lists are still exact. From kept nodes, ways go on where
// vertices that know them meet others that know too few.
std::vector<NearNodes> nearest_nodes(const Graph& graph, const std::vector<std::uint32_t>& nodes,
                                     const KeptNodes& kept) {
    constexpr auto none = [] {
        NodeKeys keys{};
        keys.fill(no_key);
        return keys;
    }();
    std::vector<NodeKeys> lists(graph.size(), none);
    for (std::size_t v = 0; v < kept.near.size(); ++v)
        for (std::size_t k = 0; k < kept.near[v].count; ++k) lists[v][k] = key_of(kept.near[v].near[k]);
    std::vector<Visit> starts;
    const auto knows_too_few = [&](std::uint32_t v) { return lists[v].back() == no_key; };
    for (const std::uint32_t v : around(graph, kept.near.size(), knows_too_few))
        for (std::size_t k = 0; k < kept.near[v].count; ++k) starts.push_back({lists[v][k], v});
    for (std::size_t n = kept.vertex.size(); n < nodes.size(); ++n)
        if (enter(lists[nodes[n]], n)) starts.push_back({n, nodes[n]});

    Distance reach = graph.longest;
    for (const Visit& start : starts) reach = std::max(reach, distance_of(start.key));
    BucketQueue queue(graph, reach);
    for (const Visit& start : starts) queue.push(start);
    // Known not to change, unlike what may be reached through a reference.
    const std::span<const std::uint32_t> first = graph.around.first, vertices = graph.around.vertices;
    const std::span<const Distance> lengths = graph.lengths;
    const std::span<NodeKeys> near = lists;
    while (!queue.empty()) {
        const Visit visit = queue.pop();
        const NodeKeys& list = near[visit.vertex];
        bool listed = false;
        for (const NodeKey key : list) listed |= key == visit.key;
        if (!listed || distance_of(visit.key) > unreached / 2) continue;
        const std::uint32_t end = first[visit.vertex + std::size_t{1}];
        for (std::uint32_t i = first[visit.vertex]; i < end; ++i) {
            const NodeKey there = visit.key + (NodeKey{lengths[i]} << key_node_bits);
            const std::uint32_t u = vertices[i];
            if (near[u].back() > there && enter(near[u], there)) queue.push({there, u});
        }
    }
    std::vector<NearNodes> out(lists.size());
    for (std::size_t v = 0; v < lists.size(); ++v)
        for (; out[v].count < near_nodes && lists[v][out[v].count] != no_key; ++out[v].count)
            out[v].near[out[v].count] = near_of(lists[v][out[v].count]);
    return out;
}

// Sumner's weights, (1 - distance / distance of the next node)^2, normalised to sum to one; the rounding remainder goes
// to the nearest node.
VertexWeights weights_of(const NearNodes& list, Distance spacing) {
    const std::size_t count = std::min<std::size_t>(list.count, handles_per_vertex);
    const Distance last = list.near[count - 1].distance;
    const Distance zero = list.count == near_nodes ? std::max<Distance>(list.near[near_nodes - 1].distance, 1)
                                                   : std::max<Distance>(2 * spacing, last + spacing / 4 + 1);
    // Quotients are rounded down; below 2^24, those of whole numbers that doubles hold are exact that far.
    std::array<double, handles_per_vertex> share{};
    double sum = 0;
    for (std::size_t k = 0; k < handles_per_vertex; ++k) {
        // Reduced to twelve bits before squaring, so that the sum cannot overflow.
        const double apart = k < count ? static_cast<double>(zero - list.near[k].distance) : 0.0;
        const double nearness = static_cast<std::int32_t>(apart * 4096.0 / static_cast<double>(zero));
        share[k] = nearness * nearness;
        sum += share[k];
    }
    // By descending weight, then by node: as one number, the weight by what it lacks of all.
    constexpr std::uint32_t all = 1u << weight_bits;
    std::array<std::uint32_t, handles_per_vertex> entries;
    std::uint32_t rest = all;
    for (std::size_t k = 1; k < handles_per_vertex; ++k) {
        const std::uint32_t weight =
            sum == 0 ? 0 : static_cast<std::uint32_t>(static_cast<std::int32_t>(share[k] * all / sum));
        entries[k] = (all - weight) << 16 | list.near[k].node;
        rest -= weight;
    }
    entries[0] = (all - rest) << 16 | list.near[0].node;
    const auto in_order = [&](std::size_t a, std::size_t b) {
        const std::uint32_t low = std::min(entries[a], entries[b]);
        entries[b] = std::max(entries[a], entries[b]);
        entries[a] = low;
    };
    static_assert(handles_per_vertex == 4);
    in_order(0, 1), in_order(2, 3), in_order(0, 2), in_order(1, 3), in_order(1, 2);
    VertexWeights out;
    for (std::size_t k = 0; k < handles_per_vertex && entries[k] >> 16 < all; ++k) {
        out.handle[k] = static_cast<std::uint16_t>(entries[k]);
        out.weight[k] = static_cast<std::uint16_t>(all - (entries[k] >> 16));
    }
    return out;
}

// Vertices that no node reaches are assigned to the node nearest in space, of equally near ones the lower.
void assign_nearest_in_space(std::span<const LatticePoint> positions, const std::vector<std::uint32_t>& nodes,
                             std::vector<NearNodes>& lists) {
    for (std::size_t v = 0; v < positions.size(); ++v) {
        if (lists[v].count > 0) continue;
        std::pair<std::int64_t, std::size_t> best{std::numeric_limits<std::int64_t>::max(), 0};
        for (std::size_t n = 0; n < nodes.size(); ++n)
            best = std::min(best, {squared_distance(positions[v], positions[nodes[n]]), n});
        lists[v].near[0] = {0, static_cast<std::uint16_t>(best.second)};
        lists[v].count = 1;
    }
}

std::vector<NodePair> touching_regions(const Graph& graph, const std::vector<std::uint16_t>& node, std::size_t nodes) {
    std::vector<NodePair> pairs;
    std::vector<bool> known(nodes * nodes);
    for (std::uint32_t v = 0; v < node.size(); ++v)
        for (const auto u : graph.around.of(v)) {
            const NodePair pair{node[v], node[u]};
            if (pair.first >= pair.second || known[pair.first * nodes + pair.second]) continue;
            known[pair.first * nodes + pair.second] = true;
            pairs.push_back(pair);
        }
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

// Connects separate groups of nodes by the shortest possible pairs (Prim 1957; existing pairs cost nothing).
void connect_groups(std::span<const LatticePoint> places, std::vector<NodePair>& pairs) {
    const std::size_t count = places.size();
    if (count < 2) return;
    DisjointSets groups(count);
    std::size_t left = count;
    for (const auto& pair : pairs) left -= groups.join(pair.first, pair.second) ? 1 : 0;
    if (left == 1) return;
    std::vector<std::int64_t> nearest(count, std::numeric_limits<std::int64_t>::max());
    std::vector<std::uint32_t> from(count, 0);
    std::vector<bool> inside(count, false);
    std::vector<NodePair> added;
    auto add_group = [&](std::uint32_t group) {
        for (std::uint32_t n = 0; n < count; ++n) {
            if (groups.of(n) != group) continue;
            inside[n] = true;
            for (std::uint32_t other = 0; other < count; ++other) {
                const auto d = squared_distance(places[n], places[other]);
                if (inside[other] || d >= nearest[other]) continue;
                nearest[other] = d;
                from[other] = n;
            }
        }
    };
    add_group(groups.of(0));
    for (;;) {
        std::uint32_t next = 0;
        bool found = false;
        for (std::uint32_t n = 0; n < count; ++n)
            if (!inside[n] && (!found || nearest[n] < nearest[next])) next = n, found = true;
        if (!found) break;
        added.push_back({static_cast<std::uint16_t>(std::min(next, from[next])),
                         static_cast<std::uint16_t>(std::max(next, from[next]))});
        add_group(groups.of(next));
    }
    pairs.insert(pairs.end(), added.begin(), added.end());  // of different groups, so there are no repeats
    std::sort(pairs.begin(), pairs.end());
}

}  // namespace

KeptNodes keep_nodes(const DeformationNodes& nodes, std::span<const std::uint32_t> stays) {
    KeptNodes kept;
    if (nodes.spacing == 0) return kept;
    kept.spacing = nodes.spacing;
    constexpr auto gone = std::numeric_limits<std::uint16_t>::max();
    std::vector<std::uint16_t> number(nodes.vertex.size(), gone);
    for (std::size_t n = 0; n < nodes.vertex.size(); ++n) {
        const auto it = std::lower_bound(stays.begin(), stays.end(), nodes.vertex[n]);
        if (it == stays.end() || *it != nodes.vertex[n]) continue;
        number[n] = static_cast<std::uint16_t>(kept.vertex.size());
        kept.vertex.push_back(static_cast<std::uint32_t>(it - stays.begin()));
    }
    if (kept.vertex.empty()) return {};
    kept.near.reserve(stays.size());
    for (const auto v : stays) {
        auto& list = kept.near.emplace_back();
        const auto& before = nodes.near[v];
        for (std::size_t k = 0; k < before.count; ++k)
            if (number[before.near[k].node] != gone)
                list.near[list.count++] = {before.near[k].distance, number[before.near[k].node]};
    }
    return kept;
}

DeformationNodes choose_deformation_nodes(std::span<const LatticePoint> positions, std::span<const Triangle> triangles,
                                          const DeformationNodeOptions& options, const KeptNodes& kept,
                                          const VerticesAround* around) {
    DeformationNodes nodes;
    if (positions.empty()) return nodes;
    const Graph graph = mesh_graph(positions, triangles, options.link_reach, around);
    const std::size_t most = std::clamp<std::size_t>(options.most_nodes, 1, most_deformation_nodes);
    Cover cover;
    const bool goes_on =
        !kept.vertex.empty() && cover_all(graph, kept, static_cast<Distance>(kept.spacing), most, cover);
    std::int64_t spacing = goes_on ? kept.spacing : std::clamp<std::int64_t>(options.spacing, 1, 2 * lattice_limit);
    bool covered = goes_on || cover_all(graph, {}, static_cast<Distance>(spacing), most, cover);
    // Eight steps of 1.5 make the spacing 25 times as wide.
    for (int attempt = 0; attempt < 8 && !covered; ++attempt) {
        spacing = std::min<std::int64_t>(spacing + spacing / 2 + 1, 2 * lattice_limit);
        covered = cover_all(graph, {}, static_cast<Distance>(spacing), most, cover);
    }
    nodes.near = nearest_nodes(graph, cover.nodes, goes_on ? kept : KeptNodes{});
    if (!covered) assign_nearest_in_space(positions, cover.nodes, nodes.near);

    nodes.vertex = std::move(cover.nodes);
    nodes.searched = cover.searched;
    nodes.spacing = covered ? static_cast<std::int32_t>(spacing) : 0;
    nodes.handle_of_vertex.reserve(positions.size());
    nodes.weights.reserve(positions.size());
    for (const auto& list : nodes.near) {
        nodes.handle_of_vertex.push_back(list.near[0].node);
        nodes.weights.push_back(weights_of(list, static_cast<Distance>(spacing)));
    }
    nodes.neighbours = touching_regions(graph, nodes.handle_of_vertex, nodes.vertex.size());
    std::vector<LatticePoint> places;
    for (const std::uint32_t v : nodes.vertex) places.push_back(positions[v]);
    connect_groups(places, nodes.neighbours);
    return nodes;
}

}  // namespace htvm::internal
