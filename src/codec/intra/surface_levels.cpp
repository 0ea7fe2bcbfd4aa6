#include "codec/intra/surface_levels.h"

#include "codec/intra/surface_levels_walk.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

// The class of a magnitude or of a sum of some, growing with its logarithm.
std::size_t magnitude_class(std::uint64_t quarters, std::size_t classes) {
    constexpr std::array<std::uint32_t, 8> above = {0, 2, 4, 7, 11, 18, 32, 60};
    std::size_t out = 0;
    for (const auto threshold : above) out += quarters > threshold;
    return std::min(out, classes - 1);
}

std::size_t bend_class(double squared, std::uint32_t step) {
    // In eighths of the step, squared: classes are a factor of two apart, without a root.
    const double unit = static_cast<double>(step) / (8 << displacement_bits);
    const double in_eighths = squared / (unit * unit);
    std::size_t out = 0;
    for (double limit = 1; out + 1 < DisplacementContext::bends && in_eighths >= limit; limit *= 4) ++out;
    return out;
}

}  // namespace

std::uint32_t step_at(const SurfaceLevels& levels, std::uint32_t level) {
    std::uint32_t step = levels.step;
    for (std::uint32_t k = levels.levels; k > level; --k) step = (step * levels.coarser + 8) / 16;
    return std::max(step, 1u);
}

std::int64_t longest_edge_above(const SurfaceLevels& levels, std::uint32_t level) {
    return std::int64_t{levels.longest_edge} << (levels.levels - level);
}

LatticePoint displaced_vertex(const Vector3d& expected, const Vector3d& normal, std::int32_t value,
                              std::uint32_t step) {
    const double distance = static_cast<double>(value) * static_cast<double>(step) / (1 << displacement_bits);
    // To the nearest, halves up: cutting off rounds down once what is below zero is corrected.
    const auto along = [&](std::size_t i) {
        const double moved = expected[i] + normal[i] * distance + 0.5;
        const auto whole = static_cast<std::int64_t>(moved);
        return within_lattice(whole - (moved < static_cast<double>(whole)));
    };
    return {along(0), along(1), along(2)};
}

LevelsWalk::LevelsWalk(const LatticeMesh& base)
    : positions(base.positions), triangles(base.triangles), values(base.positions.size(), 0) {}

bool LevelsWalk::begin_level(const SurfaceLevels& levels, std::uint32_t level, std::size_t most_vertices) {
    first = positions.size();
    edges = find_edges(first, triangles);
    const std::int64_t longest = longest_edge_above(levels, level);
    split.clear();
    vertex_of_edge.assign(edges.size(), no_element);
    for (std::uint32_t e = 0; e < edges.size(); ++e) {
        if (squared_distance(positions[edges.ends[e][0]], positions[edges.ends[e][1]]) <= longest * longest) continue;
        vertex_of_edge[e] = static_cast<std::uint32_t>(first + split.size());
        split.push_back(e);
    }
    if (split.size() > most_vertices - std::min(first, most_vertices)) return false;
    stencils = edge_stencils(first, triangles, edges, split);
    normals = vertex_normals(positions, triangles);
    return true;
}

void LevelsWalk::expect(const SubdivisionRule& rule) {
    expected.clear();
    normal.clear();
    for (const auto& stencil : stencils) {
        expected.push_back(predicted_vertex(positions, normals, stencil, rule));
        normal.push_back(normalised(normals[stencil.a] + normals[stencil.b]));
    }
}

void LevelsWalk::end_level() { triangles = split_triangles(triangles, edges, vertex_of_edge); }

DisplacementContext LevelsWalk::context_of(std::size_t i, std::uint32_t level, std::uint32_t step) const {
    DisplacementContext out;
    out.level = std::min<std::size_t>(level, DisplacementContext::levels - 1);
    const auto magnitude = [&](std::uint32_t v) {
        return static_cast<std::uint64_t>(std::min(std::abs(values[v]), 64));
    };
    const auto& stencil = stencils[i];
    std::uint64_t above = 2 * (magnitude(stencil.a) + magnitude(stencil.b));
    for (const auto v : stencil.across)
        if (v != no_element) above += magnitude(v);
    out.above = magnitude_class(above, DisplacementContext::aboves);
    // Those of the level that come before it, in the triangles beside its edge.
    std::uint64_t sum = 0;
    std::int64_t signed_sum = 0, count = 0;
    const auto own = split[i];
    for (const auto t : edges.triangles[own]) {
        if (t == no_element) continue;
        for (const auto e : edges.of_triangle[t]) {
            if (e >= own || vertex_of_edge[e] == no_element) continue;
            const auto v = vertex_of_edge[e];
            ++count;
            sum += magnitude(v);
            signed_sum += std::clamp(values[v], -64, 64);
        }
    }
    if (count > 0) {
        out.beside = 1 + magnitude_class(4 * sum / static_cast<std::uint64_t>(count), DisplacementContext::besides - 1);
        const std::int64_t mean = 2 * signed_sum / count;
        const std::int64_t size = mean == 0 ? 0 : std::abs(mean) < 2 ? 1 : std::abs(mean) < 5 ? 2 : 3;
        out.trend = static_cast<std::size_t>(3 + (mean < 0 ? -size : size));
    }
    const Vector3d off = expected[i] - (to_vector(positions[stencil.a]) + to_vector(positions[stencil.b])) * 0.5;
    out.bend = bend_class(dot(off, off), step);
    return out;
}

Result<LeveledSurface> decode_surface_levels(std::span<const std::uint8_t> run, const LatticeMesh& base,
                                             std::size_t most_vertices) {
    RangeDecoder decoder(run);
    ReadingCoder<RangeDecoder> coder{decoder};
    auto levels = code_levels_header(coder, {});
    if (levels.levels > most_levels) return fail(ErrorKind::corrupt_stream, "surface levels: too many levels");
    LevelsWalk walk(base);
    const auto nothing = [](auto&&...) { return 0; };
    code_base_displacements(coder, walk, levels, nothing);
    for (std::uint32_t k = 1; k <= levels.levels && !decoder.exhausted(); ++k) {
        const auto rule = code_rule(coder, {});
        if (!walk.begin_level(levels, k, most_vertices))
            return fail(ErrorKind::limit, "surface levels: more vertices than may be decoded");
        walk.expect(rule);
        code_level_displacements(coder, walk, levels, k, nothing);
        walk.end_level();
    }
    if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "surface levels: the run ends too early");
    return LeveledSurface{std::move(walk.positions), std::move(walk.triangles)};
}

}  // namespace htvm::internal
