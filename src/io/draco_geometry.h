// What libdraco makes of a Draco bitstream, of a file of its own or inside of a glTF, with care: see drc.h.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "io/mesh_check.h"

namespace draco {
class PointCloud;
}

namespace htvm::internal {

enum class DracoKind : std::uint8_t { position, normal, colour, texcoord, other };

struct DracoAttribute {
    DracoKind kind = DracoKind::other;
    std::uint32_t id = 0;        // by which a glTF names it
    std::size_t components = 0;  // 1 to 4 can be read
    std::optional<double> most;  // of an integer: the largest of its type; nothing: floats
    bool normalised = false;     // integers stand for 0..1 or -1..1
    std::uint32_t number = 0;    // in the bitstream
};

struct DracoGeometry {
    std::uint32_t points = 0;
    std::vector<Triangle> triangles;
    std::vector<DracoAttribute> attributes;
    std::shared_ptr<const draco::PointCloud> cloud;
};

// Errors: bad_input if the bytes are no Draco bitstream, are truncated or damaged; unsupported for bitstreams before
// 1.0; limit.
Result<DracoGeometry> read_draco_geometry(std::span<const std::uint8_t> bytes, const MeshLimits& limits);

// The numbers of an attribute, row by row for each point; integers as they are, whatever they stand for. bad_input if
// it has none for some points, or more than four components.
Result<std::vector<double>> draco_rows(const DracoGeometry& geometry, const DracoAttribute& attribute);

}  // namespace htvm::internal
