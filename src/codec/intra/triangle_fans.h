// Triangle fans: what TFAN (tfan.h) and M-TFAN (bones/mtfan.h) share, which is everything except what they code about a
// vertex that a fan meets for the first time.
//
// From top to bottom: the open edges of what is coded; the state of a fan among them; the contexts and the syntax of
// its start and its steps; the decoder's traversal; the encoder's, which also chooses the fans.
//
// The syntax is written once for both directions: every function that codes one thing takes a coder and the wanted
// value (entropy/models.h). Vertices are named by their visiting number. At the focus, an open half-edge that enters it
// comes from a vertex where the coded triangles around the focus end and a fan may start (a start candidate); an open
// half-edge that leaves it goes to a vertex where they start and a fan may end (an end candidate).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "entropy/mixing.h"
#include "entropy/models.h"
#include "entropy/range_coder.h"
#include "htvm/mesh.hpp"

namespace htvm::internal {

// The open half-edges of the triangles coded so far: those whose opposite half-edge is in no coded triangle. The fans'
// syntax depends on nothing else that was coded. Vertices are named by their visiting number.
class OpenEdges {
public:
    static constexpr std::uint32_t none = 0xFFFFFFFFu;

    struct HalfEdge {
        std::uint32_t from = none, to = none;
        std::uint32_t apex = none;  // the third vertex of its triangle
        // Doubly linked lists of the half-edges that leave `from`, and of those that enter `to`, latest first.
        std::uint32_t next_out = none, previous_out = none, next_in = none, previous_in = none;
    };

    // Takes the next visiting number into use.
    void add_vertex() { vertices_.push_back({}); }
    std::uint32_t vertex_count() const { return static_cast<std::uint32_t>(vertices_.size()); }

    // The number of corners of coded triangles at the vertex.
    std::uint32_t triangle_count(std::uint32_t vertex) const { return vertices_[vertex].triangles; }

    // The latest open half-edge that leaves or enters the vertex, or none; continue with next_out or next_in.
    std::uint32_t first_out(std::uint32_t vertex) const { return vertices_[vertex].first_out; }
    std::uint32_t first_in(std::uint32_t vertex) const { return vertices_[vertex].first_in; }
    const HalfEdge& operator[](std::uint32_t half_edge) const { return half_edges_[half_edge]; }

    void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        ++vertices_[a].triangles;
        ++vertices_[b].triangles;
        ++vertices_[c].triangles;
        add(a, b, c);
        add(b, c, a);
        add(c, a, b);
    }

private:
    struct Vertex {
        std::uint32_t first_out = none, first_in = none, triangles = 0;
    };
    // How many list entries are searched for an opposite; this bounds the work. If it is not among them, a half-edge
    // counts as open on both sides although it is not. That costs bits only where two vertices both have many open
    // edges.
    static constexpr int search_limit = 32;

    void add(std::uint32_t from, std::uint32_t to, std::uint32_t apex) {
        if (from == to) return;
        const std::uint32_t opposite = find(to, from);
        if (opposite != none) {
            unlink(opposite);
        } else {
            link(from, to, apex);
        }
    }
    // Walks both ends' lists side by side, so that the shorter one determines the time.
    std::uint32_t find(std::uint32_t from, std::uint32_t to) const {
        std::uint32_t out = vertices_[from].first_out, in = vertices_[to].first_in;
        for (int i = 0; i < search_limit && out != none && in != none; ++i) {
            if (half_edges_[out].to == to) return out;
            if (half_edges_[in].from == from) return in;
            out = half_edges_[out].next_out;
            in = half_edges_[in].next_in;
        }
        return none;
    }
    void link(std::uint32_t from, std::uint32_t to, std::uint32_t apex) {
        std::uint32_t id = free_;
        if (id == none) {
            id = static_cast<std::uint32_t>(half_edges_.size());
            half_edges_.push_back({});
        } else {
            free_ = half_edges_[id].next_out;
        }
        half_edges_[id] = {from, to, apex, vertices_[from].first_out, none, vertices_[to].first_in, none};
        if (vertices_[from].first_out != none) half_edges_[vertices_[from].first_out].previous_out = id;
        if (vertices_[to].first_in != none) half_edges_[vertices_[to].first_in].previous_in = id;
        vertices_[from].first_out = id;
        vertices_[to].first_in = id;
    }
    void unlink(std::uint32_t id) {
        const HalfEdge edge = half_edges_[id];
        if (edge.next_out != none) half_edges_[edge.next_out].previous_out = edge.previous_out;
        if (edge.next_in != none) half_edges_[edge.next_in].previous_in = edge.previous_in;
        (edge.previous_out != none ? half_edges_[edge.previous_out].next_out : vertices_[edge.from].first_out) =
            edge.next_out;
        (edge.previous_in != none ? half_edges_[edge.previous_in].next_in : vertices_[edge.to].first_in) = edge.next_in;
        half_edges_[id].next_out = free_;
        free_ = id;
    }

