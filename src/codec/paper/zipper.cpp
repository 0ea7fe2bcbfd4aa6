#include "codec/paper/zipper.h"

#include <algorithm>

#include "codec/paper/zipper_stitch.h"
#include "codec/paper/zipper_trim.h"

namespace htvm::internal {
namespace {

using namespace zipping;

template <class Value>
void join_attribute(const std::vector<Value>& coded, const std::vector<Value>& animated, const LatticeMesh& from_coded,
                    const LatticeMesh& from_animated, std::span<const std::uint32_t> used, std::vector<Value>& out) {
    if (coded.size() != from_coded.positions.size() || animated.size() != from_animated.positions.size()) return;
    out = coded;
    out.reserve(coded.size() + used.size());
    for (const std::uint32_t v : used) out.push_back(animated[v]);
}

// The coded mesh, the kept part of the animated one and the stitches, in which animated vertices come after coded ones.
LatticeMesh join(const LatticeMesh& coded, const LatticeMesh& animated, std::span<const std::uint8_t> kept,
                 std::span<const Triangle> stitches) {
    const auto first = static_cast<std::uint32_t>(coded.positions.size());
    std::vector<std::uint32_t> number(animated.positions.size(), none), used;
    for (std::size_t t = 0; t < kept.size(); ++t)
        if (kept[t])
            for (const std::uint32_t v : animated.triangles[t]) number[v] = 0;
    for (std::uint32_t v = 0; v < number.size(); ++v)
        if (number[v] == 0) {
            number[v] = first + static_cast<std::uint32_t>(used.size());
            used.push_back(v);
        }
    LatticeMesh out;
    join_attribute(coded.positions, animated.positions, coded, animated, used, out.positions);
    join_attribute(coded.colours, animated.colours, coded, animated, used, out.colours);
    join_attribute(coded.normals, animated.normals, coded, animated, used, out.normals);
    join_attribute(coded.texcoords, animated.texcoords, coded, animated, used, out.texcoords);
    out.triangles = coded.triangles;
    out.triangles.reserve(coded.triangles.size() + animated.triangles.size() + stitches.size());
    for (std::size_t t = 0; t < kept.size(); ++t)
        if (kept[t]) {
            const Triangle& c = animated.triangles[t];
            out.triangles.push_back({number[c[0]], number[c[1]], number[c[2]]});
        }
    for (Triangle t : stitches) {
        for (std::uint32_t& v : t)
            if (v >= first) v = number[v - first];
        out.triangles.push_back(t);
    }
    return out;
}

std::vector<Triangle> stitches(const Surface& coded, const Surface& animated, const Trimmed& trimmed, double unit) {
    const auto first = static_cast<std::uint32_t>(coded.positions.size());
    std::vector<LatticePoint> positions(coded.positions.begin(), coded.positions.end());
    positions.insert(positions.end(), animated.positions.begin(), animated.positions.end());
    std::vector<std::uint8_t> at_border(positions.size());
    const auto sides = [&](const Surface& surface, std::span<const TriangleSide> from, std::uint32_t offset) {
        std::vector<BorderSide> out;
        for (const TriangleSide& s : from) {
            const Triangle& t = surface.triangles[s.triangle];
            const std::uint32_t a = t[s.side] + offset, b = t[(s.side + 1) % 3] + offset;
            at_border[a] = at_border[b] = 1;
            out.push_back({b, a, normal_of(surface.positions, t)});
        }
        return out;
    };
    const std::vector<BorderSide> coded_sides = sides(coded, trimmed.coded_seam, 0);
    const std::vector<BorderSide> animated_sides = sides(animated, trimmed.animated_cut, first);
    const std::span<const std::uint8_t> wanted(at_border);
    std::vector<Direction> normals = vertex_normals(coded.positions, coded.triangles, wanted.first(first));
    const std::vector<Direction> of_animated =
        vertex_normals(animated.positions, animated.triangles, wanted.subspan(first));
    normals.insert(normals.end(), of_animated.begin(), of_animated.end());
    std::vector<Triangle> around;
    std::vector<std::uint32_t> cut;
    const auto near = [&](const Triangle& t) { return at_border[t[0]] + at_border[t[1]] + at_border[t[2]] >= 2; };
    for (const Triangle& t : coded.triangles)
        if (near(t)) around.push_back(t);
    for (std::size_t t = 0; t < trimmed.kept.size(); ++t) {
        if (!trimmed.kept[t]) continue;
        const Triangle& c = animated.triangles[t];
        const Triangle moved = {c[0] + first, c[1] + first, c[2] + first};
        if (!near(moved)) continue;
        cut.push_back(static_cast<std::uint32_t>(around.size()));
        around.push_back(moved);
    }
    return stitch({positions, normals, first, coded_sides, animated_sides, around, cut, unit});
}

}  // namespace

LatticeMesh zipper(const LatticeMesh& coded, const LatticeMesh& animated, std::span<const std::uint8_t> still,
                   Threads threads) {
    if (coded.triangles.empty())
        return join(coded, animated, std::vector<std::uint8_t>(animated.triangles.size(), 1), {});
    const Surface coded_surface{coded.positions, coded.triangles},
        animated_surface{animated.positions, animated.triangles};
    const double unit = mean_side(coded_surface, animated_surface);
    if (!(unit > 0)) return join(coded, animated, {}, {});
    const Trimmed trimmed = trim(coded_surface, animated_surface, still, unit, threads);
    return join(coded, animated, trimmed.kept, stitches(coded_surface, animated_surface, trimmed, unit));
}

}  // namespace htvm::internal
