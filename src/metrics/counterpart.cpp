#include "metrics/counterpart.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "core/disjoint_sets.h"
#include "core/parallel.h"

namespace htvm {

using namespace internal;
namespace {

constexpr std::size_t grain = 512;

// What is known of a triangle by its middle.
enum class Middle : std::uint8_t { covered, beyond_border, uncovered };

// Whether the other surface ends or goes on where a patch leaves what is covered; or the patch leaves nothing.
enum class Verdict : std::uint8_t { covered, absent, displaced, alone };

std::vector<Middle> middles(const SearchedSurface& own, const SearchedSurface& other, double within, Threads threads) {
    const Mesh& mesh = own.mesh();
    std::vector<Middle> out(mesh.triangles.size());
    parallel_for(out.size(), threads, grain, [&](std::size_t begin, std::size_t end) {
        std::uint32_t hint = 0;
        for (std::size_t t = begin; t < end; ++t) {
            const auto& v = mesh.triangles[t];
            const Point3 sum =
                to_point(mesh.positions[v[0]]) + to_point(mesh.positions[v[1]]) + to_point(mesh.positions[v[2]]);
            const NearestPlace nearest = other.nearest(sum * (1.0 / 3), hint);
            out[t] = nearest.distance <= within ? Middle::covered
                     : nearest.on_border        ? Middle::beyond_border
                                                : Middle::uncovered;
        }
    });
    return out;
}

// Two triangles with an edge in common.
struct Neighbours {
    std::uint32_t first, second;
};

// Pairs of triangles at an edge; of many at one edge, each with the next, which hangs them together.
std::vector<Neighbours> neighbours_in(const Mesh& mesh) {
    struct Side {
        std::uint32_t low, high, triangle;
    };
    const auto place = first_coincident_vertex(mesh);
    std::vector<Side> sides;
    sides.reserve(3 * mesh.triangles.size());
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::size_t i = 0; i < 3; ++i) {
            const auto& v = mesh.triangles[t];
            const auto [low, high] = std::minmax({place[v[i]], place[v[(i + 1) % 3]]});
            if (low != high) sides.push_back({low, high, t});
        }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
        return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
    });
    std::vector<Neighbours> out;
    for (std::size_t i = 1; i < sides.size(); ++i)
        if (sides[i].low == sides[i - 1].low && sides[i].high == sides[i - 1].high)
            out.push_back({sides[i - 1].triangle, sides[i].triangle});
    return out;
}

// Each triangle has the verdict of the patch that it belongs to.
std::vector<Verdict> verdicts(const Mesh& mesh, const std::vector<Middle>& middle) {
    struct Rim {
        std::size_t sides = 0, ending = 0;
    };
    DisjointSets patches(middle.size());
    const auto pairs = neighbours_in(mesh);
    for (const auto& [a, b] : pairs)
        if (middle[a] != Middle::covered && middle[b] != Middle::covered) patches.join(a, b);
    std::vector<Rim> rims(middle.size());  // by the patch's name
    for (const auto& [a, b] : pairs) {
        if ((middle[a] == Middle::covered) == (middle[b] == Middle::covered)) continue;
        const std::uint32_t left = middle[a] == Middle::covered ? b : a;
        Rim& rim = rims[patches.of(left)];
        ++rim.sides;
        rim.ending += middle[left] == Middle::beyond_border;
    }
    std::vector<Verdict> out(middle.size(), Verdict::covered);
    for (std::uint32_t t = 0; t < middle.size(); ++t) {
        if (middle[t] == Middle::covered) continue;
        const Rim& rim = rims[patches.of(t)];
        out[t] = rim.sides == 0 ? Verdict::alone : 2 * rim.ending >= rim.sides ? Verdict::absent : Verdict::displaced;
    }
    return out;
}

Presence presence_beyond(const NearestPlace& nearest, Verdict of_triangle, const SearchedSurface& own, double within,
                         std::uint32_t& own_hint) {
    if (nearest.on_border || of_triangle == Verdict::absent) return Presence::absent;
    if (of_triangle != Verdict::alone) return Presence::displaced;
    return own.nearest(nearest.place, own_hint).distance <= within ? Presence::absent : Presence::displaced;
}

}  // namespace

Result<SearchedSurface> SearchedSurface::build(const Mesh& mesh, Threads threads) {
    SearchedSurface out(mesh);
    if (mesh.triangles.empty()) return out;
    auto index = TriangleIndex::build(mesh, threads);
    if (!index) return tl::unexpected(index.error());
    out.index_.push_back(std::move(*index));
    return out;
}

NearestPlace SearchedSurface::nearest(const Point3& p, std::uint32_t& hint) const {
    hint = index_.front().closest(p, hint).triangle;
    const Triangle& t = mesh_->triangles[hint];
    const Point3 a = to_point(mesh_->positions[t[0]]), b = to_point(mesh_->positions[t[1]]),
                 c = to_point(mesh_->positions[t[2]]);
    const auto found = closest_on_triangle(p, a, b, c);
    return {point_at(found.shares, a, b, c), hint, std::sqrt(found.squared_distance), border_.has(hint, found.shares)};
}

std::vector<Counterpart> counterparts(std::span<const SurfaceSample> samples, const SearchedSurface& own,
                                      const SearchedSurface& other, double within, Threads threads) {
    std::vector<Counterpart> out(samples.size());
    if (other.is_empty()) {
        for (std::size_t i = 0; i < samples.size(); ++i)
            out[i] = {Presence::absent, false, std::numeric_limits<double>::infinity(), samples[i].place};
        return out;
    }
    const auto verdict = verdicts(own.mesh(), middles(own, other, within, threads));
    parallel_for(samples.size(), threads, grain, [&](std::size_t begin, std::size_t end) {
        std::uint32_t hint = 0, own_hint = 0;
        for (std::size_t i = begin; i < end; ++i) {
            const NearestPlace nearest = other.nearest(samples[i].place, hint);
            Counterpart& found = out[i];
            found.distance = nearest.distance;
            found.nearest = nearest.place;
            found.presence = nearest.distance <= within
                                 ? Presence::covered
                                 : presence_beyond(nearest, verdict[samples[i].triangle], own, within, own_hint);
            found.counts = !nearest.on_border && found.presence != Presence::absent;
        }
    });
    return out;
}

}  // namespace htvm