    std::vector<Vertex> vertices_;
    std::vector<HalfEdge> half_edges_;
    std::uint32_t free_ = none;
};

// How a fan's boundary continues from its current vertex.
enum class Step : std::uint8_t {
    new_vertex,    // to a vertex met for the first time
    close,         // to an end candidate, where the fan ends
    left,          // to the vertex that also completes the open edge of the current vertex
    right,         // to the vertex from which the fan can close by completing the open edge of the end candidate
    known_vertex,  // to any other visited vertex
    stop,          // not at all: the fan ends at a boundary of the mesh
};

inline constexpr std::uint32_t most_candidates = 4;  // most start and end candidates that can be named
inline constexpr std::uint32_t longest_walk = 31;    // most steps along open edges in search of a known vertex

// The state of a fan that both sides know before its next step.
struct FanState {
    std::uint32_t focus = 0;
    std::uint32_t start = OpenEdges::none;     // the boundary's first vertex
    std::uint32_t previous = OpenEdges::none;  // the boundary vertex before the current one
    std::uint32_t current = OpenEdges::none;
    std::uint32_t length = 0;  // triangles in the fan
    Step last = Step::stop;    // the step that led here; stop: no step yet
    bool from_candidate = false;

    // Set by look_around() from the open edges:
    std::array<std::uint32_t, most_candidates> ends{};
    std::uint32_t end_count = 0;
    std::uint32_t behind = OpenEdges::none;      // the third vertex of the coded triangle before the current vertex
    std::uint32_t beyond_end = OpenEdges::none;  // the third vertex of the coded triangle after the first end candidate
    std::uint32_t left = OpenEdges::none, right = OpenEdges::none;
    bool fills_hole = false;  // one triangle would complete the open edges on both sides
};

// Contexts for the next step that do not come from connectivity: none (all 0) in TFAN, the decoded positions in M-TFAN.
struct FanHints {
    std::uint32_t gap = 0;    // 0 .. 15: the angle at the focus from the current vertex to the end candidate
    std::uint32_t left = 0;   // 0 .. 7: the angle at the current vertex that the left triangle would fill
    std::uint32_t right = 0;  // 0 .. 7: the angle at the end candidate that the right triangle would fill
};

// Made by `new FanModels`, without parentheses: every model has its initial value, and zeroing 650 KB before, as
// std::make_unique does, would only take time.
struct FanModels {
    std::array<std::array<std::array<BinaryModel, 4>, 3>, 16> more_fans;  // indexed by triangles, start and end
                                                                          // candidates
    std::array<BinaryModel, 4> starts_at_candidate;
    std::array<BinaryModel, most_candidates> start_index, end_index;
    BinaryModel starts_at_known;
    std::array<std::array<BinaryModel, 16384>, 5> is_new;  // five sets of contexts, see code_is_new()
    std::array<Mixer<5>, 64> new_mixer;
    std::array<std::array<BinaryModel, 16384>, 5> closing;
    std::array<Mixer<5>, 64> close_mixer;
    std::array<std::array<std::array<BinaryModel, 8>, 8>, 4> goes_left;
    std::array<std::array<BinaryModel, 8>, 8> goes_right;
    std::array<BinaryModel, 8> stops;
    std::array<BinaryModel, 2> walks, walks_left;
    UnsignedModel walk_steps;
    UnsignedModel far;
};

