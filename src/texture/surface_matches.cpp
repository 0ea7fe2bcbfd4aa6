#include "texture/surface_matches.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>
#include <unordered_map>

#include "core/disjoint_sets.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "surface/surface_index.h"

namespace htvm {

using namespace internal;

std::vector<std::array<std::uint32_t, 3>> triangles_beside(std::span<const Triangle> triangles) {
    constexpr auto none = SurfaceMatch::nothing;
    std::vector<std::array<std::uint32_t, 3>> out(triangles.size(), {none, none, none});
    std::unordered_map<std::uint64_t, std::uint32_t> open;
    open.reserve(2 * triangles.size());
    for (std::uint32_t t = 0; t < triangles.size(); ++t)
        for (std::uint32_t i = 0; i < 3; ++i) {
            const auto a = triangles[t][i], b = triangles[t][(i + 1) % 3];
            const auto [at, is_new] = open.emplace(std::uint64_t{std::min(a, b)} << 32 | std::max(a, b), 3 * t + i);
            if (is_new) continue;
            out[t][i] = at->second / 3;
            out[at->second / 3][at->second % 3] = t;
            open.erase(at);
        }
    return out;
}

namespace {

// Least dot products of two normals that face the same way: at all, and without a doubt.
constexpr float agreement = 0.35F, good_agreement = 0.8F;

// The decoded surface, with points spread over it so that the nearest of these is near the nearest of all, however
// large its triangles are.
struct Samples {
    std::vector<Point3f> points, normals;
    std::vector<std::uint32_t> triangle;
    float gap = 0;
};

Samples samples_of(const MatchedSurface& surface, std::span<const Vector3d> face_normals) {
    constexpr double wanted = 50000;
    double doubled = 0;
    for (const auto& t : surface.triangles) doubled += length(area_vector(surface.positions, t));
    Samples out;
    const double gap = std::max(std::sqrt(doubled / wanted), 1e-6);  // of triangles that have half a square each
    out.gap = static_cast<float>(gap);
    for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
        const auto& [i, j, k] = surface.triangles[t];
        const auto a = to_vector(surface.positions[i]), b = to_vector(surface.positions[j]),
                   c = to_vector(surface.positions[k]);
        const double longest = std::max({length(b - a), length(c - b), length(a - c)});
        constexpr double most = 24;
        const int parts = static_cast<int>(std::clamp(std::ceil(longest / gap), 1.0, most));
        // The middles of the parts' triangles: those that stand as the whole does, and those between them.
        for (int u = 0; u < parts; ++u)
            for (int v = 0; u + v < parts; ++v)
                for (const double third : {1.0, 2.0}) {
                    if (third > 1.5 && u + v + 2 > parts) continue;
                    const double s = (u + third / 3) / parts, r = (v + third / 3) / parts;
                    out.points.push_back(to_floats(point_at({1 - s - r, s, r}, a, b, c)));
                    out.normals.push_back(to_floats(face_normals[t]));
                    out.triangle.push_back(t);
                }
    }
    return out;
}

// Follows the decoded surface from a triangle to its point that is nearest to p, over triangles that face as wanted.
class Walk {
public:
    // reach: how far off a point may be.
    Walk(const MatchedSurface& surface, std::span<const Vector3d> face_normals, double reach)
        : surface_(surface), face_normals_(face_normals), reach_(reach) {}

