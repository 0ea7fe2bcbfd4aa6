// The triangles around each vertex of a surface, laid out for vector instructions: a walk to the nearest vertex and the
// nearest triangle at a vertex look at all of them at once, and wait for three lines of memory in a row instead of one
// per neighbour. Encoder only.
//
// The searches are compiled twice, for the processor's common instructions and for AVX2, of which the program takes
// what it runs on. Both do the same operations in the same order, without contraction, so they find the same to the
// bit.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "core/geometry.h"
#include "core/thread.h"

namespace htvm::internal {

// A vertex and its neighbours in the order in which its triangles follow each other: triangle i lies between neighbours
// i and i + 1, behind the last lane the first. Lanes beyond repeat what is behind the last triangle.
struct alignas(64) VertexFan {
    static constexpr std::size_t lanes = 8;
    std::array<float, lanes> x, y, z;  // of the neighbours; these and what follows are not set in fans that are not
                                       // regular
    std::array<std::uint32_t, lanes> neighbour;
    std::array<std::uint32_t, lanes> side;  // three times a triangle's index, and which of its corners the vertex is
    Vector3f own, normal;                   // the vertex's position and normal; always set
    std::uint32_t triangles;  // 0: not regular, since there are none, more than `lanes`, or such as do not form one fan
    bool regular() const { return triangles > 0; }
    // Says that it will soon be read.
    void expect() const {
        const auto* begin = reinterpret_cast<const char*>(this);
        for (std::size_t line = 0; line < sizeof(VertexFan); line += 64) __builtin_prefetch(begin + line);
    }
    bool closed() const { return regular() && neighbour[triangles % lanes] == neighbour[0]; }
    Vector3f place(std::size_t lane) const { return {x[lane], y[lane], z[lane]}; }
};

// How a triangle must face: the least dot product of its normal with this one, of unit length.
struct Facing {
    Vector3f normal{};
    float agreement = 0;
};

struct FanWalk {
    std::uint32_t vertex = 0;
    bool ended = false;  // at a vertex none of whose neighbours is nearer; else at one whose fan is not regular
};

struct NearInFan {
    std::uint32_t lane = 0;                                           // the number of the triangle in the fan
    float squared_distance = std::numeric_limits<float>::infinity();  // infinite if no triangle faces as it must
};

// The searches, as compiled for one set of instructions.
struct FanSearches {
    // Sets a vertex's fan, but for its normal. around: the triangles around each vertex.
    void (*set_fan)(std::span<const Vector3f> positions, std::span<const Triangle> triangles,
                    const TrianglesAround& around, std::uint32_t vertex, VertexFan& fan);
    // From vertex to vertex as long as the distance to the query shrinks, as far as fans are regular. squared_distance:
    // of the query from the vertex where it begins. Where distances differ by less than a millionth, the vertex found
    // may be the farther one.
    FanWalk (*walk)(std::span<const VertexFan> fans, const Vector3f& query, std::uint32_t from, float squared_distance);
    // As many walks, eight side by side, so that none waits for memory. from: where each begins, set to where it ends
    // or comes to a fan that is not regular. Walks from beyond the fans, or from farther away than `within`, squared,
    // are not made.
    void (*walk_all)(std::span<const VertexFan> fans, std::span<const Vector3f> queries, float within,
                     std::span<std::uint32_t> from);
    // The triangle of a regular fan that is nearest to the query. facing: null if all may be found. Distances that
    // differ by less than a millionth count as equal.
    NearInFan (*nearest)(const VertexFan& fan, const Vector3f& query, const Facing* facing);
};
const FanSearches& fan_searches();           // for the instructions of this processor
const FanSearches& portable_fan_searches();  // for those that every processor of its kind has

// One fan a vertex; read-only once built.
class VertexFans {
public:
    VertexFans() = default;
    // normals: one per vertex. around: the triangles around each vertex.
    VertexFans(std::span<const Vector3f> positions, std::span<const Vector3f> normals,
               std::span<const Triangle> triangles, const TrianglesAround& around, Threads threads);
    const VertexFan& operator[](std::size_t vertex) const { return fans_[vertex]; }
    FanWalk walk(const Vector3f& query, std::uint32_t from, float squared_distance) const {
        return searches_->walk({fans_.get(), count_}, query, from, squared_distance);
    }
    void walk_all(std::span<const Vector3f> queries, float within, std::span<std::uint32_t> from) const {
        searches_->walk_all({fans_.get(), count_}, queries, within, from);
    }
    NearInFan nearest(std::uint32_t vertex, const Vector3f& query, const Facing* facing) const {
        return searches_->nearest(fans_[vertex], query, facing);
    }
    // Says that a search will soon begin at this vertex, so that it need not wait for the memory. Any number is taken.
    void expect(std::uint32_t vertex) const {
        if (vertex < count_) fans_[vertex].expect();
    }

private:
    const FanSearches* searches_ = &fan_searches();
    std::unique_ptr<VertexFan[]> fans_;
    std::size_t count_ = 0;
};

}  // namespace htvm::internal
