#include "codec/simplified_reference_enc.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "codec/tracked_targets_enc.h"
#include "geometry/simplification.h"

namespace htvm {
namespace {

// One vertex for all in the same place, with the first one's colour: else the two sides of a seam, as of a texture's
// chart, would be simplified apart, and gape.
LatticeMesh welded(const LatticeMesh& captured) {
    const std::size_t vertices = captured.positions.size();
    std::vector<std::uint32_t> by_place(vertices), number(vertices);
    std::iota(by_place.begin(), by_place.end(), 0u);
    const auto place = [&](std::uint32_t v) {
        return std::tuple(captured.positions[v].x, captured.positions[v].y, captured.positions[v].z);
    };
    std::sort(by_place.begin(), by_place.end(),
              [&](std::uint32_t a, std::uint32_t b) { return place(a) != place(b) ? place(a) < place(b) : a < b; });
    for (std::size_t i = 0; i < vertices; ++i) {
        const bool again = i > 0 && captured.positions[by_place[i]] == captured.positions[by_place[i - 1]];
        number[by_place[i]] = again ? number[by_place[i - 1]] : by_place[i];
    }
    LatticeMesh out;
    for (std::uint32_t v = 0; v < vertices; ++v) {
        if (number[v] != v) {
            number[v] = number[number[v]];  // an earlier one, numbered already
            continue;
        }
        number[v] = static_cast<std::uint32_t>(out.positions.size());
        out.positions.push_back(captured.positions[v]);
        if (!captured.colours.empty()) out.colours.push_back(captured.colours[v]);
    }
    for (const auto& [a, b, c] : captured.triangles) out.triangles.push_back({number[a], number[b], number[c]});
    return out;
}

LatticeMesh with_fewer_vertices(const LatticeMesh& captured, const SimplifiedReferenceOptions& options) {
    std::vector<Eigen::Vector3d> points;
    points.reserve(captured.positions.size());
    for (const auto p : captured.positions) points.emplace_back(p.x, p.y, p.z);
    SimplificationOptions simplification;
    simplification.surface_error = options.surface_error;
    simplification.colour_error = options.colour_error;
    simplification.longest_edge = options.longest_edge;
    auto simplified = simplify(points, captured.triangles, captured.colours, simplification);
    LatticeMesh out;
    const auto whole = [](double c) { return within_lattice(std::llround(c)); };
    for (const auto& p : simplified.positions) out.positions.push_back({whole(p.x()), whole(p.y()), whole(p.z())});
    out.triangles = std::move(simplified.triangles);
    const auto level = [](double c) { return static_cast<std::uint8_t>(std::lround(std::clamp(c, 0.0, 255.0))); };
    for (const auto& c : simplified.colours) out.colours.push_back({level(c[0]), level(c[1]), level(c[2])});
    return out;
}

// Vertices and colours where the triangles between them come nearest to the captured surface: after the collapses each
// vertex was placed for itself alone.
void fit_to_surface(LatticeMesh& mesh, const LatticeMesh& captured, const TargetSurface& surface,
                    const SimplifiedReferenceOptions& options) {
    const auto normals = exact_normals(mesh.positions, mesh.triangles);
    const auto targets = find_tracked_targets({mesh.positions, normals, mesh.triangles, mesh.colours}, captured,
                                              surface, options.reach, options.threads);
    mesh.positions = displaced(mesh.positions, normals, targets.displacement);
    if (!mesh.colours.empty()) mesh.colours = recoloured(mesh.colours, targets.colours);
}

}  // namespace

LatticeMesh simplified_reference(const LatticeMesh& captured, const TargetSurface& surface,
                                 const SimplifiedReferenceOptions& options) {
    if (captured.triangles.empty() || !captured.texcoords.empty()) return captured;
    auto out = with_fewer_vertices(welded(captured), options);
    fit_to_surface(out, captured, surface, options);
    if (!captured.normals.empty()) out.normals = quantised_normals(exact_normals(out.positions, out.triangles));
    return out;
}

}  // namespace htvm
