// The reference mesh moved to another frame: gives P-frames (paper, section III-B), and the part of a motion-coded
// EP-frame that is not coded (section V).
#pragma once

#include <span>
#include <vector>

#include "codec/format/frame_payload.h"
#include "codec/reference/skinning.h"
#include "core/thread.h"

namespace htvm::internal {

// M_P as a complete mesh: moved positions and normals; connectivity, colours and texture coordinates of the reference.
// predicted: from predict_positions() with the same transforms.
LatticeMesh animate(const ReferenceMesh& reference, std::span<const QuantisedTransform> transforms,
                    std::vector<LatticePoint> predicted);

// The parts of such a mesh that differ from the reference.
struct AnimatedFrame {
    std::vector<LatticePoint> positions;
    std::vector<QuantisedNormal> normals;
    std::vector<QuantisedTransform> transforms;  // one per bone
};
AnimatedFrame animated_frame(const ReferenceMesh& reference, std::vector<QuantisedTransform> transforms,
                             Threads threads);

// Decodes a P-frame. corrupt_stream if its counts differ from the reference's or its transforms are damaged.
Result<AnimatedFrame> decode_predicted_frame(const FramePayloadView& payload, const ReferenceMesh& reference,
                                             Threads threads);

// The payload of a P-frame. source: the counts of the captured mesh.
FramePayload predicted_frame_payload(const ReferenceMesh& reference, std::span<const QuantisedTransform> transforms,
                                     std::uint32_t source_vertices, std::uint32_t source_triangles);

}  // namespace htvm::internal
