// The encoder's traversal, shared by TFAN and M-TFAN: finds the fans at each focus and codes them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/intra/tfan_syntax.h"
#include "htvm/mesh.hpp"

namespace htvm::internal {

// The triangles at a focus that are not coded yet, as links from one neighbour to the next: the triangle
// (focus, a, b) links a to b. Vertices are input indices.
class FocusLinks {
public:
    FocusLinks(std::uint32_t vertex_count, std::span<const Triangle> triangles);

    bool has_triangles(std::uint32_t vertex) const { return first_corner_[vertex] < first_corner_[vertex + 1]; }
    // Takes the uncoded triangles at the vertex; they count as coded from then on.
    void gather(std::uint32_t focus);
    std::size_t remaining() const { return remaining_; }
    bool leads_on(std::uint32_t vertex) const { return head_[vertex] != none; }
    // A vertex from which a link leads on, one that no link leads to where there is one. Needs remaining() > 0.
    std::uint32_t any_start();
    // Follows (and removes) a link from the vertex. Needs leads_on(vertex).
    std::uint32_t follow(std::uint32_t vertex);

private:
    static constexpr std::uint32_t none = 0xFFFFFFFFu;
    struct Link {
        std::uint32_t from, to, next;
    };
    std::span<const Triangle> triangles_;
    std::vector<std::uint32_t> first_corner_, corner_triangle_;  // the triangles at each vertex
    std::vector<bool> coded_;
    std::vector<Link> links_;              // of the focus
    std::vector<std::uint32_t> head_;      // by vertex: its first link, or none
    std::vector<std::uint32_t> arriving_;  // by vertex: how many links lead to it
    std::size_t remaining_ = 0, unled_cursor_ = 0, cursor_ = 0;
};

struct FanOrder {
    std::vector<std::uint32_t> order;  // input index by visiting number
    std::vector<Triangle> triangles;   // in visiting numbers, as decoded
};

// Where the next fan at the focus starts: at a start candidate if a link leads on from one. An input index.
inline std::uint32_t choose_start(FocusLinks& links, const OpenEdges& edges, std::uint32_t focus,
                                  const std::vector<std::uint32_t>& order) {
    std::uint32_t edge = edges.first_in(focus);
    for (std::uint32_t i = 0; edge != OpenEdges::none && i < most_candidates; edge = edges[edge].next_in, ++i)
        if (links.leads_on(order[edges[edge].from])) return order[edges[edge].from];
    return links.any_start();
}

// Codes all triangles. The Discovery says what is coded besides the fans:
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
    // One fan at the focus: its start, then its steps.
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
