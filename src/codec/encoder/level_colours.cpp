#include "codec/encoder/level_colours.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/geometry.h"
#include "entropy/cost.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

struct Wanted {
    std::array<double, 3> colour;
    bool known = false;
};

// What the capture's colours are beside each of the detail's vertices.
std::vector<Wanted> wanted_colours(const LatticeMesh& mesh, const LatticeMesh& captured, const SurfaceIndex& surface,
                                   std::size_t coded, double reach, Threads threads, const SurfaceDetail& detail) {
    auto positions = mesh.positions;
    add_detail(detail, coded, mesh.triangles, positions);
    const auto normals = vertex_normals(positions, detail.triangles(coded));
    const std::size_t first = mesh.positions.size(), count = positions.size() - first;
    std::vector<std::uint32_t> near(count, OrientedPoints::no_point);
    const auto points = points_of(positions);
    const auto facing = points_of(normals);
    const auto found = closest_facing(surface, std::span(points).subspan(first), std::span(facing).subspan(first),
                                      {.reach = static_cast<float>(reach), .along = true}, threads, near);
    std::vector<Wanted> out(count);
    for (std::size_t i = 0; i < count; ++i) {
        if (!found[i].found()) continue;
        out[i].known = true;
        const auto& t = captured.triangles[found[i].triangle];
        for (std::size_t corner = 0; corner < 3; ++corner)
            for (std::size_t c = 0; c < 3; ++c)
                out[i].colour[c] +=
                    static_cast<double>(found[i].shares[corner]) * static_cast<double>(captured.colours[t[corner]][c]);
    }
    return out;
}

// The difference in whole steps that is nearest, and what it leaves, in squared steps.
struct Nearest {
    ColourDifference difference{};
    double left = 0, left_by_none = 0;
};
Nearest nearest_to(const Wanted& wanted, const Colour& mean, std::int32_t step) {
    Nearest out;
    const auto steps = [&](std::size_t c) {
        return (wanted.colour[c] - static_cast<double>(mean[c])) / static_cast<double>(step);
    };
    const double red = steps(0), green = steps(1), blue = steps(2);
    auto& d = out.difference;
    d[0] = static_cast<std::int32_t>(std::lround(green));
    d[1] = static_cast<std::int32_t>(std::lround(red)) - d[0];
    d[2] = static_cast<std::int32_t>(std::lround(blue)) - d[0];
    const auto squared = [](double x) { return x * x; };
    out.left = squared(green - d[0]) + squared(red - d[0] - d[1]) + squared(blue - d[0] - d[2]);
    out.left_by_none = squared(green) + squared(red) + squared(blue);
    return out;
}

}  // namespace

std::vector<std::uint8_t> encode_level_colours(const LatticeMesh& mesh, const LatticeMesh& captured,
                                               const SurfaceIndex& surface, std::size_t coded,
                                               const LevelColourOptions& options, SurfaceDetail& detail) {
    const auto wanted = wanted_colours(mesh, captured, surface, coded, options.reach, options.threads, detail);
    LevelColours colours(mesh.colours);
    const auto models = std::make_unique<LevelColourModels>(), trial = std::make_unique<LevelColourModels>();
    const auto bits_of = [&](const LevelColourContext& context, const ColourDifference& difference) {
        CostCounter counter;
        WritingCoder<CostCounter> coder{counter};
        *trial = *models;
        code_level_colour(coder, *trial, context, difference);
        return counter.bits();
    };
    const auto chosen = [&](const EdgeStencil& stencil, const LevelColourContext& context) {
        const auto& want = wanted[detail.colours.size()];
        if (!want.known) return ColourDifference{};
        const auto near = nearest_to(want, level_colour(stencil, colours.all, {}, options.step), options.step);
        // A difference takes some bits at least, so most need not be priced.
        if (near.difference == ColourDifference{} || near.left_by_none - near.left <= 2 * options.lambda)
            return ColourDifference{};
        const double with = near.left + options.lambda * bits_of(context, near.difference);
        return with < near.left_by_none + options.lambda * bits_of(context, {}) ? near.difference : ColourDifference{};
    };
    std::vector<std::vector<std::uint8_t>> runs;
    for (std::size_t k = 0; k < coded; ++k) {
        RangeEncoder encoder;
        WritingCoder<RangeEncoder> coder{encoder};
        code_level_colours(coder, *models, k, options.step, colours, detail, chosen);
        runs.push_back(encoder.finish());
    }
    return write_level_colours(runs);
}

}  // namespace htvm::internal
