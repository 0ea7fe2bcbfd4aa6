#include "codec/bones/animated_frame.h"

#include "codec/reference/transforms.h"

namespace htvm::internal {

LatticeMesh animate(const ReferenceMesh& reference, std::span<const QuantisedTransform> transforms,
                    std::vector<LatticePoint> predicted) {
    LatticeMesh out;
    out.positions = std::move(predicted);
    out.triangles = reference.mesh.triangles;
    out.colours = reference.mesh.colours;
    out.normals = predict_normals(reference, transforms);
    out.texcoords = reference.mesh.texcoords;
    return out;
}

FramePayload predicted_frame_payload(const ReferenceMesh& reference, std::span<const QuantisedTransform> transforms,
                                     std::uint32_t source_vertices, std::uint32_t source_triangles) {
    FramePayload out;
    out.header.source_vertices = source_vertices;
    out.header.source_triangles = source_triangles;
    out.header.vertices = static_cast<std::uint32_t>(reference.mesh.positions.size());
    out.header.triangles = static_cast<std::uint32_t>(reference.mesh.triangles.size());
    out.set(Layer::transforms, encode_transforms(transforms));
    return out;
}

AnimatedFrame animated_frame(const ReferenceMesh& reference, std::vector<QuantisedTransform> transforms,
                             Threads threads) {
    AnimatedFrame out;
    out.positions = predict_positions(reference, transforms, threads);
    out.normals = predict_normals(reference, transforms);
    out.transforms = std::move(transforms);
    return out;
}

Result<AnimatedFrame> decode_predicted_frame(const FramePayloadView& payload, const ReferenceMesh& reference,
                                             Threads threads) {
    const auto& mesh = reference.mesh;
    if (payload.header.vertices != mesh.positions.size() || payload.header.triangles != mesh.triangles.size())
        return fail(ErrorKind::corrupt_stream, "P-frame: it has other counts than its I-frame");
    auto transforms = decode_transforms(payload.of(Layer::transforms), reference.pivots.size());
    if (!transforms) return tl::unexpected(transforms.error());
    return animated_frame(reference, std::move(*transforms), threads);
}

}  // namespace htvm::internal
