// EP-frames (paper, section IV): the reference mesh moved bone by bone, corrected by quantised residuals, with
// connectivity of its own. This is the decoder, together with the arithmetic that the encoder shares with it so that
// both see the same mesh; the encoder is in encoder/bones/enhanced_frame.h.
#pragma once

#include <span>

#include "codec/bones/codebook.h"
#include "codec/format/frame_payload.h"
#include "codec/reference/skinning.h"
#include "core/thread.h"

namespace htvm::internal {

struct EnhancedFrameContext {
    const ReferenceMesh& reference;
    const Codebook* geometry_codebook;  // null if it did not arrive
    const Codebook* colour_codebook;    // the same; needed only if the reference has colours
    int nearest_vertices;               // m
    Threads threads;
};

struct DecodedEnhancedFrame {
    LatticeMesh mesh;
    std::vector<QuantisedTransform> transforms;
};

Result<DecodedEnhancedFrame> decode_enhanced_frame(const FramePayloadView& payload,
                                                   const EnhancedFrameContext& context);

// Motion-based coding (paper, section V): the set of bones whose sub-meshes the frame codes. The rest is animated, and
// zippered to the coded part. One bit per bone, bone i in bit i % 8 of byte i / 8.
std::vector<std::uint8_t> write_coded_bones(const std::vector<bool>& coded);
Result<std::vector<bool>> read_coded_bones(std::span<const std::uint8_t> bytes, std::size_t bones);

// One per reference vertex: 1 if its bone is coded. Residuals refer only to such vertices.
std::vector<std::uint8_t> vertices_of_coded_bones(const ReferenceMesh& reference, const std::vector<bool>& coded);
// The opposite: 1 if the vertex belongs to a part that is animated.
std::vector<std::uint8_t> still_vertices(const ReferenceMesh& reference, const std::vector<bool>& coded);

// The reference vertex of each residual in E^ord, from the number of residuals of each reference vertex.
std::vector<std::uint32_t> references_of_residuals(std::span<const std::uint32_t> residuals_of, std::size_t residuals);

// A predicted vertex plus a residual, clamped to the lattice.
LatticePoint add_residual(LatticePoint predicted, const std::array<std::int32_t, 3>& residual);

// A reference colour plus a residual, clamped to 0..255.
Colour add_colour(Colour reference, const std::array<std::int32_t, 3>& residual);

}  // namespace htvm::internal