    SurfaceMatch from(std::uint32_t triangle, const Vector3d& p, const Vector3d& normal, int most_steps) const {
        auto best = closest_in(triangle, p);
        for (int step = 0; step < most_steps; ++step) {
            const auto here = triangle;
            const auto shares = best.shares;
            for (std::size_t i = 0; i < 3; ++i) {
                const auto beside = surface_.beside[here][i];
                // Across an edge only where the closest point lies on it.
                if (beside == SurfaceMatch::nothing || shares[(i + 2) % 3] > 0 || !faces(beside, normal)) continue;
                const auto there = closest_in(beside, p);
                if (there.squared_distance < best.squared_distance) best = there, triangle = beside;
            }
            if (triangle == here) break;
        }
        const double distance = std::sqrt(best.squared_distance);
        if (!faces(triangle, normal) || distance > reach_) return {};
        // A right angle counts as much as a third of the reach.
        const double doubt = distance + reach_ / 3 * (1 - facing(triangle, normal));
        SurfaceMatch out;
        out.triangle = triangle;
        for (std::size_t i = 0; i < 3; ++i) out.shares[i] = static_cast<float>(best.shares[i]);
        out.distance = static_cast<float>(distance);
        out.doubt = static_cast<float>(doubt);
        return out;
    }

private:
    // The dot product of the normals; of what has none, as if it faced as wanted.
    double facing(std::uint32_t triangle, const Vector3d& normal) const {
        const auto& own = face_normals_[triangle];
        return own == Vector3d{} || normal == Vector3d{} ? 1 : dot(own, normal);
    }
    bool faces(std::uint32_t triangle, const Vector3d& normal) const {
        return facing(triangle, normal) >= static_cast<double>(agreement);
    }
    TrianglePoint closest_in(std::uint32_t triangle, const Vector3d& p) const {
        const auto& [a, b, c] = surface_.triangles[triangle];
        return closest_on_triangle(p, to_vector(surface_.positions[a]), to_vector(surface_.positions[b]),
                                   to_vector(surface_.positions[c]));
    }
    const MatchedSurface& surface_;
    std::span<const Vector3d> face_normals_;
    double reach_;
};

// For each captured vertex the first at the same place: captures repeat vertices at the seams of their textures.
std::vector<std::uint32_t> first_at_place(std::span<const Vector3f> positions) {
    std::vector<std::uint32_t> order(positions.size()), out(positions.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return positions[a] != positions[b] ? positions[a] < positions[b] : a < b;
    });
    for (std::size_t i = 0; i < order.size(); ++i)
        out[order[i]] = i > 0 && positions[order[i]] == positions[order[i - 1]] ? out[order[i - 1]] : order[i];
    return out;
}

float median_distance(std::span<const SurfaceMatch> matches) {
    std::vector<float> distances;
    for (const auto& match : matches)
        if (match.found()) distances.push_back(match.distance);
    if (distances.empty()) return 0;
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    return *middle;
}

// The captured surface, its vertices at one place being one.
struct WeldedCapture {
    std::vector<std::uint32_t> first;  // of each vertex the first at its place
    VerticesAround around;             // of these
};

WeldedCapture welded(const Mesh& captured) {
    WeldedCapture out{first_at_place(captured.positions), {}};
    auto triangles = captured.triangles;
    for (auto& t : triangles)
        for (auto& v : t) v = out.first[v];
    out.around = vertices_around(captured.positions.size(), triangles);
    return out;
}

// Whether the two triangles are one, or have a corner in common.
bool touch(const Triangle& a, const Triangle& b) {
    return std::any_of(a.begin(), a.end(), [&](std::uint32_t v) { return v == b[0] || v == b[1] || v == b[2]; });
}

// Which vertices are surely where they are: those of large pieces within which neighbours are matched beside each
// other.
std::vector<bool> settled(const WeldedCapture& capture, const MatchedSurface& decoded,
                          std::span<const SurfaceMatch> own) {
    DisjointSets pieces(own.size());
    for (std::uint32_t v = 0; v < own.size(); ++v) {
        if (!own[v].found()) continue;
        const auto& here = decoded.triangles[own[v].triangle];
        for (const auto w : capture.around.of(v))
            if (w < v && own[w].found() && touch(here, decoded.triangles[own[w].triangle])) pieces.join(v, w);
    }
    std::vector<std::uint32_t> sizes(own.size(), 0);
    for (std::uint32_t v = 0; v < own.size(); ++v)
        if (capture.first[v] == v && own[v].found()) ++sizes[pieces.of(v)];
    constexpr std::size_t least_share = 20;  // of what all have, for a piece to be large
    std::vector<bool> out(own.size());
    for (std::uint32_t v = 0; v < own.size(); ++v)
        out[v] = own[v].found() && least_share * sizes[pieces.of(v)] >= own.size();
    return out;
}

