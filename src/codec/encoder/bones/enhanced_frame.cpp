#include "codec/encoder/bones/enhanced_frame.h"

#include <algorithm>
#include <optional>

#include "codec/bones/animated_frame.h"
#include "codec/bones/enhanced_frame.h"
#include "codec/bones/mapping.h"
#include "codec/bones/mtfan.h"
#include "codec/bones/zipper.h"
#include "codec/intra/attribute_values.h"
#include "codec/intra/duplicates.h"
#include "codec/reference/transforms.h"
#include "core/parallel.h"
#include "core/stage_clock.h"

namespace htvm::internal {
namespace {

// The vertices of a bone are either all eligible or none.
bool is_eligible(const ReferenceMesh& reference, std::span<const std::uint8_t> eligible, std::size_t bone) {
    const auto vertices = reference.sub_meshes.of(bone);
    return !vertices.empty() && (eligible.empty() || eligible[vertices.front()] != 0);
}

NearestPoints tree_of(std::span<const LatticePoint> positions, std::span<const std::uint32_t> chosen) {
    std::vector<Point3f> points;
    points.reserve(chosen.size());
    for (const auto k : chosen) points.push_back(point_of(positions[k]));
    return NearestPoints(points);
}

}  // namespace

std::vector<std::uint32_t> find_reference_vertices(
    const ReferenceMesh& reference, const ReferenceSearch& search, std::span<const LatticePoint> predicted,
    std::span<const QuantisedTransform> transforms, std::span<const LatticePoint> frame,
    std::span<const BoneIndex> bone_of_vertex, std::span<const std::uint32_t> nearest,
    std::span<const std::uint8_t> eligible, ReferenceChoice choice, Threads threads) {
    std::vector<bool> own(transforms.size());  // bones whose vertices refer to the bone's own sub-mesh
    for (std::size_t bone = 0; bone < own.size(); ++bone)
        own[bone] = choice == ReferenceChoice::bone && is_eligible(reference, eligible, bone);
    std::vector<std::uint32_t> candidates;
    std::optional<NearestPoints> all;
    if (!std::all_of(bone_of_vertex.begin(), bone_of_vertex.end(), [&](BoneIndex bone) { return own[bone]; })) {
        candidates = eligible_references(eligible, predicted.size());
        all.emplace(tree_of(predicted, candidates));
    }
    // The trees are in the reference's own space, so each vertex is moved back there instead of moving the sub-mesh.
    std::vector<RigidMotion> back;
    for (std::size_t bone = 0; bone < transforms.size(); ++bone)
        back.push_back(motion_of(transforms[bone], reference.pivots[bone]).inverse());
    std::vector<std::uint32_t> out(frame.size());
    parallel_for(frame.size(), threads, 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const auto bone = bone_of_vertex[k];
            if (!own[bone] && !nearest.empty() && (eligible.empty() || eligible[nearest[k]] != 0)) {
                out[k] = nearest[k];
                continue;
            }
            if (!own[bone]) {
                out[k] = candidates[all->nearest(point_of(frame[k])).index];
                continue;
            }
            const Eigen::Vector3d v(frame[k].x, frame[k].y, frame[k].z);
            const Eigen::Vector3f x = back[bone](v).cast<float>();
            out[k] = reference.sub_meshes.of(bone)[search.sub_mesh[bone].nearest({x.x(), x.y(), x.z()}).index];
        }
    });
    return out;
}

ResidualOrder order_residuals(std::span<const std::uint32_t> reference_of_vertex, std::size_t references) {
    std::vector<std::uint32_t> next(references + 1, 0);
    for (const auto r : reference_of_vertex) ++next[r + 1];
    for (std::size_t r = 0; r < references; ++r) next[r + 1] += next[r];
    ResidualOrder out;
    out.vertex.resize(reference_of_vertex.size());
    out.reference.resize(reference_of_vertex.size());
    for (std::size_t k = 0; k < reference_of_vertex.size(); ++k) {
        const auto at = next[reference_of_vertex[k]]++;
        out.vertex[at] = static_cast<std::uint32_t>(k);
        out.reference[at] = reference_of_vertex[k];
    }
    return out;
}

