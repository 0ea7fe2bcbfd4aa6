// Cuts a surface into charts: few and large, each with one direction from which all of its triangles are seen at a
// bounded angle, and from which none hides another.
#pragma once

#include <span>

#include "codec/charts/chart_layer.h"
#include "core/lattice.h"
#include "htvm/mesh.hpp"

namespace htvm::internal {

// Which triangles belong to which chart, and how each is turned so that what bounds it is small; without places, and at
// a scale of 1. positions: those that the triangles name, among others.
ChartLayout cut_into_charts(std::span<const LatticePoint> positions, std::span<const Triangle> triangles);

}  // namespace htvm::internal