// The vertex before `vertex` along the open edges, other than `avoided` and `also_avoided`; or none.
inline std::uint32_t before_on_border(const OpenEdges& edges, std::uint32_t vertex, std::uint32_t avoided,
                                      std::uint32_t also_avoided) {
    std::uint32_t edge = edges.first_in(vertex);
    for (int i = 0; i < 4 && edge != OpenEdges::none; ++i, edge = edges[edge].next_in)
        if (edges[edge].from != avoided && edges[edge].from != also_avoided) return edges[edge].from;
    return OpenEdges::none;
}

// The vertex after `vertex` along the open edges, other than `avoided`; or none.
inline std::uint32_t after_on_border(const OpenEdges& edges, std::uint32_t vertex, std::uint32_t avoided) {
    std::uint32_t edge = edges.first_out(vertex);
    for (int i = 0; i < 4 && edge != OpenEdges::none; ++i, edge = edges[edge].next_out)
        if (edges[edge].to != avoided) return edges[edge].to;
    return OpenEdges::none;
}

// Puts first the end candidate that bounds the same gap as the fan's start.
inline void put_own_gap_first(const OpenEdges& edges, FanState& fan) {
    std::uint32_t vertex = fan.start;
    for (std::uint32_t i = 0; i < longest_walk && vertex != OpenEdges::none; ++i) {
        for (std::uint32_t k = 0; k < fan.end_count; ++k) {
            if (fan.ends[k] != vertex || vertex == fan.start) continue;
            std::swap(fan.ends[0], fan.ends[k]);
            return;
        }
        const std::uint32_t edge = edges.first_in(vertex);
        vertex = edge == OpenEdges::none ? OpenEdges::none : edges[edge].from;
    }
}

// Finds the end candidates of the fan; its own start comes last, if it may be one.
inline void find_ends(const OpenEdges& edges, FanState& fan) {
    fan.end_count = 0;
    std::uint32_t edge = edges.first_out(fan.focus);
    for (std::uint32_t i = 0; i < 2 * most_candidates && edge != OpenEdges::none && fan.end_count + 1 < most_candidates;
         ++i, edge = edges[edge].next_out)
        if (edges[edge].to != fan.start) fan.ends[fan.end_count++] = edges[edge].to;
    if (fan.end_count > 1 && fan.from_candidate) put_own_gap_first(edges, fan);
    if (fan.end_count > 0)
        for (edge = edges.first_out(fan.focus); edge != OpenEdges::none && fan.beyond_end == OpenEdges::none;
             edge = edges[edge].next_out)
            if (edges[edge].to == fan.ends[0]) fan.beyond_end = edges[edge].apex;
    if (!fan.from_candidate) fan.ends[fan.end_count++] = fan.start;
}

// Fills in what the open edges tell about the fan's current vertex.
inline void look_around(const OpenEdges& edges, FanState& fan) {
    const std::uint32_t end = fan.end_count > 0 ? fan.ends[0] : OpenEdges::none;
    fan.left =
        fan.last == Step::new_vertex ? OpenEdges::none : before_on_border(edges, fan.current, fan.focus, fan.previous);
    fan.right = end == OpenEdges::none || end == fan.start ? OpenEdges::none : after_on_border(edges, end, fan.focus);
    fan.fills_hole = fan.left == end || fan.right == fan.current;
    if (end == OpenEdges::none) fan.fills_hole = false;
    if (fan.left == end) fan.left = OpenEdges::none;
    if (fan.right == fan.current || fan.right == fan.left) fan.right = OpenEdges::none;
}

template <class Coder>
std::uint32_t code_index(Coder& coder, std::array<BinaryModel, most_candidates>& models, std::uint32_t count,
                         std::uint32_t wanted) {
    std::uint32_t index = 0;
    while (index + 1 < count && coder.bit(models[index], wanted > index)) ++index;
    return index;
}

