#include "codec/paper/animated_frame.h"
#include "codec/reference/transforms.h"

namespace htvm::internal {

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

}  // namespace htvm::internal
