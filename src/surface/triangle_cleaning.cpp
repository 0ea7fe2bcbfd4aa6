#include "surface/triangle_cleaning.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "core/geometry.h"

namespace htvm::internal {
namespace {

struct PlaceHash {
    std::size_t operator()(const LatticePoint& p) const {
        std::uint64_t h = 0;
        for (const auto c : {p.x, p.y, p.z}) h = (h ^ static_cast<std::uint32_t>(c)) * 0x9e3779b97f4a7c15u;
        return static_cast<std::size_t>(h ^ (h >> 32));
    }
};

// The triangles with places instead of vertices.
std::vector<Triangle> at_places(std::span<const LatticePoint> positions, std::span<const Triangle> triangles) {
    std::unordered_map<LatticePoint, std::uint32_t, PlaceHash> known;
    known.reserve(positions.size());
    std::vector<std::uint32_t> place;
    place.reserve(positions.size());
    for (const auto& p : positions)
        place.push_back(known.emplace(p, static_cast<std::uint32_t>(place.size())).first->second);
    std::vector<Triangle> out;
    out.reserve(triangles.size());
    for (const auto& t : triangles) out.push_back({place[t[0]], place[t[1]], place[t[2]]});
    return out;
}

bool is_collapsed(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

// Numbers 0, 1, ... in groups of the same place: sorting within these few takes a fraction of sorting all.
struct Groups {
    std::vector<std::uint32_t> begin;  // of each place's group in `members`, and the end
    std::vector<std::uint32_t> members;
    std::span<std::uint32_t> of(std::size_t place) {
        return std::span(members).subspan(begin[place], begin[place + 1] - begin[place]);
    }
};

Groups grouped(const std::vector<std::uint32_t>& place_of, std::size_t places) {
    Groups out{std::vector<std::uint32_t>(places + 1), std::vector<std::uint32_t>(place_of.size())};
    for (const auto place : place_of) ++out.begin[place + 1];
    for (std::size_t p = 0; p < places; ++p) out.begin[p + 1] += out.begin[p];
    auto next = out.begin;
    for (std::uint32_t i = 0; i < place_of.size(); ++i) out.members[next[place_of[i]]++] = i;
    return out;
}

// Which triangles have the corners of one before them.
std::vector<bool> find_doubled(const std::vector<Triangle>& triangles, std::size_t places) {
    std::vector<Triangle> sorted = triangles;
    std::vector<std::uint32_t> smallest;
    smallest.reserve(triangles.size());
    for (auto& t : sorted) {
        std::sort(t.begin(), t.end());
        smallest.push_back(t[0]);
    }
    auto groups = grouped(smallest, places);
    std::vector<bool> out(triangles.size());
    for (std::size_t place = 0; place < places; ++place) {
        const auto group = groups.of(place);
        std::sort(group.begin(), group.end(),
                  [&](std::uint32_t a, std::uint32_t b) { return std::tie(sorted[a], a) < std::tie(sorted[b], b); });
        for (std::size_t i = 1; i < group.size(); ++i)
            out[group[i]] = sorted[group[i]] == sorted[group[i - 1]] && !is_collapsed(sorted[group[i]]);
    }
    return out;
}

// Neighbours across edges; of like winding two triangles go along theirs in opposite directions.
struct Neighbours {
    struct One {
        std::uint32_t triangle;
        bool wound_alike;
    };
    std::array<One, 3> all{};
    std::uint8_t count = 0;
};

// Across each of a triangle's edges that exactly two triangles share.
std::vector<Neighbours> find_neighbours(const std::vector<Triangle>& triangles, const std::vector<bool>& left_out,
                                        std::size_t places) {
    struct Edge {
        std::uint32_t high, triangle;
        bool upwards;
    };
    std::vector<Edge> edges;
    std::vector<std::uint32_t> low;
    edges.reserve(3 * triangles.size());
    low.reserve(3 * triangles.size());
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
        if (left_out[t] || is_collapsed(triangles[t])) continue;
        for (std::size_t i = 0; i < 3; ++i) {
            const auto from = triangles[t][i], to = triangles[t][(i + 1) % 3];
            low.push_back(std::min(from, to));
            edges.push_back({std::max(from, to), t, from < to});
        }
    }
    auto groups = grouped(low, places);
    std::vector<Neighbours> out(triangles.size());
    for (std::size_t place = 0; place < places; ++place) {
        const auto group = groups.of(place);
        std::sort(group.begin(), group.end(), [&](std::uint32_t a, std::uint32_t b) {
            return std::tie(edges[a].high, a) < std::tie(edges[b].high, b);
        });
        for (std::size_t begin = 0, end = 0; begin < group.size(); begin = end) {
            while (end < group.size() && edges[group[end]].high == edges[group[begin]].high) ++end;
            if (end - begin != 2) continue;
            const auto &a = edges[group[begin]], &b = edges[group[begin + 1]];
            auto &of_a = out[a.triangle], &of_b = out[b.triangle];
            of_a.all[of_a.count++] = {b.triangle, a.upwards != b.upwards};
            of_b.all[of_b.count++] = {a.triangle, a.upwards != b.upwards};
        }
    }
    return out;
}

Vector3d area_of(std::span<const LatticePoint> positions, const Triangle& t) {
    const auto side = [&](std::size_t i) {
        const auto d = positions[t[i]] - positions[t[0]];
        return Vector3d{1.0 * d.x, 1.0 * d.y, 1.0 * d.z};
    };
    return cross(side(1), side(2));
}

// A connected piece of the surface whose triangles are turned alike.
struct Piece {
    std::vector<std::uint32_t> triangles;
    bool was_doubled = false;
};

// Whether all of a piece should be turned once more. turned: what already is, by triangle.
bool faces_wrongly(const Piece& piece, std::span<const LatticePoint> positions, std::span<const Triangle> triangles,
                   const std::vector<bool>& turned) {
    double kept = 0, other = 0;
    Vector3d middle{};
    for (const auto t : piece.triangles) {
        (turned[t] ? other : kept) += length(area_of(positions, triangles[t]));
        const auto& p = positions[triangles[t][0]];
        middle = middle + Vector3d{1.0 * p.x, 1.0 * p.y, 1.0 * p.z};
    }
    constexpr double doubtful = 0.6;
    if (!piece.was_doubled && std::max(kept, other) > doubtful * (kept + other)) return other > kept;
    middle = middle * (1.0 / static_cast<double>(piece.triangles.size()));
    double outwards = 0;
    for (const auto t : piece.triangles) {
        const auto& p = positions[triangles[t][0]];
        const double volume = dot(area_of(positions, triangles[t]), Vector3d{1.0 * p.x, 1.0 * p.y, 1.0 * p.z} - middle);
        outwards += turned[t] ? -volume : volume;
    }
    return outwards < 0;
}

}  // namespace

CleanedTriangles clean_triangles(std::span<const LatticePoint> positions, std::span<const Triangle> triangles) {
    const auto places = at_places(positions, triangles);
    const auto doubled = find_doubled(places, positions.size());
    const auto neighbours = find_neighbours(places, doubled, positions.size());
    // Where sides were doubled, the first of each pair says nothing of which way the surface faces.
    const bool any_doubled = std::find(doubled.begin(), doubled.end(), true) != doubled.end();
    std::vector<bool> met(triangles.size()), turned(triangles.size());
    for (std::uint32_t first = 0; first < triangles.size(); ++first) {
        if (met[first] || doubled[first]) continue;
        Piece piece{{first}, any_doubled};
        met[first] = true;
        for (std::size_t at = 0; at < piece.triangles.size(); ++at) {
            const auto t = piece.triangles[at];
            for (const auto& [other, wound_alike] : std::span(neighbours[t].all).first(neighbours[t].count)) {
                if (met[other]) continue;
                met[other] = true;
                turned[other] = turned[t] == wound_alike;
                piece.triangles.push_back(other);
            }
        }
        if (!faces_wrongly(piece, positions, triangles, turned)) continue;
        for (const auto t : piece.triangles) turned[t] = !turned[t];
    }
    CleanedTriangles out;
    out.triangles.reserve(triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        out.doubled += doubled[t];
        if (doubled[t]) continue;
        out.turned += turned[t];
        auto triangle = triangles[t];
        if (turned[t]) std::swap(triangle[1], triangle[2]);
        out.triangles.push_back(triangle);
    }
    return out;
}

bool needs_cleaning(const CleanedTriangles& cleaned, std::size_t triangles) {
    constexpr std::size_t one_of = 100;
    return (cleaned.doubled + cleaned.turned) * one_of > triangles;
}

}  // namespace htvm::internal