// Whether the focus has another fan after those already coded.
template <class Coder>
bool code_more_fans(Coder& coder, FanModels& models, const OpenEdges& edges, std::uint32_t focus, bool wanted) {
    const auto count = [&](std::uint32_t edge, auto next) {
        std::uint32_t n = 0;
        for (; edge != OpenEdges::none && n < 2; edge = next(edges[edge])) ++n;
        return n;
    };
    const std::uint32_t starts = count(edges.first_in(focus), [](const OpenEdges::HalfEdge& e) { return e.next_in; });
    const std::uint32_t ends = count(edges.first_out(focus), [](const OpenEdges::HalfEdge& e) { return e.next_out; });
    const std::uint32_t triangles = std::min(edges.triangle_count(focus), 15u);
    return coder.bit(models.more_fans[triangles][starts][ends], wanted);
}

// The number of a visited vertex that is not among the candidates: by the length of a walk along the open edges from
// the current vertex or from the end candidate, or else by how much later than the focus it was visited.
template <class Coder>
std::uint32_t code_known_vertex(Coder& coder, FanModels& models, const OpenEdges& edges, const FanState& fan,
                                std::uint32_t wanted) {
    const auto back = [&](std::uint32_t vertex) { return before_on_border(edges, vertex, fan.focus, fan.previous); };
    const auto forth = [&](std::uint32_t vertex) { return after_on_border(edges, vertex, fan.focus); };
    const std::uint32_t end = fan.end_count > 0 ? fan.ends[0] : OpenEdges::none;
    bool leftward = false;
    std::uint32_t steps = 0;
    std::uint32_t back_vertex = fan.current, forth_vertex = end;
    for (std::uint32_t i = 1; i <= longest_walk && steps == 0; ++i) {
        if (back_vertex != OpenEdges::none) back_vertex = back(back_vertex);
        if (forth_vertex != OpenEdges::none) forth_vertex = forth(forth_vertex);
        if (back_vertex == wanted || forth_vertex == wanted) {
            steps = i;
            leftward = back_vertex == wanted;
        }
    }
    if (coder.bit(models.walks[fan.end_count > 0], steps > 0)) {
        leftward = coder.bit(models.walks_left[0], leftward);
        steps = coder.number(models.walk_steps, steps - 1) + 1;
        std::uint32_t vertex = leftward ? fan.current : end;
        for (std::uint32_t i = 0; i < std::min(steps, longest_walk) && vertex != OpenEdges::none; ++i)
            vertex = leftward ? back(vertex) : forth(vertex);
        return vertex;
    }
    return coder.number(models.far, wanted - fan.focus) + fan.focus;
}

struct CodedStep {
    Step step;
    std::uint32_t vertex;  // the visiting number; none if the vertex is new, or for stop
};

// The contexts of a step, each clipped to a class.
struct StepContexts {
    std::uint32_t situation = 0;  // 0: no end candidate, 1: one triangle fills the gap, 2 .. 4: depending on the last
                                  // step
    std::uint32_t length = 0;     // triangles in the fan, up to 7
    std::uint32_t ways = 0;       // 0 .. 3: which of left and right exist
    bool turned = false;          // whether the last step went left or right
    // Number of coded triangles at the focus (up to 15) and at the vertices around the gap (up to 7).
    std::uint32_t focus = 0, current = 0, end = 0, left = 0, right = 0, behind = 0, beyond = 0;
    FanHints hints;
};

