// EP-frames, decoding side (paper, section IV): the reference mesh moved bone by bone, corrected by quantised
// residuals.
#pragma once

#include <span>

#include "codec/paper/codebook.h"
#include "codec/stream/frame_payload.h"
#include "codec/reference/prediction.h"
#include "core/thread.h"

namespace htvm::internal {

struct EnhancedFrameContext {
    const ReferenceMesh& reference;
    const Codebook* geometry_codebook;  // null where it did not arrive
    const Codebook* colour_codebook;    // likewise; needed only where the reference has colours
    int nearest_vertices;               // m
    Threads threads;
};

struct DecodedEnhancedFrame {
    LatticeMesh mesh;
    std::vector<QuantisedTransform> transforms;
};

Result<DecodedEnhancedFrame> decode_enhanced_frame(const FramePayload& payload, const EnhancedFrameContext& context);

// The reference vertex of each residual in E^ord, from how many residuals each reference vertex has.
std::vector<std::uint32_t> references_of_residuals(std::span<const std::uint32_t> residuals_of, std::size_t residuals);

// A predicted vertex corrected by a residual, kept within the lattice.
LatticePoint add_residual(LatticePoint predicted, const std::array<std::int32_t, 3>& residual);

// A reference colour corrected by a residual, kept within 0..255.
Colour add_colour(Colour reference, const std::array<std::int32_t, 3>& residual);

}  // namespace htvm::internal
