#include "codec/tracked/tracked_frame.h"

#include <algorithm>
#include <cmath>

#include "codec/reference/transforms.h"
#include "core/parallel.h"

namespace htvm::internal {
namespace {

NodeGraph graph_of(const DeformationNodes& nodes, const LatticeMesh& mesh) {
    NodeGraph out;
    out.lower.resize(nodes.vertex.size());
    for (const auto& pair : nodes.neighbours) out.lower[pair.second].push_back(pair.first);  // the pairs ascend
    const auto normals = vertex_normals(mesh.positions, mesh.triangles);
    for (const auto v : nodes.vertex) {
        out.pivots.push_back(mesh.positions[v]);
        out.normals.push_back(normals[v]);
    }
    return out;
}

}  // namespace

std::vector<LatticePoint> smoothed_within_cells(std::span<const LatticePoint> positions,
                                                std::span<const Triangle> triangles, std::int32_t quantiser_step) {
    struct Sum {
        std::int64_t x = 0, y = 0, z = 0, count = 0;
    };
    std::vector<Sum> around(positions.size());
    for (const auto& t : triangles)
        for (std::size_t i = 0; i < 3; ++i)
            for (const auto neighbour : {t[(i + 1) % 3], t[(i + 2) % 3]}) {
                auto& sum = around[t[i]];
                sum.x += positions[neighbour].x;
                sum.y += positions[neighbour].y;
                sum.z += positions[neighbour].z;
                ++sum.count;
            }
    const std::int64_t reach = quantiser_step / 2;
    std::vector<LatticePoint> out(positions.begin(), positions.end());
    const auto halfway = [&](std::int32_t own, std::int64_t sum, std::int64_t count) {
        const std::int64_t change = divide_rounded(sum - count * own, 2 * count);
        return within_lattice(own + std::clamp(change, -reach, reach));
    };
    for (std::size_t v = 0; v < out.size(); ++v) {
        const auto& sum = around[v];
        if (sum.count == 0) continue;
        out[v] = {halfway(positions[v].x, sum.x, sum.count), halfway(positions[v].y, sum.y, sum.count),
                  halfway(positions[v].z, sum.z, sum.count)};
    }
    return out;
}

Result<TrackedReference> make_tracked_reference(const LatticeMesh& mesh, std::int32_t node_spacing,
                                                std::int32_t quantiser_step, Threads threads) {
    TrackedReference out;
    out.mesh = mesh;
    out.mesh.positions = smoothed_within_cells(mesh.positions, mesh.triangles, quantiser_step);
    DeformationNodeOptions options;
    options.spacing = node_spacing;
    options.link_reach = std::max(node_spacing / 10, 1);
    Result<VertexHierarchy> hierarchy;
    parallel_invoke(
        threads, [&] { hierarchy = build_vertex_hierarchy(out.mesh.positions, out.mesh.triangles); },
        [&] { out.nodes = choose_deformation_nodes(out.mesh.positions, out.mesh.triangles, options); });
    out.graph = graph_of(out.nodes, out.mesh);
    if (!hierarchy) return tl::unexpected(hierarchy.error());
    out.hierarchy = std::move(*hierarchy);
    return out;
}

std::vector<LatticePoint> moved_by_nodes(const TrackedReference& reference,
                                         std::span<const QuantisedTransform> transforms, Threads threads) {
    const auto rotation = rotation_matrices(transforms);
    std::vector<LatticePoint> out(reference.mesh.positions.size());
    parallel_for(out.size(), threads, 8192, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v)
            out[v] = blended_move(reference.mesh.positions[v], reference.nodes.weights[v], rotation,
                                  reference.graph.pivots, transforms);
    });
    return out;
}

std::vector<LatticePoint> displaced(std::span<const LatticePoint> positions, std::span<const Vector3d> normals,
                                    std::span<const std::int32_t> displacement) {
    const auto along = [](std::int32_t own, double normal, double distance) {
        return within_lattice(own + static_cast<std::int64_t>(std::floor(normal * distance + 0.5)));
    };
    std::vector<LatticePoint> out;
    out.reserve(positions.size());
    for (std::size_t v = 0; v < positions.size(); ++v) {
        const double d = displacement[v];
        out.push_back({along(positions[v].x, normals[v][0], d), along(positions[v].y, normals[v][1], d),
                       along(positions[v].z, normals[v][2], d)});
    }
    return out;
}

std::vector<Colour> recoloured(std::span<const Colour> colours, std::span<const std::int32_t> residuals) {
    std::vector<Colour> out(colours.size());
    for (std::size_t v = 0; v < out.size(); ++v)
        for (std::size_t c = 0; c < 3; ++c)
            out[v][c] = static_cast<std::uint8_t>(std::clamp(colours[v][c] + residuals[3 * v + c], 0, 255));
    return out;
}

std::vector<QuantisedNormal> quantised_normals(std::span<const Vector3d> normals) {
    const auto quantised = [](double c) { return static_cast<std::int32_t>(std::floor(c * 127 + 0.5)); };
    std::vector<QuantisedNormal> out;
    out.reserve(normals.size());
    for (const auto& n : normals) out.push_back({quantised(n[0]), quantised(n[1]), quantised(n[2])});
    return out;
}

Result<void> decode_tracked_frame(const FramePayloadView& payload, const TrackedReference& reference,
                                  const TrackedState* before, Threads threads, DecodedTrackedFrame& out) {
    const auto& mesh = reference.mesh;
    if (payload.header.vertices != mesh.positions.size() || payload.header.triangles != mesh.triangles.size())
        return fail(ErrorKind::corrupt_stream, "tracked frame: it has other counts than its I-frame");
    auto transforms = decode_node_motion(
        payload.of(Layer::transforms), reference.graph,
        before ? std::span<const QuantisedTransform>(before->transforms) : std::span<const QuantisedTransform>{});
    if (!transforms) return tl::unexpected(transforms.error());
    out.state.transforms = std::move(*transforms);

    Result<void> colours;
    Result<DecodedField> displacement;
    parallel_invoke(
        threads,
        [&] {
            if (mesh.colours.empty()) return;
            auto field =
                decode_field(payload.of(Layer::colour), reference.hierarchy, 3, before ? &before->colour : nullptr);
            if (!field) {
                colours = tl::unexpected(field.error());
                return;
            }
            out.colours = recoloured(mesh.colours, field->values);
            out.state.colour = std::move(field->history);
        },
        [&] {
            displacement = decode_field(payload.of(Layer::geometry), reference.hierarchy, 1,
                                        before ? &before->displacement : nullptr);
            if (!displacement) return;
            const auto moved = moved_by_nodes(reference, out.state.transforms, {});
            out.positions = displaced(moved, vertex_normals(moved, mesh.triangles), displacement->values);
        });
    if (!colours) return tl::unexpected(colours.error());
    if (!displacement) return tl::unexpected(displacement.error());
    out.state.displacement = std::move(displacement->history);
    if (!mesh.normals.empty()) out.normals = quantised_normals(vertex_normals(out.positions, mesh.triangles));
    return {};
}

}  // namespace htvm::internal