inline StepContexts step_contexts(const OpenEdges& edges, const FanState& fan, const FanHints& hints) {
    const auto count = [&](std::uint32_t vertex, std::uint32_t most) {
        return vertex == OpenEdges::none ? 0u : std::min(edges.triangle_count(vertex), most);
    };
    StepContexts c;
    c.situation = fan.end_count == 0             ? 0
                  : fan.fills_hole               ? 1
                  : fan.last == Step::new_vertex ? 2
                  : fan.last == Step::stop       ? 3
                                                 : 4;
    c.length = std::min(fan.length, 7u);
    c.ways = (fan.left != OpenEdges::none ? 1u : 0u) + (fan.right != OpenEdges::none ? 2u : 0u);
    c.turned = fan.last == Step::right || fan.last == Step::left;
    c.focus = count(fan.focus, 15);
    c.current = count(fan.current, 7);
    c.end = count(fan.end_count > 0 ? fan.ends[0] : OpenEdges::none, 7);
    c.left = count(fan.left, 7);
    c.right = count(fan.right, 7);
    c.behind = count(fan.behind, 7);
    c.beyond = count(fan.beyond_end, 7);
    c.hints = hints;
    return c;
}

template <class Coder>
bool code_is_new(Coder& coder, FanModels& models, const StepContexts& c, bool wanted) {
    auto& m = models.is_new;
    const std::uint32_t gap = c.hints.gap;
    return code_mixed(
        coder, models.new_mixer[c.situation * 8 + c.length],
        std::array<BinaryModel*, 5>{&m[0][((c.focus * 8 + c.end) * 8 + c.situation) * 16 + gap],
                                    &m[1][((c.focus * 8 + c.current) * 8 + c.situation) * 16 + gap],
                                    &m[2][((gap * 8 + c.hints.left) * 8 + c.hints.right) * 8 + c.situation],
                                    &m[3][(c.focus * 8 + c.end) * 8 + c.right],

                                    &m[4][((c.focus * 8 + c.behind) * 8 + c.beyond) * 8 + c.situation]},
        wanted);
}

template <class Coder>
bool code_closes(Coder& coder, FanModels& models, const StepContexts& c, bool wanted) {
    auto& m = models.closing;
    const std::uint32_t gap = c.hints.gap;
    return code_mixed(
        coder, models.close_mixer[c.situation * 4 + c.ways],
        std::array<BinaryModel*, 5>{&m[0][((c.focus * 8 + c.situation) * 4 + c.ways) * 2 + c.turned],
                                    &m[1][(c.focus * 8 + c.current) * 8 + c.end],
                                    &m[2][((c.focus * 8 + c.end) * 8 + c.situation) * 16 + gap],
                                    &m[3][((c.left * 8 + c.current) * 8 + c.end) * 8 + c.right],

                                    &m[4][((gap * 8 + c.hints.left) * 8 + c.hints.right) * 8 + c.situation]},
        wanted);
}

// The next step of the fan; wanted.vertex is used for close and known_vertex. In a corrupt stream the vertex may be out
// of range.
template <class Coder>
CodedStep code_step(Coder& coder, FanModels& models, const OpenEdges& edges, const FanState& fan, const FanHints& hints,
                    CodedStep wanted) {
    const StepContexts contexts = step_contexts(edges, fan, hints);
    if (code_is_new(coder, models, contexts, wanted.step == Step::new_vertex))
        return {Step::new_vertex, OpenEdges::none};
    if (fan.end_count > 0 && code_closes(coder, models, contexts, wanted.step == Step::close)) {
        std::uint32_t index = 0;
        while (index < fan.end_count && fan.ends[index] != wanted.vertex) ++index;
        return {Step::close, fan.ends[code_index(coder, models.end_index, fan.end_count, index)]};
    }
    if (fan.left != OpenEdges::none &&
        coder.bit(models.goes_left[contexts.ways][contexts.current][contexts.hints.left], wanted.step == Step::left))
        return {Step::left, fan.left};
    if (fan.right != OpenEdges::none &&
        coder.bit(models.goes_right[contexts.end][contexts.hints.right], wanted.step == Step::right))
        return {Step::right, fan.right};
    if (fan.length > 0 && coder.bit(models.stops[std::min(fan.end_count, 3u)], wanted.step == Step::stop))
        return {Step::stop, OpenEdges::none};
    return {Step::known_vertex, code_known_vertex(coder, models, edges, fan, wanted.vertex)};
}

