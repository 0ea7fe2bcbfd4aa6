// EP-frames, encoding side (paper, section IV and Fig. 2): each vertex of the frame finds its reference vertex on the
// predicted mesh (eq. 6), the residuals are put in the order E^ord and quantised, duplicates merge, and what is left is
// coded layer by layer.
#pragma once

#include <optional>
#include <span>

#include "codec/paper/codebook.h"
#include "codec/paper/motion_enc.h"
#include "codec/paper/vector_quantiser_enc.h"
#include "codec/reference/skinning.h"
#include "codec/stream/frame_payload.h"
#include "core/thread.h"
#include "htvm/encoder.hpp"

namespace htvm::internal {

// Which reference vertices a vertex may be coded against. The stream does not care how the encoder chose.
enum class ReferenceChoice : std::uint8_t {
    bone,  // the paper's: the nearest vertex of A(b_P), the last correspondence of the registration
    any,   // the nearest vertex of the whole predicted mesh: a vertex whose bone was guessed wrong does not refer to
           // another limb by a long residual
};

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
    std::vector<bool> coded_bones;  // motion-based coding: one per bone; empty: all of the frame is coded
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

// The first two steps by themselves.

// The reference vertex of each vertex of the frame. The reference mesh must have a vertex; where A(b_P) is empty, the
// nearest of all is taken. eligible: empty, or one per reference vertex: those with 0 are never chosen (motion-based
// coding); at least one must be eligible. nearest: empty, or of each frame vertex the nearest predicted one.
std::vector<std::uint32_t> find_reference_vertices(
    const ReferenceMesh& reference, const ReferenceSearch& search, std::span<const LatticePoint> predicted,
    std::span<const QuantisedTransform> transforms, std::span<const LatticePoint> frame,
    std::span<const BoneIndex> bone_of_vertex, std::span<const std::uint32_t> nearest,
    std::span<const std::uint8_t> eligible, ReferenceChoice choice, Threads threads);

// E^ord: the frame's vertices by ascending reference vertex, and in their own order where that is the same. It is set
// by the geometry, not by the connectivity, and lets the mapping layer say by counts alone where each residual belongs.
struct ResidualOrder {
    std::vector<std::uint32_t> vertex;     // of the frame, one per residual
    std::vector<std::uint32_t> reference;  // its reference vertex
};
ResidualOrder order_residuals(std::span<const std::uint32_t> reference_of_vertex, std::size_t references);

}  // namespace htvm::internal
