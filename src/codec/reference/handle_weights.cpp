#include "codec/reference/handle_weights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <queue>
#include <vector>

namespace htvm::internal {
namespace {

constexpr std::size_t others_a_vertex = handles_a_vertex - 1;

// The mesh's edges in both directions; those of two triangles come twice.
struct Neighbours {
    std::vector<std::uint32_t> vertices;
    std::vector<std::size_t> begin;  // one more than vertices
};

Neighbours neighbours_of(std::size_t vertices, std::span<const Triangle> triangles) {
    Neighbours out;
    out.begin.assign(vertices + 1, 0);
    for (const auto& t : triangles)
        for (const auto v : t) out.begin[v + 1] += 2;
    for (std::size_t v = 0; v < vertices; ++v) out.begin[v + 1] += out.begin[v];
    out.vertices.resize(out.begin[vertices]);
    std::vector<std::size_t> next(out.begin.begin(), out.begin.end() - 1);
    for (const auto& t : triangles)
        for (std::size_t i = 0; i < 3; ++i) {
            out.vertices[next[t[i]]++] = t[(i + 1) % 3];
            out.vertices[next[t[i]]++] = t[(i + 2) % 3];
        }
    return out;
}

// Distances along edges are counted in half lattice units, so that half an edge is whole.
struct Near {
    std::int32_t distance = 0;
    std::uint16_t handle = 0;
    auto operator<=>(const Near&) const = default;
};

// The nearest other handles of each vertex, nearest first, that lie nearer than half the width.
struct NearHandles {
    std::array<Near, others_a_vertex> near{};
    std::uint8_t count = 0;
};

// Enters a handle where it is one of the nearest, or nearer than known.
bool enter(NearHandles& list, Near candidate) {
    std::size_t place = 0;
    while (place < list.count && list.near[place].handle != candidate.handle) ++place;
    if (place == list.count) {
        if (list.count < others_a_vertex)
            ++list.count;
        else if (--place; list.near[place] < candidate)
            return false;
    } else if (list.near[place] <= candidate) {
        return false;
    }
    for (; place > 0 && candidate < list.near[place - 1]; --place) list.near[place] = list.near[place - 1];
    list.near[place] = candidate;
    return true;
}

// The length of an edge, at least 1, at most `longest` + 1.
std::int32_t edge_length(LatticePoint a, LatticePoint b, std::int32_t longest) {
    const std::int64_t squared = squared_distance(a, b);
    if (squared > std::int64_t{longest} * longest) return longest + 1;
    return std::max(1, static_cast<std::int32_t>(std::sqrt(static_cast<double>(squared))));
}

struct Step {
    std::uint32_t vertex;
    Near near;
};
struct FartherStep {  // what comes of steps that are equally far does not depend on their order
    bool operator()(const Step& a, const Step& b) const { return a.near.distance > b.near.distance; }
};

// The lists under way, and the steps that are still to be passed on.
struct Spreading {
    std::span<const std::uint16_t> own;
    std::span<const LatticePoint> positions;
    std::int32_t width;
    Neighbours neighbours;
    std::vector<NearHandles> lists;
    std::priority_queue<Step, std::vector<Step>, FartherStep> steps;
};

void reach(Spreading& state, std::uint32_t v, std::int64_t distance, std::uint16_t handle) {
    if (distance >= state.width || state.own[v] == handle) return;
    const auto d = static_cast<std::int32_t>(distance);
    if (enter(state.lists[v], {d, handle})) state.steps.push({v, {d, handle}});
}

void cross_borders(Spreading& state) {
    for (std::uint32_t v = 0; v < state.own.size(); ++v)
        for (std::size_t i = state.neighbours.begin[v]; i < state.neighbours.begin[v + 1]; ++i) {
            const auto u = state.neighbours.vertices[i];
            if (state.own[u] == state.own[v]) continue;
            reach(state, u, edge_length(state.positions[v], state.positions[u], state.width), state.own[v]);
        }
}

void pass_on(Spreading& state, std::uint32_t v, Near near) {
    for (std::size_t i = state.neighbours.begin[v]; i < state.neighbours.begin[v + 1]; ++i) {
        const auto u = state.neighbours.vertices[i];
        const std::int64_t length = edge_length(state.positions[v], state.positions[u], state.width);
        reach(state, u, near.distance + 2 * length, near.handle);
    }
}

// Dijkstra's shortest paths from all borders at once. A handle that is not among a vertex's nearest is not among those
// of any vertex that it would reach through that vertex, so that the lists are exact although they are short.
std::vector<NearHandles> near_handles(Spreading state) {
    cross_borders(state);
    while (!state.steps.empty()) {
        const auto [v, near] = state.steps.top();
        state.steps.pop();
        const auto known = std::span(state.lists[v].near).first(state.lists[v].count);
        if (std::find(known.begin(), known.end(), near) != known.end()) pass_on(state, v, near);
    }
    return std::move(state.lists);
}

// On the border between two handles both weigh the same; from there the weight of the other one falls in a straight
// line to 0 at half the width.
VertexWeights weights_of(std::uint16_t own, const NearHandles& others, std::int32_t width) {
    struct Entry {
        std::int64_t weight;
        std::uint16_t handle;
    };
    constexpr std::int64_t one = std::int64_t{1} << weight_bits;
    std::array<Entry, handles_a_vertex> entries{};
    std::int64_t sum = others.count > 0 ? std::int64_t{width} + others.near[0].distance : 0;
    for (std::size_t i = 0; i < others.count; ++i) sum += width - others.near[i].distance;
    entries[0] = {one, own};
    for (std::size_t i = 0; i < others.count; ++i) {
        const auto& near = others.near[i];
        entries[i + 1] = {(std::int64_t{width} - near.distance) * one / sum, near.handle};
        entries[0].weight -= entries[i + 1].weight;
    }
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
        return a.weight != b.weight ? a.weight > b.weight : a.handle < b.handle;
    });
    VertexWeights out;
    for (std::size_t i = 0; i < handles_a_vertex && entries[i].weight > 0; ++i) {
        out.handle[i] = entries[i].handle;
        out.weight[i] = static_cast<std::uint16_t>(entries[i].weight);
    }
    return out;
}

}  // namespace

HandleWeights smooth_weights(std::span<const std::uint16_t> handle_of_vertex, std::span<const LatticePoint> positions,
                             std::span<const Triangle> triangles, std::int32_t width, Threads threads) {
    static_cast<void>(threads);  // one pass of some milliseconds
    const auto count = positions.size();
    const auto others = near_handles(
        {handle_of_vertex, positions, width, neighbours_of(count, triangles), std::vector<NearHandles>(count), {}});
    HandleWeights out;
    out.reserve(others.size());
    for (std::size_t v = 0; v < others.size(); ++v) out.push_back(weights_of(handle_of_vertex[v], others[v], width));
    return out;
}

}  // namespace htvm::internal
