// What encoder and decoder of surface levels share: the walk from the base to the finest level, what each vertex is
// expected to be, and the contexts of its displacement.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "codec/intra/surface_levels.h"
#include "entropy/mixing.h"
#include "entropy/models.h"

namespace htvm::internal {

// What is known round a displacement before it is coded, as classes.
struct DisplacementContext {
    static constexpr std::size_t levels = 6, besides = 10, aboves = 10, bends = 8, trends = 7;
    std::size_t level = 0;
    std::size_t beside = 0;  // how large those of the same level are in the triangles beside its edge; 0: none is known
    std::size_t above = 0;   // how large those of its edge's ends are, and of the corners across it
    std::size_t bend = 0;    // how far off its edge's middle it is expected, over the step
    std::size_t trend = 3;   // which way those beside it go, 3: neither
};

struct DisplacementModels {
    template <std::size_t N>
    using Models = std::array<BinaryModel, N>;
    using C = DisplacementContext;

    // Whether other than zero.
    Models<C::levels * C::besides> by_beside{};
    Models<C::levels * C::aboves> by_above{};
    Models<C::besides * C::aboves> by_both{};
    Models<C::levels * C::bends> by_bend{};
    Models<C::trends * C::bends> by_trend{};
    std::array<Mixer<5>, C::levels> nonzero_mixer{};
    // Whether negative.
    Models<C::trends * C::levels> sign_by_trend{};
    Models<C::levels * C::bends> sign_by_bend{};
    std::array<Mixer<2>, C::levels> sign_mixer{};
    // The magnitude less one: in unary, from `unary` on as an exponential Golomb code.
    static constexpr std::size_t unary = 14;
    std::array<Models<unary>, C::levels * C::besides> more_by_beside{};
    std::array<Models<unary>, C::levels * C::aboves> more_by_above{};
    std::array<Models<unary>, C::levels * C::bends> more_by_bend{};
    std::array<Mixer<3>, unary> more_mixer{};
    Models<32> top{};
};

inline constexpr std::int32_t most_displacement = 1 << 20;  // of a quantised one's magnitude

// Codes a quantised displacement. Coder: as the coders of entropy/models.h, also with a cost counter behind it.
template <class Coder>
std::int32_t code_displacement(Coder& coder, DisplacementModels& m, const DisplacementContext& c, std::int32_t wanted) {
    using C = DisplacementContext;
    const auto at_level = [&](std::size_t classes, std::size_t own) { return c.level * classes + own; };
    const std::array<BinaryModel*, 5> nonzero = {
        &m.by_beside[at_level(C::besides, c.beside)], &m.by_above[at_level(C::aboves, c.above)],
        &m.by_both[c.beside * C::aboves + c.above], &m.by_bend[at_level(C::bends, c.bend)],
        &m.by_trend[c.trend * C::bends + c.bend]};
    if (!code_mixed(coder, m.nonzero_mixer[c.level], nonzero, wanted != 0)) return 0;
    const std::array<BinaryModel*, 2> signs = {&m.sign_by_trend[c.level * C::trends + c.trend],
                                               &m.sign_by_bend[at_level(C::bends, c.bend)]};
    const bool negative = code_mixed(coder, m.sign_mixer[c.level], signs, wanted < 0);
    const auto rest = static_cast<std::uint32_t>(std::max(std::abs(wanted), 1) - 1);
    std::uint32_t coded = 0;
    while (coded < DisplacementModels::unary) {
        const std::array<BinaryModel*, 3> more = {&m.more_by_beside[at_level(C::besides, c.beside)][coded],
                                                  &m.more_by_above[at_level(C::aboves, c.above)][coded],
                                                  &m.more_by_bend[at_level(C::bends, c.bend)][coded]};
        if (!code_mixed(coder, m.more_mixer[coded], more, rest > coded)) break;
        ++coded;
    }
    if (coded == DisplacementModels::unary) {
        const std::uint32_t left = std::max(rest, coded) - coded + 1;
        const int width = static_cast<int>(std::bit_width(left)) - 1;
        int top = 0;
        while (top < 20 && coder.bit(m.top[static_cast<std::size_t>(top)], top < width)) ++top;
        const std::uint32_t low = coder.raw(left & ((1u << top) - 1), top);
        coded += ((1u << top) | low) - 1;
    }
    const auto magnitude = static_cast<std::int32_t>(std::min(coded, static_cast<std::uint32_t>(most_displacement) - 1)) + 1;
    return negative ? -magnitude : magnitude;
}

// Codes the header's numbers.
template <class Coder>
SurfaceLevels code_levels_header(Coder& coder, const SurfaceLevels& wanted) {
    SurfaceLevels out;
    out.levels = coder.raw(wanted.levels, 4);
    out.step = coder.raw(wanted.step - 1, 20) + 1;
    out.coarser = coder.raw(wanted.coarser - 1, 4) + 1;
    out.longest_edge = coder.raw(wanted.longest_edge - 1, 20) + 1;
    return out;
}
template <class Coder>
SubdivisionRule code_rule(Coder& coder, const SubdivisionRule& wanted) {
    SubdivisionRule out;
    out.butterfly = coder.raw(wanted.butterfly, 4);
    out.tangents = coder.raw(wanted.tangents, 4);
    return out;
}

// Everything that is known of a surface while its levels are coded.
struct LevelsWalk {
    explicit LevelsWalk(const LatticeMesh& base);