// How a fan reaches the vertex of this visiting number (none: not visited yet).
inline CodedStep classify_step(const FanState& fan, std::uint32_t number) {
    if (number == OpenEdges::none) return {Step::new_vertex, number};
    for (std::uint32_t i = 0; i < fan.end_count; ++i)
        if (fan.ends[i] == number) return {Step::close, number};
    if (number == fan.left) return {Step::left, number};
    if (number == fan.right) return {Step::right, number};
    return {Step::known_vertex, number};
}

inline void advance(FanState& fan, const CodedStep& step) {
    fan.previous = fan.behind = fan.current;
    fan.current = step.vertex;
    fan.last = step.step;
    ++fan.length;
}

// Where a fan starts: sets from_candidate and start (none for a new vertex). `wanted` is the start, or none.
template <class Coder>
void code_start(Coder& coder, FanModels& models, const OpenEdges& edges, FanState& fan, std::uint32_t wanted) {
    std::array<std::uint32_t, most_candidates> starts{};
    std::uint32_t count = 0, index = 0;
    std::array<std::uint32_t, most_candidates> behind{};
    std::uint32_t edge = edges.first_in(fan.focus);
    for (; count < most_candidates && edge != OpenEdges::none; edge = edges[edge].next_in) {
        behind[count] = edges[edge].apex;
        starts[count++] = edges[edge].from;
    }
    while (index < count && starts[index] != wanted) ++index;
    fan.from_candidate = count > 0 && coder.bit(models.starts_at_candidate[count - 1], index < count);
    if (fan.from_candidate) {
        index = code_index(coder, models.start_index, count, index);
        fan.start = starts[index];
        fan.behind = behind[index];
    } else if (coder.bit(models.starts_at_known, wanted != OpenEdges::none)) {
        fan.start = coder.number(models.far, wanted - fan.focus) + fan.focus;
    } else {
        fan.start = OpenEdges::none;
    }
}

// Decodes triangle_count triangles, in visiting numbers; false if the stream is corrupt. The Discovery defines what is
// coded besides the fans:
//     static constexpr bool visits_isolated   whether vertices without triangles are visited as seeds
//     bool seed()                             a seed takes the next visiting number; false if no vertex is left
//     FanHints hints(const FanState&)         contexts for the fan's next step
//     bool discover(const FanState&)          a vertex met by the fan takes it; false if it cannot
template <class Discovery>
bool decode_fans(RangeDecoder& decoder, std::uint32_t triangle_count, Discovery& discovery,
                 std::vector<Triangle>& triangles) {
    ReadingCoder<RangeDecoder> coder{decoder};
    const auto models_owner = std::unique_ptr<FanModels>(new FanModels);
    FanModels& models = *models_owner;
    OpenEdges edges;
    const auto discover = [&](const FanState& fan) {
        edges.add_vertex();
        return discovery.discover(fan);
    };
    const auto decode_fan = [&](FanState& fan) {
        code_start(coder, models, edges, fan, OpenEdges::none);
        if (fan.start == OpenEdges::none) {
            fan.start = edges.vertex_count();
            if (!discover(fan)) return false;
        }
        if (fan.start >= edges.vertex_count()) return false;
        fan.current = fan.start;
        find_ends(edges, fan);
        while (triangles.size() < triangle_count) {
            look_around(edges, fan);
            CodedStep step = code_step(coder, models, edges, fan, discovery.hints(fan), {});
            if (step.step == Step::stop) return true;
            if (step.step == Step::new_vertex) {
                step.vertex = edges.vertex_count();
                if (!discover(fan)) return false;
            }
            if (step.vertex >= edges.vertex_count() || decoder.exhausted()) return false;
            triangles.push_back({fan.focus, fan.current, step.vertex});
            edges.add_triangle(fan.focus, fan.current, step.vertex);
            advance(fan, step);
            if (step.step == Step::close) return true;
        }
        return true;
    };
    for (std::uint32_t focus = 0; triangles.size() < triangle_count; ++focus) {
        bool implied = false;
        if (focus == edges.vertex_count()) {
            if (!discovery.seed() || decoder.exhausted()) return false;
            edges.add_vertex();
            implied = !Discovery::visits_isolated;
        }
        for (; triangles.size() < triangle_count; implied = false) {
            if (!implied && !code_more_fans(coder, models, edges, focus, false)) break;
            FanState fan;
            fan.focus = focus;
            if (!decode_fan(fan)) return false;
        }
    }
    return true;
}

