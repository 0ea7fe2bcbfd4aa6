// What the mapping layer's contexts (bones/mapping.h) know of a reference mesh.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/lattice.h"
#include "htvm/mesh.hpp"

namespace htvm::internal {

// What the reference mesh tells about its vertices; computed once per I-frame.
struct MappingPrior {
    std::vector<std::uint8_t> area_class;        // 0..9: a third of the area of the triangles around it, relative to
                                                 // the mean
    std::vector<std::uint32_t> first_neighbour;  // vertices + 1 offsets
    std::vector<std::uint32_t> neighbours;       // only those of lower index; at most 8 each, may repeat
};
MappingPrior make_mapping_prior(std::span<const LatticePoint> positions, std::span<const Triangle> triangles);

}  // namespace htvm::internal
