// EP-frames, encoding side (paper, section IV and Fig. 2).
#pragma once

#include <optional>
#include <span>

#include "codec/paper/codebook.h"
#include "codec/paper/frame_motion_enc.h"
#include "codec/stream/frame_payload.h"
#include "codec/reference/prediction.h"
#include "codec/paper/residual_mapping_enc.h"
#include "codec/paper/vector_quantiser_enc.h"
#include "htvm/encoder.hpp"
#include "core/thread.h"

namespace htvm::internal {

// A codebook in use: kept from frame to frame as long as that is cheaper than a new one.
struct CodebookInUse {
    std::optional<Codebook> codebook;
    std::uint32_t number = 0;
    double cost_when_new = 0;  // lagrangian a residual in the frame that it was trained on
    bool is_new = false;       // trained in this frame: it must be sent
    std::uint32_t sent = 0;    // number of the frame that it was sent with last
};

struct EnhancedFrameOptions {
    QuantiserOptions geometry, colour;
    ReferenceChoice reference_choice = ReferenceChoice::any;
    bool merge_duplicates = true;
    int nearest_vertices = 16;
    Threads threads = {};
};

// What of the frame is coded, and against what.
struct EnhancedFrameSource {
    const LatticeMesh* mesh = nullptr;          // the captured mesh, or the moving part of it
    std::span<const BoneIndex> bone_of_vertex;  // of that mesh
    const FrameMotion* motion = nullptr;        // of the whole frame
    const ReferenceMesh* reference = nullptr;
    const ReferenceSearch* search = nullptr;
    std::span<const std::uint32_t>
        nearest;                    // of each vertex the nearest of the predicted mesh, where known; else empty
    std::vector<bool> coded_bones;  // motion-based coding: one a bone; empty: all of the frame is coded
    std::uint32_t source_vertices = 0, source_triangles = 0;  // of the captured mesh
};

// Codebooks as they were before the frame go in, and come out as the frame used them.
struct Codebooks {
    CodebookInUse geometry, colour;
};

struct EncodedEnhancedFrame {
    FramePayload payload;
    LatticeMesh mesh;  // what the decoder will have
    std::vector<std::uint32_t> distance_order_counts;
};

// The mesh must have the attributes that the reference has, and the reference a vertex that may be referred to.
// stages: times are added.
EncodedEnhancedFrame encode_enhanced_frame(const EnhancedFrameSource& source, Codebooks& codebooks,
                                           const EnhancedFrameOptions& options, std::vector<StageTime>& stages);

}  // namespace htvm::internal