// Grows from the surest matches over the captured surface. A vertex is given what its neighbour's match leads to unless
// its own is nearer by more than matches usually are off.
std::vector<SurfaceMatch> continued(const Mesh& captured, std::span<const Vector3d> normals,
                                    const MatchedSurface& decoded, const Walk& walk, std::vector<SurfaceMatch> own,
                                    double reach) {
    const auto capture = welded(captured);
    const auto is_settled = settled(capture, decoded, own);
    const float slack = std::max(2 * median_distance(own), static_cast<float>(reach) / 30);
    struct Offer {
        float doubt;
        std::uint32_t vertex;
        SurfaceMatch match;
        bool operator<(const Offer& other) const {
            return doubt != other.doubt ? doubt > other.doubt : vertex > other.vertex;
        }
    };
    std::priority_queue<Offer> offers;
    std::vector<SurfaceMatch> out(own.size());
    constexpr int most_steps = 12;
    const auto offer_from = [&](std::uint32_t v) {
        for (const auto w : capture.around.of(v)) {
            if (out[w].found()) continue;
            const auto next = walk.from(out[v].triangle, to_vector(captured.positions[w]), normals[w], most_steps);
            if (next.found() && (!own[w].found() || next.doubt <= own[w].doubt + slack))
                offers.push({next.doubt, w, next});
        }
    };
    for (std::uint32_t v = 0; v < own.size(); ++v)
        if (is_settled[v]) out[v] = own[v];
    for (std::uint32_t v = 0; v < own.size(); ++v) {
        if (capture.first[v] != v) continue;
        if (is_settled[v])
            offer_from(v);
        else if (own[v].found())
            offers.push({own[v].doubt + slack, v, own[v]});
    }
    while (!offers.empty()) {
        const auto offer = offers.top();
        offers.pop();
        if (out[offer.vertex].found()) continue;
        out[offer.vertex] = offer.match;
        offer_from(offer.vertex);
    }
    for (std::size_t v = 0; v < out.size(); ++v)
        if (capture.first[v] != v) out[v] = out[capture.first[v]];
    return out;
}

}  // namespace

std::vector<SurfaceMatch> surface_matches(const Mesh& captured, const MatchedSurface& decoded, double reach,
                                          Threads threads) {
    std::vector<Vector3d> face_normals;
    face_normals.reserve(decoded.triangles.size());
    for (const auto& t : decoded.triangles) face_normals.push_back(normalised(area_vector(decoded.positions, t)));
    const auto samples = samples_of(decoded, face_normals);
    const OrientedPoints index(samples.points, samples.normals, 2 * samples.gap);
    const Walk walk(decoded, face_normals, reach);
    auto normals = vertex_normals(captured.positions, captured.triangles);
    if (captured.normals.size() == captured.positions.size())
        for (std::size_t v = 0; v < normals.size(); ++v) normals[v] = to_vector(captured.normals[v]);
    std::vector<SurfaceMatch> own(captured.positions.size());
    const auto nearest = [&](std::size_t v, float facing, std::uint32_t& guess) -> SurfaceMatch {
        constexpr int most_steps = 8;
        const auto found = index.nearest(captured.positions[v], to_floats(normals[v]),
                                         static_cast<float>(reach) + samples.gap, facing, guess);
        if (!found.found) return {};
        guess = found.index;
        return walk.from(samples.triangle[found.index], to_vector(captured.positions[v]), normals[v], most_steps);
    };
    const auto least_doubt = static_cast<float>(reach / 3 * (1 - static_cast<double>(good_agreement)));
    constexpr std::size_t in_a_row = 512;
    // Guesses must not depend on how threads cut the range.
    parallel_for((own.size() + in_a_row - 1) / in_a_row, threads, 2, [&](std::size_t begin, std::size_t end) {
        for (std::size_t row = begin; row < end; ++row) {
            auto guess = OrientedPoints::no_point;
            for (std::size_t v = row * in_a_row; v < std::min(own.size(), (row + 1) * in_a_row); ++v) {
                own[v] = nearest(v, agreement, guess);
                // Where it faces another way, what faces the same way may be it though it lies farther off.
                if (own[v].found() && own[v].doubt - own[v].distance <= least_doubt) continue;
                if (auto other = nearest(v, good_agreement, guess);
                    other.found() && (!own[v].found() || other.doubt < own[v].doubt))
                    own[v] = other;
            }
        }
    });
    return continued(captured, normals, decoded, walk, std::move(own), reach);
}

}  // namespace htvm
