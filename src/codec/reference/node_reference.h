// What both sides derive from a decoded mesh for the frames whose nodes move it: the nodes of its deformation graph,
// and the hierarchy of its vertices over which fields are coded.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "codec/format/frame_payload.h"
#include "codec/reference/deformation_nodes.h"
#include "codec/reference/film_projection.h"
#include "codec/reference/vertex_hierarchy.h"
#include "core/geometry.h"
#include "core/lattice.h"
#include "core/thread.h"
#include "htvm/lattice_mesh.hpp"
#include "htvm/result.hpp"

namespace htvm::internal {

// One per vertex: 1 it is there, 0 it is not; or none: all are there.
using Presence = std::vector<std::uint8_t>;

// What both sides know of the nodes, one entry per node.
struct NodeGraph {
    std::vector<LatticePoint> pivots;               // where the nodes sit
    std::vector<std::vector<std::uint32_t>> lower;  // neighbours with a lower number, ascending
    std::vector<Vector3d> normals;                  // of the surface at the pivots, unit length or zero
};

// What both sides derive once from the decoded I-frame.
struct NodeReference {
    LatticeMesh mesh;  // as decoded, with positions averaged if they were not smoothed
    DeformationNodes nodes;
    NodeGraph graph;
    VertexHierarchy hierarchy;
    CapturedCounts captured;  // what the I-frame was captured with; make_node_reference() does not know it
    // Where the stream tells what is there (tracked/presence.h), which make_node_reference() does not know either:
    // which vertices of the mesh are, and those around each.
    bool has_presence = false;
    Presence presence;
    VerticesAround around;
    std::optional<FilmProjection> projection;  // likewise: how the camera saw it, where that is told
};
// What is derived first, for a frame that does a part of the next one's work.
struct NodesAhead {
    VerticesAround around;
    VertexHierarchy hierarchy;
};
// node_spacing: lattice units, > 0. step: of the mesh's positions, lattice units, where they are still to be averaged,
// as in streams before shown_smoothed_version; else 1. threads: uses two at most. kept: of a patched mesh, what it
// takes over of the nodes before. ahead: of this mesh, where it is known already; then step must be 1.
Result<NodeReference> make_node_reference(const LatticeMesh& mesh, std::int32_t node_spacing, std::int32_t step,
                                          Threads threads = {}, const KeptNodes& kept = {},
                                          std::optional<NodesAhead> ahead = {});

}  // namespace htvm::internal
