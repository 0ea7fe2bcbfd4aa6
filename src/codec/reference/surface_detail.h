// The levels of a surface below those that frames refer to. They move with the reference: a vertex lies where its
// level's rule expects it on the moved surface, and as far off that along its normal as the I-frame said. So a
// reference of few vertices, which is all that T-frames code, is shown with the detail of many.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/reference/subdivision.h"
#include "htvm/lattice_mesh.hpp"

namespace htvm::internal {

struct SurfaceDetail {
    std::vector<SubdivisionLevel> levels;  // the first one splits edges of the reference; empty: there is none
    std::vector<SubdivisionRule> rules;    // of each
    std::vector<double> displacements;     // of each vertex of these levels, along its normal, in lattice units
    // What is added to the mean of its edge's ends, in levels, -255..255 each; of the first vertices: those behind them
    // have the mean itself.
    std::vector<std::array<std::int32_t, 3>> colours;
    bool empty() const { return levels.empty(); }
    std::size_t vertices() const { return displacements.size(); }  // beside the reference's
    // The triangles of the first levels; at least one.
    const std::vector<Triangle>& triangles(std::size_t shown) const { return levels[shown - 1].triangles; }
};

// Adds the vertices of the first levels behind the reference's, as it was moved. triangles: of the reference.
void add_detail(const SurfaceDetail& detail, std::size_t shown, std::span<const Triangle> triangles,
                std::vector<LatticePoint>& positions, Threads threads = {});

// The mean of two colours and what is added to it.
Colour off_mean(const Colour& a, const Colour& b, const std::array<std::int32_t, 3>& more);

// The same of what vertices have beside their positions: a new one has the mean of its edge's ends, and what
// SurfaceDetail::colours adds to it. Empty ones stay so.
void add_detail(const SurfaceDetail& detail, std::size_t shown, std::vector<Colour>& colours);
void add_detail(const SurfaceDetail& detail, std::size_t shown, std::vector<QuantisedNormal>& normals);
// A new one is there if both ends are, so that whole triangles of the reference are, or are not. presence: see
// Presence.
void add_detail(const SurfaceDetail& detail, std::size_t shown, std::vector<std::uint8_t>& presence);

// The mesh with all its detail; without texture coordinates.
LatticeMesh detailed(const SurfaceDetail& detail, LatticeMesh mesh);

// After a patch: what is still there of the detail. An edge of the new mesh is split if both its ends stay and it was
// split before; where several edges have the same ends, each split is taken over once, so the detail never grows. It
// ends with the level before the first that would have more than four triangles for each vertex of the mesh and of the
// detail before: triangles of a patch that lie on each other are all cut where they meet the detail. stays: the
// vertices of the mesh before that stay, ascending; these are the first of the new mesh.
SurfaceDetail detail_that_stays(const SurfaceDetail& before, std::size_t vertices_before,
                                std::span<const std::uint32_t> stays, const LatticeMesh& patched);

}  // namespace htvm::internal
