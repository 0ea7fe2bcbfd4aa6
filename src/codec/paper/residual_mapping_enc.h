// Which reference vertex each vertex of an EP-frame is coded against (paper, section IV-C1, eq. 6), and the order
// E^ord of the residuals (IV-C2).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/paper/motion_enc.h"
#include "core/thread.h"

namespace htvm::internal {

enum class ReferenceChoice : std::uint8_t {
    bone,  // the paper's: the nearest vertex of A(b_P), the last correspondence of the registration
    any,   // the nearest vertex of the whole predicted mesh: mis-skinned vertices cost less
};

// The reference vertex of each vertex of the frame. The reference mesh must have a vertex; where A(b_P) is empty, the
// nearest of all is taken. eligible: empty, or one a reference vertex: those with 0 are never chosen (motion-based
// coding); at least one must be eligible. nearest: empty, or of each frame vertex the nearest predicted one.
std::vector<std::uint32_t> find_reference_vertices(
    const ReferenceMesh& reference, const ReferenceSearch& search, std::span<const LatticePoint> predicted,
    std::span<const QuantisedTransform> transforms, std::span<const LatticePoint> frame,
    std::span<const BoneIndex> bone_of_vertex, std::span<const std::uint32_t> nearest,
    std::span<const std::uint8_t> eligible, ReferenceChoice choice, Threads threads);

// E^ord: the frame's vertices by ascending reference vertex, and in their own order where that is the same.
struct ResidualOrder {
    std::vector<std::uint32_t> vertex;     // of the frame, one a residual
    std::vector<std::uint32_t> reference;  // its reference vertex
};
ResidualOrder order_residuals(std::span<const std::uint32_t> reference_of_vertex, std::size_t references);

}  // namespace htvm::internal
