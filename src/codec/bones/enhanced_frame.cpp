#include "codec/bones/enhanced_frame.h"

#include <algorithm>

#include "codec/bones/animated_frame.h"
#include "codec/bones/mapping.h"
#include "codec/bones/mtfan.h"
#include "codec/bones/zipper.h"
#include "codec/intra/attribute_values.h"
#include "codec/reference/transforms.h"
#include "core/parallel.h"

namespace htvm::internal {
namespace {

Result<std::vector<Colour>> decode_colours(const FramePayloadView& payload, const EnhancedFrameContext& context,
                                           std::span<const std::uint32_t> reference_of) {
    const auto residuals = decode_residuals(payload.of(Layer::colour), reference_of.size(), *context.colour_codebook);
    if (!residuals) return tl::unexpected(residuals.error());
    std::vector<Colour> out;
    for (std::size_t k = 0; k < residuals->size(); ++k)
        out.push_back(add_colour(context.reference.mesh.colours[reference_of[k]], (*residuals)[k]));
    return out;
}

template <class Value>
std::vector<Value> of_references(const std::vector<Value>& values, std::span<const std::uint32_t> reference_of) {
    std::vector<Value> out;
    out.reserve(reference_of.size());
    for (const auto r : reference_of) out.push_back(values[r]);
    return out;
}

// Decodes colours, normals and texture coordinates, if the reference has them.
Result<void> decode_attributes(const FramePayloadView& payload, const EnhancedFrameContext& context,
                               std::span<const QuantisedTransform> transforms,
                               std::span<const std::uint32_t> reference_of, LatticeMesh& mesh) {
    const auto& reference = context.reference;
    if (!reference.mesh.colours.empty()) {
        auto colours = decode_colours(payload, context, reference_of);
        if (!colours) return tl::unexpected(colours.error());
        mesh.colours = std::move(*colours);
    }
    if (!reference.mesh.normals.empty()) {
        auto normals = decode_attribute_values(payload.of(Layer::normals),
                                               of_references(predict_normals(reference, transforms), reference_of));
        if (!normals) return tl::unexpected(normals.error());
        mesh.normals = std::move(*normals);
    }
    if (!reference.mesh.texcoords.empty()) {
        auto texcoords = decode_attribute_values(payload.of(Layer::texcoords),
                                                 of_references(reference.mesh.texcoords, reference_of));
        if (!texcoords) return tl::unexpected(texcoords.error());
        mesh.texcoords = std::move(*texcoords);
    }
    return {};
}

Result<void> check(const EnhancedFrameContext& context) {
    if (context.reference.mesh.positions.empty())
        return fail(ErrorKind::corrupt_stream, "EP-frame: its I-frame has no vertices to refer to");
    if (!context.geometry_codebook || (!context.colour_codebook && !context.reference.mesh.colours.empty()))
        return fail(ErrorKind::corrupt_stream, "EP-frame: the codebook that it names did not arrive");
    return {};
}

}  // namespace

std::vector<std::uint8_t> write_coded_bones(const std::vector<bool>& coded) {
    std::vector<std::uint8_t> out((coded.size() + 7) / 8, 0);
    for (std::size_t i = 0; i < coded.size(); ++i)
        if (coded[i]) out[i / 8] = static_cast<std::uint8_t>(out[i / 8] | (1u << (i % 8)));
    return out;
}

Result<std::vector<bool>> read_coded_bones(std::span<const std::uint8_t> bytes, std::size_t bones) {
    if (bytes.size() != (bones + 7) / 8)
        return fail(ErrorKind::corrupt_stream, "coded bones: not one bit for every bone");
    std::vector<bool> out(bones);
    for (std::size_t i = 0; i < bones; ++i) out[i] = ((bytes[i / 8] >> (i % 8)) & 1) != 0;
    return out;
}

std::vector<std::uint8_t> vertices_of_coded_bones(const ReferenceMesh& reference, const std::vector<bool>& coded) {
    std::vector<std::uint8_t> out;
    out.reserve(reference.bone_of_vertex.size());
    for (const auto bone : reference.bone_of_vertex) out.push_back(coded[bone] ? 1 : 0);
    return out;
}

std::vector<std::uint8_t> still_vertices(const ReferenceMesh& reference, const std::vector<bool>& coded) {
    auto out = vertices_of_coded_bones(reference, coded);
    for (auto& v : out) v = v ? 0 : 1;
    return out;
}

std::vector<std::uint32_t> references_of_residuals(std::span<const std::uint32_t> residuals_of, std::size_t residuals) {
    std::vector<std::uint32_t> out;
    out.reserve(residuals);
    for (std::size_t k = 0; k < residuals_of.size(); ++k)
        out.insert(out.end(), residuals_of[k], static_cast<std::uint32_t>(k));
    return out;
}

LatticePoint add_residual(LatticePoint predicted, const std::array<std::int32_t, 3>& residual) {
    return {within_lattice(std::int64_t{predicted.x} + residual[0]),
            within_lattice(std::int64_t{predicted.y} + residual[1]),
            within_lattice(std::int64_t{predicted.z} + residual[2])};
}

Colour add_colour(Colour reference, const std::array<std::int32_t, 3>& residual) {
    Colour out{};
    for (std::size_t c = 0; c < 3; ++c)
        out[c] = static_cast<std::uint8_t>(std::clamp(reference[c] + residual[c], 0, 255));
    return out;
}

Result<DecodedEnhancedFrame> decode_enhanced_frame(const FramePayloadView& payload,
                                                   const EnhancedFrameContext& context) {
    if (auto ok = check(context); !ok) return tl::unexpected(ok.error());
    const auto& reference = context.reference;
    DecodedEnhancedFrame out;
    auto transforms = decode_transforms(payload.of(Layer::transforms), reference.pivots.size());
    if (!transforms) return tl::unexpected(transforms.error());
    out.transforms = std::move(*transforms);
    std::vector<bool> coded_bones;
    std::vector<std::uint8_t> eligible;
    if (payload.has(Layer::coded_bones)) {
        auto coded = read_coded_bones(payload.of(Layer::coded_bones), reference.pivots.size());
        if (!coded) return tl::unexpected(coded.error());
        coded_bones = std::move(*coded);
        eligible = vertices_of_coded_bones(reference, coded_bones);
    }
    // Neither of the two layers needs the other to be read.
    Result<std::vector<std::uint32_t>> residuals_of;
    Result<std::vector<ResidualVector>> residuals;
    std::vector<LatticePoint> predicted;
    parallel_invoke(
        context.threads,
        [&] {
            residuals_of =
                decode_mapping(payload.of(Layer::mapping), payload.header.vertices, reference.mapping_prior, eligible);
        },
        [&] {
            residuals =
                decode_residuals(payload.of(Layer::geometry), payload.header.vertices, *context.geometry_codebook);
            predicted = predict_positions(reference, out.transforms, {});
        });
    if (!residuals_of) return tl::unexpected(residuals_of.error());
    const auto reference_of = references_of_residuals(*residuals_of, payload.header.vertices);
    if (reference_of.size() != payload.header.vertices)
        return fail(ErrorKind::corrupt_stream, "EP-frame: it has vertices, but its bones no reference vertex");
    if (!residuals) return tl::unexpected(residuals.error());
    out.mesh.positions.reserve(residuals->size());
    for (std::size_t k = 0; k < residuals->size(); ++k)
        out.mesh.positions.push_back(add_residual(predicted[reference_of[k]], (*residuals)[k]));

    Result<std::vector<Triangle>> triangles;
    Result<void> attributes;
    parallel_invoke(
        context.threads,
        [&] {
            triangles = decode_mtfan(payload.of(Layer::fans), payload.of(Layer::distance_orders), out.mesh.positions,
                                     payload.header.triangles, context.nearest_vertices, context.threads);
        },
        [&] { attributes = decode_attributes(payload, context, out.transforms, reference_of, out.mesh); });
    if (!attributes) return tl::unexpected(attributes.error());
    if (!triangles) return tl::unexpected(triangles.error());
    out.mesh.triangles = std::move(*triangles);
    if (payload.has(Layer::coded_bones))
        out.mesh = zipper(out.mesh, animate(reference, out.transforms, std::move(predicted)),
                          still_vertices(reference, coded_bones), context.threads);
    return out;
}

}  // namespace htvm::internal
