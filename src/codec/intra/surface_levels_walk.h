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

// The models that predict each decision of a displacement.
namespace displacement_detail {

using C = DisplacementContext;
inline std::size_t at_level(const C& c, std::size_t classes, std::size_t own) { return c.level * classes + own; }

inline std::array<BinaryModel*, 5> nonzero(DisplacementModels& m, const C& c) {
    return {&m.by_beside[at_level(c, C::besides, c.beside)], &m.by_above[at_level(c, C::aboves, c.above)],
            &m.by_both[c.beside * C::aboves + c.above], &m.by_bend[at_level(c, C::bends, c.bend)],
            &m.by_trend[c.trend * C::bends + c.bend]};
}

inline std::array<BinaryModel*, 2> negative(DisplacementModels& m, const C& c) {
    return {&m.sign_by_trend[at_level(c, C::trends, c.trend)], &m.sign_by_bend[at_level(c, C::bends, c.bend)]};
}

inline std::array<BinaryModel*, 3> more(DisplacementModels& m, const C& c, std::size_t i) {
    return {&m.more_by_beside[at_level(c, C::besides, c.beside)][i],
            &m.more_by_above[at_level(c, C::aboves, c.above)][i], &m.more_by_bend[at_level(c, C::bends, c.bend)][i]};
}

}  // namespace displacement_detail

// Codes a quantised displacement. Coder: as the coders of entropy/models.h, also with a cost counter behind it.
template <class Coder>
std::int32_t code_displacement(Coder& coder, DisplacementModels& m, const DisplacementContext& c, std::int32_t wanted) {
    using namespace displacement_detail;
    if (!code_mixed(coder, m.nonzero_mixer[c.level], nonzero(m, c), wanted != 0)) return 0;
    const bool below_zero = code_mixed(coder, m.sign_mixer[c.level], negative(m, c), wanted < 0);
    const auto rest = static_cast<std::uint32_t>(std::max(std::abs(wanted), 1) - 1);
    std::uint32_t coded = 0;
    while (coded < DisplacementModels::unary && code_mixed(coder, m.more_mixer[coded], more(m, c, coded), rest > coded))
        ++coded;
    if (coded == DisplacementModels::unary) {
        const std::uint32_t left = std::max(rest, coded) - coded + 1;
        const int width = static_cast<int>(std::bit_width(left)) - 1;
        int top = 0;
        while (top < 20 && coder.bit(m.top[static_cast<std::size_t>(top)], top < width)) ++top;
        const std::uint32_t low = coder.raw(left & ((1u << top) - 1), top);
        coded += ((1u << top) | low) - 1;
    }
    const auto magnitude =
        static_cast<std::int32_t>(std::min(coded, static_cast<std::uint32_t>(most_displacement) - 1)) + 1;
    return below_zero ? -magnitude : magnitude;
}

// The payload of these runs, of the base's displacements first.
std::vector<std::uint8_t> write_surface_levels(const SurfaceLevels& levels,
                                               std::span<const std::vector<std::uint8_t>> runs);

// The vertices of a level before they are moved.
class ExpectedLevel {
public:
    // The base, which must outlive this.
    explicit ExpectedLevel(const LatticeMesh& base)
        : positions_(base.positions), normals_(vertex_normals(base.positions, base.triangles)) {}
    // positions: of the levels above, to which those of this one may be added meanwhile; they and the level outlive
    // this. triangles: of the level above.
    ExpectedLevel(const SubdivisionLevel& level, const std::vector<LatticePoint>& positions,
                  std::span<const Triangle> triangles, const SubdivisionRule& rule)
        : level_(&level), positions_(positions), rule_(rule), normals_(vertex_normals(positions, triangles)) {}

    std::size_t size() const { return level_ ? level_->stencils.size() : normals_.size(); }
    struct Vertex {
        Vector3d at;
        double bent = 0;  // squared, how far off the middle of its edge it is expected; 0 for the base
    };
    Vertex vertex(std::size_t i) const {
        if (!level_) return {to_vector(positions_[i])};
        const auto& stencil = level_->stencils[i];
        const Vector3d at = expected_vertex(positions_, normals_, stencil, rule_);
        const Vector3d off = at - (to_vector(positions_[stencil.a]) + to_vector(positions_[stencil.b])) * 0.5;
        return {at, dot(off, off)};
    }
    // Along which it is displaced.
    Vector3d normal(std::size_t i) const {
        if (!level_) return normals_[i];
        const auto& stencil = level_->stencils[i];
        return normalised(normals_[stencil.a] + normals_[stencil.b]);
    }
    const std::vector<Vector3d>& normals_above() const { return normals_; }  // of the base, its own

private:
    const SubdivisionLevel* level_ = nullptr;
    const std::vector<LatticePoint>& positions_;
    SubdivisionRule rule_;
    std::vector<Vector3d> normals_;
};

// Adds the level that rounds off. edges: of the finest level so far. False if there would be more vertices than these;
// then the surface is as it was.
bool round_off(const SurfaceLevels& levels, const MeshEdges& edges, std::size_t most_vertices, LeveledSurface& surface);

// The context of vertex i of a level. values: quantised displacements of the vertices before it; those of the base
// count as zero, since what a coarse base leaves says nothing of what is below.
DisplacementContext displacement_context(const SubdivisionLevel& level, std::size_t i, std::uint32_t number,
                                         std::span<const std::int32_t> values, double bent, std::uint32_t step);

// Codes the displacements of a level, whose number is 0 for the base, and moves its vertices, which are added to those
// of the surface. level: null for the base. values: quantised, of the vertices so far. choose(i, context) gives the
// value that is wanted; decoding, anything.
template <class Coder, class Choose>
void code_displacements(Coder& coder, DisplacementModels& models, const SubdivisionLevel* level, std::uint32_t number,
                        const ExpectedLevel& expected, std::uint32_t step, LeveledSurface& surface,
                        std::vector<std::int32_t>& values, const Choose& choose) {
    surface.positions.reserve(surface.positions.size() + expected.size());
    surface.displacements.reserve(surface.displacements.size() + expected.size());
    values.reserve(values.size() + expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
        const auto vertex = expected.vertex(i);
        const auto context =
            level ? displacement_context(*level, i, number, values, vertex.bent, step) : DisplacementContext{};
        const auto value = code_displacement(coder, models, context, choose(i, context));
        values.push_back(level ? value : 0);
        // Most are not displaced, and then the normal need not be known.
        const double displacement = displacement_of(value, step);
        surface.displacements.push_back(displacement);
        surface.positions.push_back(
            displaced_vertex(vertex.at, value != 0 ? expected.normal(i) : Vector3d{}, displacement));
    }
}

}  // namespace htvm::internal
