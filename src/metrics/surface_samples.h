// Points spread evenly over a surface, so that shares of them are shares of its area.
#pragma once

#include <cstdint>
#include <vector>

#include "htvm/mesh.hpp"
#include "metrics/mesh_measures.h"

namespace htvm {

struct SurfaceSample {
    Point3 place{};              // mm
    std::uint32_t triangle = 0;  // that it lies on
};

// One for each squared spacing (mm) of area, at the same places each time.
std::vector<SurfaceSample> samples_on(const Mesh& mesh, double spacing);

// About `count` of them, whatever the mesh's size; none without an area.
std::vector<SurfaceSample> so_many_samples_on(const Mesh& mesh, std::uint64_t count);

}  // namespace htvm
