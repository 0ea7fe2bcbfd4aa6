#include "codec/mtfan_distance_order.h"

#include <algorithm>

namespace htvm {
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

// Cosine of the angle; 1 where a side has no length.
double cosine(Vector a, Vector b) {
    const double lengths = dot(a, a) * dot(b, b);
    return lengths > 0 ? dot(a, b) / std::sqrt(lengths) : 1;
}

// Classes 1 .. 15 of a full turn from a to b around the normal: finer where small.
std::uint32_t turn_class(Vector a, Vector b, Vector normal) {
    constexpr std::array<double, 10> cosines = {0.94, 0.82, 0.68, 0.5, 0.3, 0.08, -0.17, -0.42, -0.71, -0.9};
    const double c = cosine(a, b);
    std::uint32_t k = 0;
    if (dot(cross(a, b), normal) >= 0) {
        while (k < cosines.size() && c < cosines[k]) ++k;
        return 1 + k;  // up to 11
    }
    return c < -0.71 ? 12 : c < -0.17 ? 13 : c < 0.5 ? 14 : 15;
}

// Classes 1 .. 7 of an angle up to a half turn; 7 where it is more.
std::uint32_t angle_class(Vector a, Vector b, Vector normal) {
    if (dot(cross(a, b), normal) < 0) return 7;
    const double c = cosine(a, b);
    return c > 0.76 ? 1 : c > 0.5 ? 2 : c > 0.2 ? 3 : c > -0.17 ? 4 : c > -0.5 ? 5 : 6;
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

UnvisitedNear::UnvisitedNear(std::span<const LatticePoint> positions, int m)
    : positions_(positions),
      order_(positions),
      m_(static_cast<std::size_t>(m)),
      visited_(positions.size()),
      focus_(OpenEdges::none) {}

void UnvisitedNear::look(const VisitedPositions& known, const FanState& fan, std::uint32_t focus) {
    if (focus != focus_) {
        looked_ = found_ = order_.find(focus, std::span(nearest_).first(std::min(first_look, m_)));
        focus_ = focus;
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
    const bool has_side = fan.current != OpenEdges::none && fan.behind != OpenEdges::none;
    const LatticePoint at = fan.current == OpenEdges::none ? centre : known[fan.current];
    const Vector side = between(centre, at), to_it = between(centre, point), from_current = between(at, point);
    const Vector face = cross(side, to_it);
    Candidate& candidate = candidates_[count_++];
    candidate = {vertex, 0, 0, 0};
    const double area = std::sqrt(dot(face, face));
    candidate.misfit = area > 0 ? dot(to_it, from_current) / area : 1e6;
    if (has_side) {
        const Vector normal = cross(between(centre, known[fan.behind]), side);
        if (dot(face, normal) < 0) candidate.misfit = 1e7 - candidate.misfit;
        candidate.turn = turn_class(side, to_it, normal);
    }
    constexpr std::array<double, 7> ratios = {0.4, 0.7, 1.0, 1.45, 2.0, 3.0, 5.0};
    const double from = dot(from_current, from_current), to = dot(to_it, to_it);
    while (candidate.distance < ratios.size() && from >= ratios[candidate.distance] * to) ++candidate.distance;
}

}  // namespace htvm