namespace {

std::vector<ResidualVector> position_residuals(const LatticeMesh& mesh, std::span<const LatticePoint> predicted,
                                               const ResidualOrder& order) {
    std::vector<ResidualVector> out;
    out.reserve(order.vertex.size());
    for (std::size_t k = 0; k < order.vertex.size(); ++k) {
        const LatticePoint e = mesh.positions[order.vertex[k]] - predicted[order.reference[k]];
        out.push_back({e.x, e.y, e.z});
    }
    return out;
}

std::vector<ResidualVector> colour_residuals(const LatticeMesh& mesh, const LatticeMesh& reference,
                                             const ResidualOrder& order) {
    std::vector<ResidualVector> out;
    out.reserve(order.vertex.size());
    for (std::size_t k = 0; k < order.vertex.size(); ++k) {
        const auto& c = mesh.colours[order.vertex[k]];
        const auto& r = reference.colours[order.reference[k]];
        out.push_back({c[0] - r[0], c[1] - r[1], c[2] - r[2]});
    }
    return out;
}

// The existing codebook is tried first. A new one is trained only if it no longer suits the frame, and used if it costs
// less, including the bits for sending it.
QuantisedResiduals quantise_with(CodebookInUse& use, std::span<const ResidualVector> residuals,
                                 const QuantiserOptions& options) {
    constexpr double worth_training = 1.02;
    const auto count = static_cast<double>(std::max<std::size_t>(residuals.size(), 1));
    use.is_new = false;
    QuantisedResiduals kept;
    double kept_cost = 0;
    if (use.codebook && use.codebook->escape_step == options.step) {
        kept = quantise(residuals, *use.codebook, options);
        kept_cost = lagrangian(residuals, kept, *use.codebook, options);
        if (kept_cost / count <= worth_training * use.cost_when_new) return kept;
    }
    auto trained = train_codebook(residuals, options);
    auto fresh = quantise(residuals, trained, options);
    const double fresh_cost = lagrangian(residuals, fresh, trained, options);
    const double bit = options.lambda * options.step * options.step;
    const double sending = bit * 8 * static_cast<double>(encode_codebook(trained).size() + packet_overhead);
    if (!kept.indices.empty() && kept_cost <= fresh_cost + sending) {
        use.cost_when_new = std::max(use.cost_when_new, kept_cost / count / worth_training);
        return kept;
    }
    use.codebook = std::move(trained);
    use.cost_when_new = fresh_cost / count;
    ++use.number;
    use.is_new = true;
    return fresh;
}

// The decoder's sum: predicted vertices and reference attributes plus quantised residuals.
LatticeMesh decode_vertices(const LatticeMesh& mesh, const ReferenceMesh& reference,
                            std::span<const LatticePoint> predicted, const QuantisedFrame& residuals) {
    LatticeMesh out;
    const auto& order = residuals.order;
    for (std::size_t k = 0; k < order.vertex.size(); ++k) {
        out.positions.push_back(add_residual(predicted[order.reference[k]], residuals.geometry.values[k]));
        if (!mesh.colours.empty())
            out.colours.push_back(add_colour(reference.mesh.colours[order.reference[k]], residuals.colour.values[k]));
        if (!mesh.normals.empty()) out.normals.push_back(mesh.normals[order.vertex[k]]);
        if (!mesh.texcoords.empty()) out.texcoords.push_back(mesh.texcoords[order.vertex[k]]);
    }
    return out;
}

template <class Value>
std::vector<Value> selected(const std::vector<Value>& values, const std::vector<std::uint32_t>& kept) {
    std::vector<Value> out;
    if (values.empty()) return out;
    out.reserve(kept.size());
    for (const auto k : kept) out.push_back(values[k]);
    return out;
}

// Removes the residuals of merged vertices before any layer is coded, so that they cost nothing in any layer. Returns
// the triangles in the numbering of E^ord.
std::vector<Triangle> remove_duplicates(QuantisedFrame& residuals, const std::vector<Triangle>& triangles, bool merge) {
    auto& order = residuals.order;
    const auto merging = merge ? find_duplicates(residuals.decoded) : no_duplicates(order.vertex.size());
    Merging of_source;  // from the numbering of the captured mesh
    of_source.number.resize(order.vertex.size());
    for (std::size_t k = 0; k < order.vertex.size(); ++k) of_source.number[order.vertex[k]] = merging.number[k];
    auto out = merged_triangles(triangles, of_source, merge);
    if (merging.kept.size() < order.vertex.size()) {
        order.vertex = selected(order.vertex, merging.kept);
        order.reference = selected(order.reference, merging.kept);
        residuals.geometry = {selected(residuals.geometry.indices, merging.kept),
                              selected(residuals.geometry.values, merging.kept)};
        residuals.colour = {selected(residuals.colour.indices, merging.kept),
                            selected(residuals.colour.values, merging.kept)};
        residuals.decoded = kept_vertices(residuals.decoded, merging.kept);
    }
    return out;
}

// Codes the layers that do not need connectivity.
void encode_vertex_layers(const QuantisedFrame& residuals, const EnhancedFrameSource& source, FramePayload& payload) {
    const auto& reference = *source.reference;
    const auto& transforms = source.motion->transforms;
    std::vector<std::uint32_t> residuals_of(reference.mesh.positions.size(), 0);
    for (const auto r : residuals.order.reference) ++residuals_of[r];
    payload.set(Layer::transforms, encode_transforms(transforms));
    payload.set(Layer::mapping, encode_mapping(residuals_of, reference.mapping_prior, residuals.eligible));
    payload.set(Layer::geometry, encode_residuals(residuals.geometry, *residuals.codebooks.geometry.codebook));
    if (!reference.mesh.colours.empty())
        payload.set(Layer::colour, encode_residuals(residuals.colour, *residuals.codebooks.colour.codebook));
    if (!reference.mesh.normals.empty()) {
        const auto turned = selected(predict_normals(reference, transforms), residuals.order.reference);
        payload.set(Layer::normals, encode_attribute_values(residuals.decoded.normals, turned));
    }
    if (!reference.mesh.texcoords.empty()) {
        const auto of_reference = selected(reference.mesh.texcoords, residuals.order.reference);
        payload.set(Layer::texcoords, encode_attribute_values(residuals.decoded.texcoords, of_reference));
    }
}

}  // namespace

