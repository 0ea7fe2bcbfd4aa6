#include "codec/intra/neighbours.h"

#include <algorithm>
#include <array>
#include <atomic>

#include "core/parallel.h"

namespace htvm::internal {

namespace {

constexpr std::uint32_t none = 0xFFFFFFFFu;
constexpr std::size_t size_limit = std::size_t{1} << 28;

std::uint32_t next_corner(std::uint32_t c) { return c % 3 == 2 ? c - 2 : c + 1; }
std::uint32_t previous_corner(std::uint32_t c) { return c % 3 == 0 ? c + 2 : c - 1; }

// Pairs the corners that face the same edge. Edges are visited from their smaller vertex v, through the corners at v;
// for each larger vertex, `waiting` holds a corner that has no opposite yet. Threads may share the vertices, as no two
// meet at an edge.
void pair_opposites(Corners& corners, std::size_t vertex_count, Threads threads) {
    constexpr std::size_t worth_a_table = 8192;  // vertices, for each piece has a table of its own
    corners.opposite.assign(corners.vertex.size(), none);
    std::atomic<std::size_t> paired_edges = 0;
    parallel_for(vertex_count, threads, worth_a_table, [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t> waiting(vertex_count, none);
        std::size_t paired = 0;
        auto face = [&](std::uint32_t other, std::uint32_t facing) {
            if (waiting[other] == none) {
                waiting[other] = facing;
                return;
            }
            corners.opposite[facing] = waiting[other];
            corners.opposite[waiting[other]] = facing;
            waiting[other] = none;
            ++paired;
        };
        for (auto v = static_cast<std::uint32_t>(begin); v < end; ++v) {
            const std::span row =
                std::span(corners.at).subspan(corners.first_at[v], corners.first_at[v + 1] - corners.first_at[v]);
            for (const std::uint32_t c : row) {
                const std::uint32_t after = next_corner(c), before = previous_corner(c);
                if (corners.vertex[after] > v) face(corners.vertex[after], before);
                if (corners.vertex[before] > v) face(corners.vertex[before], after);
            }
            for (const std::uint32_t c : row) {
                waiting[corners.vertex[next_corner(c)]] = none;
                waiting[corners.vertex[previous_corner(c)]] = none;
            }
        }
        paired_edges += paired;
    });
    corners.paired_edges = paired_edges;
}

// The vertex that completes most parallelograms is coded next; a vertex that completes none is better coded later, when
// it can be predicted from several sides. A vertex waits in the queue of its score: the number of parallelograms it
// completes, at most score_limit. The queues are last in, first out. A vertex may be in several of them; outdated
// entries are skipped.
constexpr std::size_t score_limit = 4;

struct Traversal {
    // A vertex is put in each queue once at most, so that none of them ever has to grow.
    explicit Traversal(std::size_t vertex_count) : coded(vertex_count), queued(vertex_count), score(vertex_count) {
        for (auto& queue : queues) queue.reserve(vertex_count);
    }
    std::vector<std::uint8_t> coded;
    std::vector<std::uint8_t> queued;  // whether it was ever put in a queue
    std::vector<std::uint8_t> score;   // one per vertex
    std::array<std::vector<std::uint32_t>, score_limit + 1> queues;
    std::uint32_t seed = 0;