    std::vector<LatticePoint> positions;
    std::vector<Triangle> triangles;
    std::vector<std::int32_t> values;  // quantised displacement of each vertex; of the base's: zero, as they say nothing
                                       // of what is below
    // The level at hand. New vertices are numbered from `first` on in the order of their edges.
    std::size_t first = 0;
    MeshEdges edges;
    std::vector<std::uint32_t> split;           // the edges that are split
    std::vector<EdgeStencil> stencils;          // of each
    std::vector<std::uint32_t> vertex_of_edge;  // or no_element
    std::vector<Vector3d> normals;              // of the vertices above
    std::vector<Vector3d> expected, normal;     // of each new vertex
    DisplacementModels models;

    // Finds what is split to make a level, 1 or more, from what is there. False, with nothing changed, if there would be
    // more vertices than these.
    bool begin_level(const SurfaceLevels& levels, std::uint32_t level, std::size_t most_vertices);
    // Where the new vertices are expected by this rule.
    void expect(const SubdivisionRule& rule);
    // Cuts the triangles; all new vertices are in their places.
    void end_level();

    DisplacementContext context_of(std::size_t i, std::uint32_t level, std::uint32_t step) const;
};

// Codes how the base's vertices are moved. choose(vertex, normal, step, context) gives the value that is wanted;
// decoding, anything.
template <class Coder, class Choose>
void code_base_displacements(Coder& coder, LevelsWalk& walk, const SurfaceLevels& levels, const Choose& choose) {
    const auto normals = vertex_normals(walk.positions, walk.triangles);
    const auto step = step_at(levels, 0);
    for (std::size_t v = 0; v < walk.positions.size(); ++v) {
        const DisplacementContext context;
        const auto value = code_displacement(coder, walk.models, context, choose(v, normals[v], step, context));
        walk.positions[v] = displaced_vertex(to_vector(walk.positions[v]), normals[v], value, step);
    }
}

// Codes the displacements of the level at hand, which has begun and is expected.
template <class Coder, class Choose>
void code_level_displacements(Coder& coder, LevelsWalk& walk, const SurfaceLevels& levels, std::uint32_t level,
                              const Choose& choose) {
    const auto step = step_at(levels, level);
    for (std::size_t i = 0; i < walk.split.size(); ++i) {
        const auto context = walk.context_of(i, level, step);
        const auto value = code_displacement(coder, walk.models, context, choose(i, step, context));
        walk.values.push_back(value);
        walk.positions.push_back(displaced_vertex(walk.expected[i], walk.normal[i], value, step));
    }
}

}  // namespace htvm::internal
