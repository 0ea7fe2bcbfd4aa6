// What must hold for every mesh that an importer returns.
#pragma once

#include <cstring>
#include <string>

#include "fuzz_input.h"
#include "io/mesh_check.h"
#include "io/mesh_file.h"

namespace htvm::fuzz {

inline void require_importable(const Mesh& mesh) {
    require(check_mesh(mesh).has_value(), "an imported mesh is sound");
    (void)guess_unit(mesh);
}

// Compares bit by bit.
inline bool same(const Mesh& a, const Mesh& b) {
    const auto equal = [](const auto& x, const auto& y) {
        return x.size() == y.size() && (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])) == 0);
    };
    return equal(a.positions, b.positions) && equal(a.triangles, b.triangles) && equal(a.colours, b.colours) &&
           equal(a.normals, b.normals) && equal(a.texcoords, b.texcoords);
}

}  // namespace htvm::fuzz
