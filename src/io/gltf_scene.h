// The meshes that a glTF's scene shows, and where.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "htvm/skeleton.hpp"
#include "io/gltf_file.h"

namespace htvm::internal {

struct GltfTransform {
    std::array<Vector3d, 3> axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  // where the unit vectors go
    Vector3d origin{};
    bool is_identity = true;

    Vector3d turned(const Vector3d& v) const;
    Vector3d moved(const Vector3d& p) const;
    bool is_mirror() const;
};

struct GltfShownMesh {
    std::uint64_t mesh = 0;  // its number
    GltfTransform transform;
};

// In the order of the nodes, those of instances (EXT_mesh_gpu_instancing) one after the other. Not those that are
// hidden, by KHR_node_visibility or by a scale of nothing. A mesh on a skeleton is read if the skeleton's pose leaves
// its shape as it is. Errors: bad_input, unsupported, limit.
Result<std::vector<GltfShownMesh>> gltf_shown_meshes(GltfFile& file, MeshFindings* findings);

}  // namespace htvm::internal
