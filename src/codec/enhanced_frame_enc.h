// EP-frames, encoding side (paper, section IV and Fig. 2).
#pragma once

#include <optional>
#include <span>

#include "codec/codebook.h"
#include "codec/frame_payload.h"
#include "codec/motion_enc.h"
#include "codec/prediction.h"
#include "codec/residual_mapping_enc.h"
#include "codec/vector_quantiser_enc.h"
#include "htvm/encoder.hpp"

namespace htvm {

// A codebook in use: kept from frame to frame as long as that is cheaper than a new one.
struct CodebookInUse {
    std::optional<Codebook> codebook;
    std::uint32_t number = 0;
    double cost_when_new = 0;  // lagrangian a residual in the frame that it was trained on
    bool is_new = false;       // trained in this frame: it must be sent
};

struct EnhancedFrameOptions {
    QuantiserOptions geometry, colour;
    RegistrationOptions registration;
    ReferenceChoice reference_choice = ReferenceChoice::any;
    bool merge_duplicates = true;
    int nearest_vertices = 16;
    unsigned threads = 1;
};

// What an EP-frame refers to and what the encoder keeps between frames.
struct EnhancedFrameState {
    const ReferenceMesh* reference = nullptr;
    const ReferenceSearch* search = nullptr;
    const std::vector<Bone>* bones = nullptr;
    std::span<const std::int32_t> radii;
    std::vector<RigidMotion>* motion_before = nullptr;  // empty behind an I-frame
    CodebookInUse* geometry_codebook = nullptr;
    CodebookInUse* colour_codebook = nullptr;
};

struct EncodedEnhancedFrame {
    FramePayload payload;
    LatticeMesh mesh;  // what the decoder will have
    std::vector<std::uint32_t> distance_order_counts;
};

// The mesh must have the attributes that the reference has, and the reference a vertex. stages: times are added.
EncodedEnhancedFrame encode_enhanced_frame(const LatticeMesh& mesh, const CodedPose& pose, EnhancedFrameState& state,
                                           const EnhancedFrameOptions& options, std::vector<StageTime>& stages);

}  // namespace htvm
