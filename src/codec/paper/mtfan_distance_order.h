// What M-TFAN codes besides the fans, for both sides: which vertex a newly visited one is (eq. 8), and the contexts
// that the decoded positions give. A context is a class of an angle or of a ratio; the angles are computed in doubles
// by
// + - x / and square roots alone, so that every machine gets the same ones.
#pragma once

#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/intra/triangle_fans.h"
#include "codec/paper/mtfan.h"
#include "codec/paper/nearest_order.h"
#include "core/lattice.h"
#include "core/parallel.h"

namespace htvm::internal {

struct DistanceOrderModels {
    std::array<std::array<BinaryModel, 2048>, 4> is_it;
    std::array<Mixer<4>, 64> mixer;
    UnsignedModel far;  // for an index that no distance order names
};

// The positions by visiting number, and the angles between visited vertices.
class VisitedPositions {
public:
    void push_back(LatticePoint point) { points_.push_back(point); }
    LatticePoint operator[](std::uint32_t number) const { return points_[number]; }

    // The angles that the next step of the fan could close.
    FanHints hints(const FanState& fan) const;

private:
    std::vector<LatticePoint> points_;
};

// Most vertices are found among so many; only where one is not are the other m nearest searched for.
inline constexpr std::size_t first_look = 8;

// An unvisited vertex as the next boundary vertex of a fan. Its misfit grows with the cotangent of the new triangle's
// angle at it (smallest where the triangle would be the Delaunay one), and is huge where the triangle folds back.
struct Candidate {
    std::uint32_t vertex = 0;
    double misfit = 0;
};

// The contexts in which it is coded whether a candidate is the one.
struct CandidateClasses {
    std::uint32_t stage = 0;  // 0: the fan's start, 1: no triangle behind, 2: no end to reach, 3: within a gap
    std::uint32_t place = 0, left = 0;                  // 0 .. 7: candidates before and after it
    std::uint32_t better_before = 0, better_after = 0;  // 0 .. 3: of these, the ones with less misfit
    std::uint32_t fit = 0;                              // 0 .. 7: class of the misfit
    std::uint32_t turn = 0;      // 0 .. 15: class of the angle at the focus from the current vertex to it
    std::uint32_t distance = 0;  // 0 .. 7: class of its distance from the current vertex, by that to the focus
};

// The not yet visited vertices among the m nearest to a focus, nearest first.
class UnvisitedNear {
public:
    UnvisitedNear(std::span<const LatticePoint> positions, int m, Threads threads);
    UnvisitedNear(const UnvisitedNear&) = delete;
    UnvisitedNear& operator=(const UnvisitedNear&) = delete;

    // Calls traverse(), which calls what is below. With more than one thread, another searches for the nearest ones of
    // all vertices meanwhile, ahead of the traversal, which searches itself where it is there first: both find the
    // same.
    template <class Traversal>
    void search_beside(const Traversal& traverse) {
        struct Traversed {
            std::atomic<bool>& flag;
            ~Traversed() { flag = true; }
        };
        parallel_invoke(
            threads_,
            [&] {
                const Traversed end{traversed_};
                traverse();
            },
            [&] {
                if (!first_nearest_.empty()) search_ahead();
            });
    }

    bool visited(std::uint32_t vertex) const { return visited_[vertex]; }
    void visit(std::uint32_t vertex) { visited_[vertex] = true; }
    // Sets candidates() as they are for the next boundary vertex of the fan: those among the `first_look` nearest, or,
    // to be called after that, the farther ones too.
    void look(const VisitedPositions& known, const FanState& fan, std::uint32_t focus);
    void look_farther(const VisitedPositions& known, const FanState& fan);
    std::span<const Candidate> candidates() const { return {candidates_.data(), count_}; }
    CandidateClasses classes(const VisitedPositions& known, const FanState& fan, std::size_t place) const;

private:
    void search_ahead();
    void add_candidate(const VisitedPositions& known, const FanState& fan, std::uint32_t vertex);

    std::span<const LatticePoint> positions_;
    NearestOrder order_;
    std::size_t m_;
    std::vector<std::uint32_t> first_nearest_;  // by vertex, first_look each, of the vertices below searched_
    std::atomic<std::size_t> searched_ = 0;
    std::atomic<bool> traversed_ = false;
    Threads threads_ = {};  // the caller's alone where the mesh is too small for another
    std::vector<bool> visited_;
    std::uint32_t focus_;  // whose nearest vertices `nearest_` holds
    std::size_t found_ = 0, looked_ = 0, count_ = 0;
    std::array<std::uint32_t, mtfan_max_nearest> nearest_;
    std::array<Candidate, mtfan_max_nearest> candidates_;
};

// Codes whether a candidate is the next boundary vertex, knowing that none before it is.
template <class Coder>
bool code_is_it(Coder& coder, DistanceOrderModels& models, const CandidateClasses& c, bool wanted) {
    const std::uint32_t rank = c.better_after * 4 + c.stage;
    auto& is_it = models.is_it;
    return code_mixed(
        coder, models.mixer[rank * 4 + c.better_before],
        std::array<BinaryModel*, 4>{&is_it[0][(rank * 8 + c.place) * 8 + c.left],
                                    &is_it[1][(rank * 16 + c.turn) * 8 + c.distance],
                                    &is_it[2][((rank * 8 + c.fit) * 4 + c.better_before) * 4 + std::min(c.left, 3u)],
                                    &is_it[3][(rank * 16 + c.turn) * 8 + c.fit]},
        wanted);
}

// Codes the distance order of the vertex that the fan's step goes to: its place among the candidates, which are then
// set, or candidates().size() where it is none of them.
template <class Coder>
std::size_t code_distance_order(Coder& coder, DistanceOrderModels& models, UnvisitedNear& unvisited,
                                const VisitedPositions& known, const FanState& fan, std::uint32_t focus,
                                std::uint32_t wanted) {
    unvisited.look(known, fan, focus);
    std::size_t place = 0;
    for (int round = 0; round < 2; ++round) {
        const auto candidates = unvisited.candidates();
        for (; place < candidates.size(); ++place)
            if (code_is_it(coder, models, unvisited.classes(known, fan, place), candidates[place].vertex == wanted))
                return place;
        if (round == 0) unvisited.look_farther(known, fan);
    }
    return place;
}

// Codes the index z of a vertex that is none of the candidates (the -z - 1 of eq. 8), by how far it is from the current
// boundary vertex's index: neighbours have indices near each other where the positions come in an order along the
// surface. In a corrupt stream it may be out of range.
template <class Coder>
std::uint32_t code_index_directly(Coder& coder, DistanceOrderModels& models, std::uint32_t current,
                                  std::uint32_t wanted) {
    const std::uint32_t forward = wanted - current, backward = current - wanted;
    const std::uint32_t folded = coder.number(models.far, wanted >= current ? 2 * forward : 2 * backward - 1);
    return folded % 2 == 0 ? current + folded / 2 : current - folded / 2 - 1;
}

}  // namespace htvm::internal
