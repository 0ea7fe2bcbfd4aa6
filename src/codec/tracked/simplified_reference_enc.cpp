#include "codec/tracked/simplified_reference_enc.h"

#include <algorithm>
#include <cmath>

#include "codec/intra/duplicates.h"
#include "codec/tracked/tracked_targets_enc.h"
#include "surface/simplification.h"

namespace htvm::internal {
namespace {

// One vertex for all in the same place, with the first one's colour: else the two sides of a seam, as of a texture's
// chart, would be simplified apart, and gape.
LatticeMesh welded(const LatticeMesh& captured) {
    LatticeMesh places;
    places.positions = captured.positions;
    const auto merging = find_duplicates(places);
    auto out = kept_vertices(captured, merging.kept);
    out.triangles = merged_triangles(captured.triangles, merging, false);
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

}  // namespace htvm::internal