// The triangles at a focus that are not coded yet, as links from one neighbour to the next: the triangle
// (focus, a, b) links a to b. Vertices are input indices.
class FocusLinks {
public:
    FocusLinks(std::uint32_t vertex_count, std::span<const Triangle> triangles)
        : triangles_(triangles),
          first_corner_(std::size_t{vertex_count} + 1),
          corner_triangle_(triangles.size() * 3),
          coded_(triangles.size()),
          head_(vertex_count, none),
          arriving_(vertex_count) {
        for (const Triangle& triangle : triangles)
            for (const std::uint32_t vertex : triangle) ++first_corner_[vertex + 1];
        for (std::size_t v = 0; v < vertex_count; ++v) first_corner_[v + 1] += first_corner_[v];
        std::vector<std::uint32_t> at(first_corner_.begin(), first_corner_.end() - 1);
        for (std::uint32_t t = 0; t < triangles.size(); ++t)
            for (const std::uint32_t vertex : triangles[t]) corner_triangle_[at[vertex]++] = t;
    }

    bool has_triangles(std::uint32_t vertex) const { return first_corner_[vertex] < first_corner_[vertex + 1]; }
    // Takes the triangles at the vertex that are not coded yet, and marks them as coded.
    void gather(std::uint32_t focus) {
        links_.clear();
        unled_cursor_ = cursor_ = 0;
        for (std::uint32_t c = first_corner_[focus]; c < first_corner_[focus + 1]; ++c) {
            const std::uint32_t t = corner_triangle_[c];
            if (coded_[t]) continue;  // also skips the second corner of a degenerate triangle here
            coded_[t] = true;
            const Triangle& triangle = triangles_[t];
            const std::size_t corner = triangle[0] == focus ? 0 : triangle[1] == focus ? 1 : 2;
            links_.push_back({triangle[(corner + 1) % 3], triangle[(corner + 2) % 3], none});
        }
        remaining_ = links_.size();
        for (std::size_t i = links_.size(); i-- > 0;) {  // backwards, so that each vertex's first link ends up at the
                                                         // front
            links_[i].next = head_[links_[i].from];
            head_[links_[i].from] = static_cast<std::uint32_t>(i);
            ++arriving_[links_[i].to];
        }
    }
    std::size_t remaining() const { return remaining_; }
    bool leads_on(std::uint32_t vertex) const { return head_[vertex] != none; }
    // A vertex with an outgoing link; if possible, one without an incoming link. Needs remaining() > 0.
    std::uint32_t any_start() {
        for (; unled_cursor_ < links_.size(); ++unled_cursor_) {
            const std::uint32_t from = links_[unled_cursor_].from;
            if (head_[from] != none && arriving_[from] == 0) return from;
        }
        while (head_[links_[cursor_].from] == none) ++cursor_;
        return links_[cursor_].from;
    }
    // Follows (and removes) a link from the vertex. Needs leads_on(vertex).
    std::uint32_t follow(std::uint32_t vertex) {
        const Link& link = links_[head_[vertex]];
        head_[vertex] = link.next;
        --arriving_[link.to];
        --remaining_;
        return link.to;
    }

private:
    static constexpr std::uint32_t none = 0xFFFFFFFFu;
    struct Link {
        std::uint32_t from, to, next;
    };
    std::span<const Triangle> triangles_;
    std::vector<std::uint32_t> first_corner_, corner_triangle_;  // the triangles at each vertex
    std::vector<bool> coded_;
    std::vector<Link> links_;              // of the current focus
    std::vector<std::uint32_t> head_;      // per vertex: its first link, or none
    std::vector<std::uint32_t> arriving_;  // per vertex: number of links that lead to it
    std::size_t remaining_ = 0, unled_cursor_ = 0, cursor_ = 0;
};

