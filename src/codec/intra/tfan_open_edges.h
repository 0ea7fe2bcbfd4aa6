// The open half-edges of the triangles coded so far: those whose opposite half-edge no coded triangle has. They are all
// that the fans' syntax needs to know of the past. Vertices are named by their visiting number.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace htvm::internal {

class OpenEdges {
public:
    static constexpr std::uint32_t none = 0xFFFFFFFFu;

    struct HalfEdge {
        std::uint32_t from = none, to = none;
        std::uint32_t apex = none;  // the third vertex of its triangle
        // Doubly linked lists of the half-edges that leave `from` and of those that enter `to`, latest first.
        std::uint32_t next_out = none, previous_out = none, next_in = none, previous_in = none;
    };

    // The next visiting number is now in use.
    void add_vertex() { vertices_.push_back({}); }
    std::uint32_t vertex_count() const { return static_cast<std::uint32_t>(vertices_.size()); }

    // How many of the coded triangles' corners are at the vertex.
    std::uint32_t triangle_count(std::uint32_t vertex) const { return vertices_[vertex].triangles; }

    // The latest open half-edge that leaves or enters the vertex, or none; follow next_out or next_in from there.
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
    // How far the lists are searched for an opposite. Beyond it a half-edge counts as open though it is not, on both
    // sides alike: that costs bits where two vertices both have many open edges, and bounds the work.
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
    // Both ends' lists side by side, so that the shorter one decides how long it takes.
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

}  // namespace htvm::internal
