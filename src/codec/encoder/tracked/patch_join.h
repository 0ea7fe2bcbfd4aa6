// The last step of a patch: triangles between the border of what stays of the tracked mesh and that of the piece that
// comes in its place. Each side of the piece's border looks for the side of the open border that it runs along; runs of
// sides that found the same chain are joined to it by a strip.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "codec/encoder/tracked/mesh_borders.h"
#include "core/lattice.h"
#include "core/length.h"
#include "surface/surface_index.h"

namespace htvm::internal {

// A part of the open border: from one vertex to the next, the surface that stays to the left.
struct Chain {
    std::vector<std::uint32_t> sides;  // of the decoded mesh
    bool closed = false;
};

struct Remainder {
    std::vector<Triangle> triangles;
    std::vector<Chain> chains;
    std::vector<bool> open;  // vertices on the open border
};

// The border of the captured mesh: beyond it nothing was seen, so what ends there need not be joined.
struct CaptureRim {
    std::optional<NearestPoints> along;  // points of the border, half a side apart; none if there is no border
    LatticeUnits reach{};                // what is nearer than this to one of them is at the border
    bool is_near(const Point3f& point) const {
        return along && static_cast<double>(along->nearest(point).squared_distance) <= reach.value * reach.value;
    }
};

struct Join {
    std::vector<Triangle> triangles;
    std::vector<bool> unclear;  // vertices of the decoded mesh at which no partner was found; empty: all is joined
};

// What is joined to: the tracked mesh, its sides, what stays of it, and the mean length of the sides at each vertex.
struct PatchedMesh {
    const LatticeMesh& decoded;
    const Sides& sides;
    const Remainder& stays;
    std::span<const double> edge;
};

// gap: between the two borders, in mean edges there. The piece's vertices are numbered behind the tracked mesh's.
Join join_piece(const PatchedMesh& mesh, const LatticeMesh& piece, const CaptureRim& rim, double gap);

}  // namespace htvm::internal
