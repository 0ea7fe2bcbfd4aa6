// How handles move points: each by a rigid transform about its pivot, several blended by their weights. Integers only.
#pragma once

#include <span>
#include <vector>

#include "codec/reference/rigid_transform.h"
#include "core/handles.h"

namespace htvm::internal {

std::vector<RotationMatrix> rotation_matrices(std::span<const QuantisedTransform> transforms);

// One point moved by one transform; the result is kept within the lattice.
LatticePoint move(LatticePoint point, const RotationMatrix& matrix, LatticePoint pivot, LatticePoint shift);

// The weighted mean of where its handles move the point, rounded once and kept within the lattice. rotation, pivots and
// transforms: one a handle.
LatticePoint blended_move(LatticePoint point, const VertexWeights& weights, std::span<const RotationMatrix> rotation,
                          std::span<const LatticePoint> pivots, std::span<const QuantisedTransform> transforms);

// A vector turned by its handles, blended likewise.
LatticePoint blended_turn(LatticePoint vector, const VertexWeights& weights, std::span<const RotationMatrix> rotation);

}  // namespace htvm::internal
