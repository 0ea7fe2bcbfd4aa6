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

// Which triangles have the corners of one before them.
std::vector<bool> find_doubled(const std::vector<Triangle>& triangles) {
    struct Corners {
        Triangle sorted;
        std::uint32_t triangle;
    };
    std::vector<Corners> all;
    all.reserve(triangles.size());
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
        auto sorted = triangles[t];
        std::sort(sorted.begin(), sorted.end());
        if (!is_collapsed(triangles[t])) all.push_back({sorted, t});
    }
    std::sort(all.begin(), all.end(), [](const Corners& a, const Corners& b) {
        return std::tie(a.sorted, a.triangle) < std::tie(b.sorted, b.triangle);
    });
    std::vector<bool> out(triangles.size());
    for (std::size_t i = 1; i < all.size(); ++i) out[all[i].triangle] = all[i].sorted == all[i - 1].sorted;
    return out;
}

// A neighbour across an edge; of like winding the two go along it in opposite directions.
struct Neighbour {
    std::uint32_t triangle;
    bool wound_alike;
};

// Across each of a triangle's edges that exactly two triangles share.
std::vector<std::vector<Neighbour>> find_neighbours(const std::vector<Triangle>& triangles,
                                                    const std::vector<bool>& left_out) {
    struct Edge {
        std::uint32_t low, high, triangle;
        bool upwards;
    };
    std::vector<Edge> edges;
    edges.reserve(3 * triangles.size());
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
        if (left_out[t] || is_collapsed(triangles[t])) continue;
        for (std::size_t i = 0; i < 3; ++i) {
            const auto from = triangles[t][i], to = triangles[t][(i + 1) % 3];
            edges.push_back({std::min(from, to), std::max(from, to), t, from < to});
        }
    }
    std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
        return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
    });
    std::vector<std::vector<Neighbour>> out(triangles.size());
    for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
        while (end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high) ++end;
        if (end - begin != 2) continue;
        const auto &a = edges[begin], &b = edges[begin + 1];
        out[a.triangle].push_back({b.triangle, a.upwards != b.upwards});
        out[b.triangle].push_back({a.triangle, a.upwards != b.upwards});
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
    const auto doubled = find_doubled(places);
    const auto neighbours = find_neighbours(places, doubled);
    // Where sides were doubled, the first of each pair says nothing of which way the surface faces.
    const bool any_doubled = std::find(doubled.begin(), doubled.end(), true) != doubled.end();
    std::vector<bool> met(triangles.size()), turned(triangles.size());
    for (std::uint32_t first = 0; first < triangles.size(); ++first) {
        if (met[first] || doubled[first]) continue;
        Piece piece{{first}, any_doubled};
        met[first] = true;
        for (std::size_t at = 0; at < piece.triangles.size(); ++at) {
            const auto t = piece.triangles[at];
            for (const auto& [other, wound_alike] : neighbours[t]) {
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