QuantisedFrame quantise_enhanced_frame(const EnhancedFrameSource& source, Codebooks codebooks,
                                       const EnhancedFrameOptions& options, std::vector<StageTime>& stages) {
    StageClock clock(stages);
    const auto& mesh = *source.mesh;
    const auto& reference = *source.reference;
    const auto& predicted = source.motion->predicted;
    QuantisedFrame out;
    if (!source.coded_bones.empty()) out.eligible = vertices_of_coded_bones(reference, source.coded_bones);
    const auto reference_of_vertex = find_reference_vertices(
        reference, *source.search, predicted, source.motion->transforms, mesh.positions, source.bone_of_vertex,
        source.nearest, out.eligible, options.reference_choice, options.threads);
    out.order = order_residuals(reference_of_vertex, predicted.size());
    clock.done("reference vertices");
    out.codebooks = std::move(codebooks);
    out.geometry =
        quantise_with(out.codebooks.geometry, position_residuals(mesh, predicted, out.order), options.geometry);
    if (!reference.mesh.colours.empty())
        out.colour =
            quantise_with(out.codebooks.colour, colour_residuals(mesh, reference.mesh, out.order), options.colour);
    out.decoded = decode_vertices(mesh, reference, predicted, out);
    clock.done("quantisation");
    return out;
}

EncodedEnhancedFrame encode_enhanced_frame(const EnhancedFrameSource& source, QuantisedFrame residuals,
                                           const EnhancedFrameOptions& options, std::vector<StageTime>& stages) {
    StageClock clock(stages);
    const auto& reference = *source.reference;
    const Threads threads = options.threads;
    const auto triangles = remove_duplicates(residuals, source.mesh->triangles, options.merge_duplicates);
    clock.done("duplicates");

    EncodedEnhancedFrame out;
    EncodedMtfan connectivity;
    parallel_invoke(
        threads,
        [&] { connectivity = encode_mtfan(residuals.decoded.positions, triangles, options.nearest_vertices, threads); },
        [&] { encode_vertex_layers(residuals, source, out.payload); });
    clock.done("connectivity and entropy coding");

    out.payload.set(Layer::fans, std::move(connectivity.fans));
    out.payload.set(Layer::distance_orders, std::move(connectivity.distance_orders));
    auto& header = out.payload.header;
    header.source_vertices = source.source_vertices;
    header.source_triangles = source.source_triangles;
    header.vertices = static_cast<std::uint32_t>(residuals.decoded.positions.size());
    header.triangles = static_cast<std::uint32_t>(connectivity.triangles.size());
    header.geometry_codebook = residuals.codebooks.geometry.number;
    header.colour_codebook = residuals.codebooks.colour.number;
    out.mesh = std::move(residuals.decoded);
    out.mesh.triangles = std::move(connectivity.triangles);
    out.distance_order_counts = std::move(connectivity.distance_order_counts);
    if (!source.coded_bones.empty()) {
        out.payload.set(Layer::coded_bones, write_coded_bones(source.coded_bones));
        out.mesh = zipper(out.mesh, animate(reference, source.motion->transforms, source.motion->predicted),
                          still_vertices(reference, source.coded_bones), threads);
        clock.done("zippering");
    }
    return out;
}

}  // namespace htvm::internal