struct FanOrder {
    std::vector<std::uint32_t> order;  // input index by visiting number
    std::vector<Triangle> triangles;   // in visiting numbers, in the order of decoding
};

// Where the next fan at the focus starts: at a start candidate that has an outgoing link, if there is one. An input
// index.
inline std::uint32_t choose_start(FocusLinks& links, const OpenEdges& edges, std::uint32_t focus,
                                  const std::vector<std::uint32_t>& order) {
    std::uint32_t edge = edges.first_in(focus);
    for (std::uint32_t i = 0; edge != OpenEdges::none && i < most_candidates; edge = edges[edge].next_in, ++i)
        if (links.leads_on(order[edges[edge].from])) return order[edges[edge].from];
    return links.any_start();
}

// Codes all triangles. The Discovery defines what is coded besides the fans:
//     static constexpr bool visits_isolated   whether vertices without triangles are visited as seeds
//     void seed(vertex)                       a seed (input index) takes the next visiting number
//     FanHints hints(const FanState&)         contexts for the fan's next step
//     void discover(const FanState&, vertex)  a vertex met by the fan takes it
template <class Coder, class Discovery>
FanOrder encode_fans(Coder& coder, FanModels& models, std::uint32_t vertex_count, std::span<const Triangle> triangles,
                     Discovery& discovery) {
    FanOrder result;
    result.order.reserve(vertex_count);
    result.triangles.reserve(triangles.size());
    FocusLinks links(vertex_count, triangles);
    OpenEdges edges;
    std::vector<std::uint32_t> number_of(vertex_count, OpenEdges::none);
    const auto visit = [&](std::uint32_t vertex) {
        number_of[vertex] = edges.vertex_count();
        result.order.push_back(vertex);
        edges.add_vertex();
        return number_of[vertex];
    };
    // Codes one fan at the focus: its start, then its steps.
    const auto code_fan = [&](FanState& fan) {
        std::uint32_t vertex = choose_start(links, edges, fan.focus, result.order);
        code_start(coder, models, edges, fan, number_of[vertex]);
        if (fan.start == OpenEdges::none) {
            discovery.discover(fan, vertex);
            fan.start = visit(vertex);
        }
        fan.current = fan.start;
        find_ends(edges, fan);
        while (result.triangles.size() < triangles.size()) {
            look_around(edges, fan);
            if (!links.leads_on(vertex)) {
                code_step(coder, models, edges, fan, discovery.hints(fan), {Step::stop, OpenEdges::none});
                return;
            }
            vertex = links.follow(vertex);
            CodedStep step =
                code_step(coder, models, edges, fan, discovery.hints(fan), classify_step(fan, number_of[vertex]));
            if (step.step == Step::new_vertex) {
                discovery.discover(fan, vertex);
                step.vertex = visit(vertex);
            }
            result.triangles.push_back({fan.focus, fan.current, step.vertex});
            edges.add_triangle(fan.focus, fan.current, step.vertex);
            advance(fan, step);
            if (step.step == Step::close) return;
        }
    };
    std::uint32_t next_seed = 0;
    for (std::uint32_t focus = 0; result.triangles.size() < triangles.size(); ++focus) {
        bool implied = false;
        if (focus == edges.vertex_count()) {
            while (number_of[next_seed] != OpenEdges::none ||
                   (!Discovery::visits_isolated && !links.has_triangles(next_seed)))
                ++next_seed;
            discovery.seed(next_seed);
            visit(next_seed);
            implied = !Discovery::visits_isolated;
        }
        links.gather(result.order[focus]);
        for (; result.triangles.size() < triangles.size(); implied = false) {
            const bool more = links.remaining() > 0;
            if (!implied) code_more_fans(coder, models, edges, focus, more);
            if (!more) break;
            FanState fan;
            fan.focus = focus;
            code_fan(fan);
        }
    }
    return result;
}

}  // namespace htvm::internal
