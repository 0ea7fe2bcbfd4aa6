// Finds the charts' places in the picture: no two nearer to each other than eight texels, so that each has a gutter of
// four into which its border's colours can go on.
#pragma once

#include <optional>
#include <span>

#include "codec/charts/chart_layer.h"
#include "core/lattice.h"
#include "htvm/mesh.hpp"

namespace htvm::internal {

// Charts with coordinates, and the layer that says so.
struct PlacedCharts {
    std::vector<std::uint8_t> layer;
    std::vector<CornerTexcoords> corners;  // of each triangle
    std::uint32_t scale = 0;               // ChartLayout::scale
};

// A whole mesh's: as large as the picture lets them be with some room left for the charts of patches. detail: how much
// there is to see at each position, in any unit (captured_detail.h), by which charts differ in size; or none.
Result<PlacedCharts> lay_out(std::span<const LatticePoint> positions, std::span<const Triangle> triangles,
                             const StreamTexture& picture, std::span<const float> detail = {});

// A piece's, beside triangles that have coordinates and keep them: at their scale, or down to half of it where the
// picture is nearly full; nothing if there is no room.
std::optional<PlacedCharts> lay_out_beside(std::span<const LatticePoint> positions, std::span<const Triangle> triangles,
                                           const StreamTexture& picture, std::span<const CornerTexcoords> taken,
                                           std::uint32_t scale);

}  // namespace htvm::internal
