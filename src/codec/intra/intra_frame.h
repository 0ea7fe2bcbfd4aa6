// I-frames (paper, section III-C): positions on a coarser grid of the lattice, connectivity by TFAN, each attribute
// predicted from its neighbours; or the whole mesh coded by another static coder.
#pragma once

#include "codec/format/frame_payload.h"
#include "core/lattice.h"
#include "core/thread.h"
#include "htvm/intra_coder.hpp"

namespace htvm::internal {

// Positions in whole steps, and back: coded positions lie on this grid of lattice points.
inline LatticePoint to_grid(LatticePoint p, std::int32_t step) {
    return {static_cast<std::int32_t>(divide_rounded(p.x, step)), static_cast<std::int32_t>(divide_rounded(p.y, step)),
            static_cast<std::int32_t>(divide_rounded(p.z, step))};
}
inline LatticePoint from_grid(LatticePoint q, std::int32_t step) { return {q.x * step, q.y * step, q.z * step}; }

struct IntraFrameOptions {
    std::int32_t geometry_step = 32;  // lattice units, >= 1
    std::int32_t colour_step = 6;     // levels, 1..255
    bool merge_duplicates = true;
    const ExternalIntraCoder* external = nullptr;  // null: TFAN
    Threads threads = {};
};

// Fills the payload's header and layers (except the pose), and returns the mesh that the decoder will have.
Result<LatticeMesh> encode_intra_frame(const LatticeMesh& mesh, const IntraFrameOptions& options,
                                       FramePayload& payload);

// What vertices have beside their positions: sets the layers and the header's colour_step, and the mesh's colours to
// what the decoder will have. The mesh's positions and triangles are as the decoder has them.
Result<void> encode_intra_attributes(LatticeMesh& mesh, std::int32_t colour_step, FramePayload& payload,
                                     Threads threads = {});
// Sets what the layers hold.
Result<void> decode_intra_attributes(const FramePayloadView& payload, LatticeMesh& mesh, Threads threads = {});

// external: the coder with the number that the payload names; null gives `unsupported`.
Result<LatticeMesh> decode_intra_frame(const FramePayloadView& payload, const ExternalIntraCoder* external,
                                       Threads threads = {});

}  // namespace htvm::internal
