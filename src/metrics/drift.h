// Drift: how far a decoded surface slides along the true one. Points of the decoded mesh that were on marks of the true
// surface when its connectivity was new are followed by it alone (vertex i stays vertex i); the marks are where the
// truth says. Where frames show a part of a reference, points are followed through the reference's vertices, and
// measured while they are there. Distances across the surface are not drift: M2 measures those.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "metrics/mesh_measures.h"

namespace htvm {

struct DriftOptions {
    double reach = 12;          // mm; marks that are further from the decoded surface at its reference are not followed
    double least_facing = 0.5;  // nor are those whose normals there differ more: cosine
};

struct FrameDrift {
    std::uint32_t age = 0;    // frames since the reference: the first frame with this connectivity
    std::uint64_t marks = 0;  // followed and on the surface in this frame
    double mean_mm = 0, p95_mm = 0;
};

// Which vertices of its reference a mesh has.
struct ShownVertices {
    std::uint32_t reference = 0;        // meshes with the same number have theirs from one; 0: it is not known
    std::vector<std::uint32_t> places;  // of each vertex among the reference's, ascending; empty: all are there
};

class DriftMeter {
public:
    explicit DriftMeter(DriftOptions options = {}) : options_(options) {}

    // The next frame. `marks` has a position and a normal for each mark, the same ones in every frame, and no
    // triangles; a mark that is not on the surface has a zero normal. A mesh of another reference than the one before,
    // or of one that is not known, is a new reference if its triangles are others, too. Fails (bad_input) if a mesh
    // cannot be measured, the number of marks changes, or `shown` has not one place for each vertex.
    Result<FrameDrift> add(const Mesh& marks, const Mesh& decoded, const ShownVertices& shown = {});

    // All frames of an age together, from age 0; and all ages above 0.
    std::vector<FrameDrift> by_age() const;
    FrameDrift overall() const;

private:
    struct Followed {
        std::uint32_t mark = 0;
        std::array<std::uint32_t, 3> corners{};  // among the reference's vertices
        Point3 shares{};
    };
    bool is_of_reference(const Mesh& decoded, const ShownVertices& shown) const;
    Result<void> attach(const Mesh& marks, const Mesh& decoded, const ShownVertices& shown);

    DriftOptions options_;
    std::uint32_t reference_ = 0;
    bool shows_all_ = true;            // the frame before shows all of its reference
    std::vector<Triangle> triangles_;  // of the frame before
    std::vector<Followed> followed_;
    std::size_t mark_count_ = 0;
    std::uint32_t age_ = 0;
    std::vector<std::vector<float>> slid_;  // mm, by age
};

}  // namespace htvm
