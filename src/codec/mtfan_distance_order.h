// What M-TFAN codes besides the fans, for both sides: which vertex a newly visited one is (eq. 8), and the contexts
// that the decoded positions give. A context is a class of an angle or of a ratio; the angles are computed in doubles
// by
// + - x / and square roots alone, so that every machine gets the same ones.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/mtfan.h"
#include "codec/nearest_order.h"
#include "codec/tfan_syntax.h"
#include "core/lattice.h"

namespace htvm {

struct DistanceOrderModels {
    std::array<std::array<BinaryModel, 2048>, 4> is_it;
    std::array<Mixer<4>, 64> mixer;
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

// An unvisited vertex as the next boundary vertex of a fan.
struct Candidate {
    std::uint32_t vertex = 0;
    double misfit = 0;           // the cotangent of the triangle's angle at the candidate; much where it folds back
    std::uint32_t turn = 0;      // 0 .. 15: class of the angle at the focus from the current vertex to the candidate
    std::uint32_t distance = 0;  // 0 .. 7: class of its distance from the current vertex, by that to the focus
};

// The not yet visited vertices among the m nearest to a focus, nearest first.
class UnvisitedNear {
public:
    UnvisitedNear(std::span<const LatticePoint> positions, int m);

    bool visited(std::uint32_t vertex) const { return visited_[vertex]; }
    void visit(std::uint32_t vertex) { visited_[vertex] = true; }
    // Sets candidates() as they are for the next boundary vertex of the fan: those among the `first_look` nearest, or,
    // to be called after that, the farther ones too.
    void look(const VisitedPositions& known, const FanState& fan, std::uint32_t focus);
    void look_farther(const VisitedPositions& known, const FanState& fan);
    std::span<const Candidate> candidates() const { return {candidates_.data(), count_}; }

private:
    void add_candidate(const VisitedPositions& known, const FanState& fan, std::uint32_t vertex);

    std::span<const LatticePoint> positions_;
    NearestOrder order_;
    std::size_t m_;
    std::vector<bool> visited_;
    std::uint32_t focus_;  // whose nearest vertices `nearest_` holds
    std::size_t found_ = 0, looked_ = 0, count_ = 0;
    std::array<std::uint32_t, mtfan_max_nearest> nearest_;
    std::array<Candidate, mtfan_max_nearest> candidates_;
};

// Codes whether the next boundary vertex is the candidate at this place, knowing that it is none before.
template <class Coder>
bool code_is_it(Coder& coder, DistanceOrderModels& models, std::span<const Candidate> candidates, std::size_t place,
                const FanState& fan, bool wanted) {
    const std::uint32_t stage = fan.current == OpenEdges::none                   ? 0
                                : fan.behind == OpenEdges::none                  ? 1
                                : fan.end_count == 0 || fan.ends[0] == fan.start ? 2
                                                                                 : 3;
    const Candidate& candidate = candidates[place];
    std::uint32_t better_before = 0, better_after = 0;
    for (std::size_t i = 0; i < candidates.size(); ++i)
        if (i != place && candidates[i].misfit < candidate.misfit) ++(i < place ? better_before : better_after);
    const std::uint32_t at = static_cast<std::uint32_t>(std::min<std::size_t>(place, 7));
    const std::uint32_t left = static_cast<std::uint32_t>(std::min<std::size_t>(candidates.size() - place, 8)) - 1;
    better_after = std::min(better_after, 3u);
    better_before = std::min(better_before, 3u);
    const double m = candidate.misfit;
    const std::uint32_t fit = m < -0.3  ? 0
                              : m < 0   ? 1
                              : m < 0.3 ? 2
                              : m < 0.6 ? 3
                              : m < 1   ? 4
                              : m < 1.5 ? 5
                              : m < 3   ? 6
                                        : 7;
    const std::uint32_t rank = better_after * 4 + stage;
    auto& is_it = models.is_it;
    return code_mixed(
        coder, models.mixer[rank * 4 + better_before],
        std::array<BinaryModel*, 4>{&is_it[0][(rank * 8 + at) * 8 + left],
                                    &is_it[1][(rank * 16 + candidate.turn) * 8 + candidate.distance],
                                    &is_it[2][((rank * 8 + fit) * 4 + better_before) * 4 + std::min(left, 3u)],
                                    &is_it[3][(rank * 16 + candidate.turn) * 8 + fit]},
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
            if (code_is_it(coder, models, candidates, place, fan, candidates[place].vertex == wanted)) return place;
        if (round == 0) unvisited.look_farther(known, fan);
    }
    return place;
}

}  // namespace htvm
