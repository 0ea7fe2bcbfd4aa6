#include "codec/paper/mtfan_distance_order.h"

#include <algorithm>

namespace htvm::internal {
namespace {

struct Vector {
    double x, y, z;
};

Vector between(LatticePoint from, LatticePoint to) {
    return {static_cast<double>(to.x - from.x), static_cast<double>(to.y - from.y), static_cast<double>(to.z - from.z)};
}
double dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vector cross(Vector a, Vector b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
Vector operator+(Vector a, Vector b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }

// The square of a cosine, with its sign: compared instead of cosines, so that no root is needed.
constexpr double signed_square(double cosine) { return cosine < 0 ? -cosine * cosine : cosine * cosine; }

// How many of the descending cosines the angle's cosine is below; 0 where a side has no length.
template <std::size_t N>
std::uint32_t count_below(Vector a, Vector b, const std::array<double, N>& squares) {
    const double product = dot(a, b), square = product < 0 ? -product * product : product * product;
    const double lengths = dot(a, a) * dot(b, b);
    std::uint32_t count = 0;
    for (const double limit : squares) count += square < limit * lengths;
    return count;
}

// Classes 1 .. 15 of a full turn from a to b around the normal: finer where small.
std::uint32_t turn_class(Vector a, Vector b, Vector normal) {
    constexpr std::array<double, 10> forward = {
        signed_square(0.94), signed_square(0.82),  signed_square(0.68),  signed_square(0.5),   signed_square(0.3),
        signed_square(0.08), signed_square(-0.17), signed_square(-0.42), signed_square(-0.71), signed_square(-0.9)};
    constexpr std::array<double, 3> folded = {signed_square(0.5), signed_square(-0.17), signed_square(-0.71)};
    if (dot(cross(a, b), normal) >= 0) return 1 + count_below(a, b, forward);
    return 15 - count_below(a, b, folded);
}

// Classes 1 .. 7 of an angle up to a half turn; 7 where it is more.
std::uint32_t angle_class(Vector a, Vector b, Vector normal) {
    constexpr std::array<double, 5> limits = {signed_square(0.76), signed_square(0.5), signed_square(0.2),
                                              signed_square(-0.17), signed_square(-0.5)};
    if (dot(cross(a, b), normal) < 0) return 7;
    return 1 + count_below(a, b, limits);
}

}  // namespace

FanHints VisitedPositions::hints(const FanState& fan) const {
    FanHints hints;
    if (fan.behind == OpenEdges::none || fan.end_count == 0 || fan.ends[0] == fan.start) return hints;
    const LatticePoint focus = points_[fan.focus], at = points_[fan.current], end = points_[fan.ends[0]];
    const Vector to_current = between(focus, at), to_end = between(focus, end);
    Vector normal = cross(between(focus, points_[fan.behind]), to_current);
    if (fan.beyond_end != OpenEdges::none) normal = normal + cross(to_end, between(focus, points_[fan.beyond_end]));
    hints.gap = turn_class(to_current, to_end, normal);
    // At the current vertex the gap turns from the left vertex to the focus; at the end, from the focus to the right.
    if (fan.left != OpenEdges::none)
        hints.left = angle_class(between(at, points_[fan.left]), between(at, focus), normal);
    if (fan.right != OpenEdges::none)
        hints.right = angle_class(between(end, focus), between(end, points_[fan.right]), normal);
    return hints;
}

UnvisitedNear::UnvisitedNear(std::span<const LatticePoint> positions, int m, Threads threads)
    : positions_(positions),
      order_(positions),
      m_(static_cast<std::size_t>(m)),
      visited_(positions.size()),
      focus_(OpenEdges::none) {
    constexpr std::size_t worth_threads = 4096;
    if (threads.count < 2 || positions.size() < worth_threads || m_ < first_look) return;
    threads_ = threads;
    first_nearest_.resize(positions.size() * first_look);
}

void UnvisitedNear::search_ahead() {
    constexpr std::size_t block = 64;
    for (std::size_t begin = 0; begin < positions_.size() && !traversed_; begin += block) {
        const std::size_t end = std::min(begin + block, positions_.size());
        for (std::size_t v = begin; v < end; ++v)
            order_.find(static_cast<std::uint32_t>(v), std::span(first_nearest_).subspan(v * first_look, first_look));
        searched_.store(end, std::memory_order_release);
    }
}

void UnvisitedNear::look(const VisitedPositions& known, const FanState& fan, std::uint32_t focus) {
    if (focus != focus_) {
        focus_ = focus;
        if (focus >= searched_.load(std::memory_order_acquire)) {
            looked_ = found_ = order_.find(focus, std::span(nearest_).first(std::min(first_look, m_)));
        } else {
            looked_ = found_ = first_look;
            std::copy_n(first_nearest_.begin() + static_cast<std::ptrdiff_t>(std::size_t{focus} * first_look),
                        first_look, nearest_.begin());
        }
    }
    count_ = 0;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < found_; ++i)
        if (!visited_[nearest_[i]]) nearest_[kept++] = nearest_[i];
    found_ = kept;
    for (std::size_t i = 0; i < found_; ++i) add_candidate(known, fan, nearest_[i]);
}

void UnvisitedNear::look_farther(const VisitedPositions& known, const FanState& fan) {
    if (looked_ < first_look || looked_ >= m_) return;
    std::array<std::uint32_t, mtfan_max_nearest> all;
    const std::size_t found = order_.find(focus_, std::span(all).first(m_));
    for (std::size_t i = looked_; i < found; ++i) {
        if (visited_[all[i]]) continue;
        nearest_[found_++] = all[i];
        add_candidate(known, fan, all[i]);
    }
    looked_ = m_;
}

void UnvisitedNear::add_candidate(const VisitedPositions& known, const FanState& fan, std::uint32_t vertex) {
    const LatticePoint centre = positions_[focus_], point = positions_[vertex];
    const LatticePoint at = fan.current == OpenEdges::none ? centre : known[fan.current];
    const Vector side = between(centre, at), to_it = between(centre, point), from_current = between(at, point);
    const Vector face = cross(side, to_it);
    const double area = dot(face, face), product = dot(to_it, from_current);
    Candidate& candidate = candidates_[count_++];
    candidate.vertex = vertex;
    candidate.misfit = area > 0 ? (product < 0 ? -product * product : product * product) / area : 1e12;
    if (fan.behind == OpenEdges::none) return;
    const Vector normal = cross(between(centre, known[fan.behind]), side);
    if (dot(face, normal) < 0) candidate.misfit = 1e13 - candidate.misfit;
}

CandidateClasses UnvisitedNear::classes(const VisitedPositions& known, const FanState& fan, std::size_t place) const {
    CandidateClasses classes;
    constexpr std::array<double, 7> fits = {-0.09, 0, 0.09, 0.36, 1, 2.25, 9};
    for (const double limit : fits) classes.fit += candidates_[place].misfit >= limit;
    for (std::size_t i = 0; i < count_; ++i)
        if (candidates_[i].misfit < candidates_[place].misfit)
            ++(i < place ? classes.better_before : classes.better_after);
    classes.better_before = std::min(classes.better_before, 3u);
    classes.better_after = std::min(classes.better_after, 3u);
    classes.place = static_cast<std::uint32_t>(std::min<std::size_t>(place, 7));
    classes.left = static_cast<std::uint32_t>(std::min<std::size_t>(count_ - place - 1, 7));
    if (fan.current == OpenEdges::none) return classes;
    classes.stage = 1;
    const LatticePoint centre = positions_[focus_], at = known[fan.current];
    const LatticePoint point = positions_[candidates_[place].vertex];
    const Vector side = between(centre, at), to_it = between(centre, point), from_current = between(at, point);
    constexpr std::array<double, 7> ratios = {0.4, 0.7, 1.0, 1.45, 2.0, 3.0, 5.0};
    const double from = dot(from_current, from_current), to = dot(to_it, to_it);
    for (const double ratio : ratios) classes.distance += from >= ratio * to;
    if (fan.behind == OpenEdges::none) return classes;
    classes.stage = fan.end_count == 0 || fan.ends[0] == fan.start ? 2 : 3;
    classes.turn = turn_class(side, to_it, cross(between(centre, known[fan.behind]), side));
    return classes;
}

}  // namespace htvm::internal