    void push(std::uint32_t v) {
        queued[v] = 1;
        queues[score[v]].push_back(v);
    }
    void meet(std::uint32_t v) {
        if (!queued[v]) push(v);
    }
    void gain(std::uint32_t v) {
        if (score[v] == score_limit) return;
        ++score[v];
        push(v);
    }
    std::uint32_t pop() {
        for (std::size_t s = score_limit + 1; s-- > 0;) {
            auto& queue = queues[s];
            while (!queue.empty()) {
                const std::uint32_t v = queue.back();
                queue.pop_back();
                if (!coded[v] && score[v] == s) return v;
            }
        }
        while (coded[seed]) ++seed;
        return seed;
    }
};

// Where the rows that are written end. An entry beyond a row's limit is dropped.
struct RowEnds {
    std::uint32_t neighbours = 0, parallelograms = 0;
};

void add_neighbour(Neighbours& out, RowEnds& ends, std::uint32_t row, std::uint32_t v) {
    if (ends.neighbours - row >= row_limit || ends.neighbours == out.neighbours.size()) return;
    for (std::uint32_t i = row; i < ends.neighbours; ++i)
        if (out.neighbours[i] == v) return;
    out.neighbours[ends.neighbours++] = v;
}

// Codes vertex v: writes out its candidates, and raises the score of the vertices that it completes a parallelogram
// for. Only parallelograms across an edge count for the order, since the others come along with them.
void visit(const Corners& corners, Traversal& state, Neighbours& out, RowEnds& ends, std::uint32_t v) {
    const auto row = ends;
    auto add_parallelogram = [&](std::uint32_t a, std::uint32_t b, std::uint32_t opposite, bool across) {
        if (ends.parallelograms - row.parallelograms >= row_limit || ends.parallelograms == out.parallelograms.size())
            return;
        out.parallelograms[ends.parallelograms++] = {a, b, opposite, across};
    };
    // The vertex on the other side of the edge that this corner faces, or none.
    auto beyond = [&](std::uint32_t corner) {
        const std::uint32_t o = corners.opposite[corner];
        return o == none ? none : corners.vertex[o];
    };
    auto is_known = [&](std::uint32_t vertex) { return vertex != none && state.coded[vertex]; };
    state.coded[v] = 1;
    for (std::uint32_t i = corners.first_at[v]; i < corners.first_at[v + 1]; ++i) {
        const std::uint32_t c = corners.at[i], after = next_corner(c), before = previous_corner(c);
        const std::uint32_t p = corners.vertex[after], q = corners.vertex[before];
        const bool knows_p = state.coded[p], knows_q = state.coded[q];
        if (knows_p) add_neighbour(out, ends, row.neighbours, p);
        if (knows_q) add_neighbour(out, ends, row.neighbours, q);
        if (knows_p && knows_q) {
            const std::uint32_t y = beyond(c);
            if (is_known(y) && y != v)
                add_parallelogram(p, q, y, true);
            else if (y != none && y != v)
                state.gain(y);
            // An edge at v is seen from both its triangles; count it only from the one with the lower facing corner.
            const std::uint32_t past_q = beyond(after), past_p = beyond(before);
            if (is_known(past_p) && past_p != q && before < corners.opposite[before])
                add_parallelogram(past_p, q, p, false);
            if (is_known(past_q) && past_q != p && after < corners.opposite[after])
                add_parallelogram(p, past_q, q, false);
        } else if (knows_p != knows_q) {
            const std::uint32_t unknown = knows_p ? q : p;
            if (is_known(beyond(knows_p ? before : after)))
                state.gain(unknown);
            else
                state.meet(unknown);
        } else {
            state.meet(p);
            state.meet(q);
        }
    }
}

}  // namespace

Result<Corners> find_corners(std::span<const Triangle> triangles, std::size_t vertex_count, Threads threads) {
    if (vertex_count > size_limit || triangles.size() > size_limit)
        return fail(ErrorKind::limit, "intra attributes: more than 2^28 vertices or triangles; split the mesh");
    for (const Triangle& t : triangles)
        if (std::max({t[0], t[1], t[2]}) >= vertex_count)
            return fail(ErrorKind::bad_input, "intra attributes: a triangle names a vertex that does not exist");
    Corners corners;
    corners.vertex.reserve(triangles.size() * 3);
    corners.first_at.assign(vertex_count + 1, 0);
    for (const Triangle& t : triangles) {
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
        for (const std::uint32_t v : t) {
            corners.vertex.push_back(v);
            ++corners.first_at[v + 1];
        }
    }
    for (std::size_t v = 0; v < vertex_count; ++v) corners.first_at[v + 1] += corners.first_at[v];
    corners.at.resize(corners.vertex.size());
    std::vector<std::uint32_t> fill(corners.first_at.begin(), corners.first_at.end() - 1);
    for (std::uint32_t c = 0; c < corners.vertex.size(); ++c) corners.at[fill[corners.vertex[c]]++] = c;
    pair_opposites(corners, vertex_count, threads);
    return corners;
}

// Two triangles that share an edge make one parallelogram at most, that of the last of their vertices; two vertices at
// an edge are neighbours once, and a paired edge has two corners.
Neighbours empty_rows(const Corners& corners) {
    const std::size_t vertex_count = corners.first_at.size() - 1;
    const std::size_t most = row_limit * vertex_count;
    Neighbours out;
    out.order.resize(vertex_count);
    out.first_parallelogram.resize(vertex_count + 1);
    out.first_neighbour.resize(vertex_count + 1);
    out.parallelograms.resize(std::min(most, corners.paired_edges));
    out.neighbours.resize(std::min(most, corners.vertex.size() - corners.paired_edges));
    return out;
}

void order_vertices(const Corners& corners, std::span<const std::uint8_t> known, Neighbours& out, Progress* progress) {
    const std::size_t vertex_count = out.order.size();
    Traversal state(vertex_count);
    RowEnds ends;
    std::size_t rank = 0;
    const auto take = [&](std::uint32_t v) {
        out.order[rank] = v;
        visit(corners, state, out, ends, v);
        ++rank;
        out.first_parallelogram[rank] = ends.parallelograms;
        out.first_neighbour[rank] = ends.neighbours;
        if (progress && rank % Progress::told_every == 0) progress->reach(rank);
    };
    for (std::uint32_t v = 0; v < known.size(); ++v)
        if (known[v] != 0) take(v);
    while (rank < vertex_count) take(state.pop());
}

Result<Neighbours> find_neighbours(std::span<const Triangle> triangles, std::size_t vertex_count,
                                   std::span<const std::uint8_t> known) {
    const auto corners = find_corners(triangles, vertex_count);
    if (!corners) return tl::unexpected(corners.error());
    auto out = empty_rows(*corners);
    order_vertices(*corners, known, out);
    return out;
}

}  // namespace htvm::internal
