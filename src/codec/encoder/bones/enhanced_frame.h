// EP-frames, encoder side (paper, section IV and Fig. 2). Each vertex of the frame finds its reference vertex on the
// predicted mesh (eq. 6). The residuals are put in the order E^ord and quantised, duplicates are merged, and the rest
// is coded layer by layer.
#pragma once

#include <optional>
#include <span>

#include "codec/bones/codebook.h"
#include "codec/encoder/bones/motion.h"
#include "codec/encoder/bones/vector_quantiser.h"
#include "codec/format/frame_payload.h"
#include "codec/reference/skinning.h"
#include "core/thread.h"
#include "htvm/encoder.hpp"

namespace htvm::internal {

// Which reference vertices a vertex may be coded against. The stream does not depend on how the encoder chooses.
enum class ReferenceChoice : std::uint8_t {
    bone,  // as in the paper: the nearest vertex of A(b_P), the last correspondence of the registration
    any,   // the nearest vertex of the whole predicted mesh, so that a vertex whose bone was guessed wrong does not
           // refer to another limb with a long residual
};

// A codebook in use: kept from frame to frame as long as this is cheaper than a new one.
struct CodebookInUse {
    std::optional<Codebook> codebook;
    std::uint32_t number = 0;
    double cost_when_new = 0;  // Lagrangian cost per residual in the frame that it was trained on
    bool is_new = false;       // trained in this frame, so it must be sent
    std::uint32_t sent = 0;    // number of the frame that it was last sent with
};

struct EnhancedFrameOptions {
    QuantiserOptions geometry, colour;
    ReferenceChoice reference_choice = ReferenceChoice::any;
    bool merge_duplicates = true;
    int nearest_vertices = 16;
    Threads threads = {};
};

// The part of the frame to code, and what to code it against.
struct EnhancedFrameSource {
    const LatticeMesh* mesh = nullptr;          // the captured mesh, or the moving part of it
    std::span<const BoneIndex> bone_of_vertex;  // one per vertex of that mesh
    const FrameMotion* motion = nullptr;        // of the whole frame
    const ReferenceMesh* reference = nullptr;
    const ReferenceSearch* search = nullptr;
    std::span<const std::uint32_t>
        nearest;                    // for each vertex, the nearest vertex of the predicted mesh, if known; else empty
    std::vector<bool> coded_bones;  // for motion-based coding, one per bone; empty: the whole frame is coded
    std::uint32_t source_vertices = 0, source_triangles = 0;  // of the captured mesh
};

struct Codebooks {
    CodebookInUse geometry, colour;
};

// E^ord: the frame's vertices by ascending reference vertex; vertices with the same one keep their order. It follows
// from geometry, not from connectivity, so the mapping layer needs only counts to tell where each residual belongs.
struct ResidualOrder {
    std::vector<std::uint32_t> vertex;     // index in the frame, one per residual
    std::vector<std::uint32_t> reference;  // its reference vertex
};

// A frame's vertices, quantised, in the order E^ord: one entry per residual.
struct QuantisedFrame {
    ResidualOrder order;
    QuantisedResiduals geometry, colour;
    LatticeMesh decoded;                 // its vertices only
    std::vector<std::uint8_t> eligible;  // one per reference vertex: whether residuals may refer to it; empty: all
    Codebooks codebooks;                 // as the frame uses them
};

struct EncodedEnhancedFrame {
    FramePayload payload;
    LatticeMesh mesh;  // the mesh that the decoder will have
    std::vector<std::uint32_t> distance_order_counts;
};

// The two halves of an EP-frame's coding, about equally long. The mesh must have the same attributes as the reference,
// and the reference at least one eligible vertex. codebooks: as the frame before left them. stages: times are added to
// it.
QuantisedFrame quantise_enhanced_frame(const EnhancedFrameSource& source, Codebooks codebooks,
                                       const EnhancedFrameOptions& options, std::vector<StageTime>& stages);
EncodedEnhancedFrame encode_enhanced_frame(const EnhancedFrameSource& source, QuantisedFrame quantised,
                                           const EnhancedFrameOptions& options, std::vector<StageTime>& stages);

// The first two steps, available separately for tests.

// The reference vertex of each vertex of the frame. The reference mesh must have a vertex. If A(b_P) is empty, the
// nearest vertex of all is taken. eligible: empty, or one per reference vertex; those with 0 are never chosen
// (motion-based coding), and at least one must be eligible. nearest: empty, or for each frame vertex the nearest
// predicted one.
std::vector<std::uint32_t> find_reference_vertices(
    const ReferenceMesh& reference, const ReferenceSearch& search, std::span<const LatticePoint> predicted,
    std::span<const QuantisedTransform> transforms, std::span<const LatticePoint> frame,
    std::span<const BoneIndex> bone_of_vertex, std::span<const std::uint32_t> nearest,
    std::span<const std::uint8_t> eligible, ReferenceChoice choice, Threads threads);

ResidualOrder order_residuals(std::span<const std::uint32_t> reference_of_vertex, std::size_t references);

}  // namespace htvm::internal
