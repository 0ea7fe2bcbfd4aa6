// Turns the scene's function into a triangle mesh: marching tetrahedra over a regular grid, visiting only the bricks
// that the surface enters.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "synth/body.h"

namespace htvm::synth {

// Grid corner (i, j, k) lies at origin + rotation * (cell * (i, j, k)).
struct Grid {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    double cell = 10;  // mm
};

// For each brick of the grid that the surface enters, the parts that have an effect there.
struct BrickMap {
    Grid grid;
    std::unordered_map<std::uint64_t, PartSet> candidates;  // indexed by brick_key
    PartSet present = 0;                                    // all parts of the scene

    PartSet at(const Eigen::Vector3d& world) const;  // all that are present if there is no brick
};

// The position of a vertex on a grid edge: at share * edge from the lower corner of the edge.
struct EdgePlace {
    Eigen::Vector3d edge;  // the whole edge, world mm
    double share = 0;      // in (0, 1)
};

struct Extraction {
    std::vector<Eigen::Vector3d> positions;  // on the edges and diagonals of the grid
    std::vector<EdgePlace> places;           // one per position
    std::vector<Triangle> triangles;         // counter-clockwise seen from outside; closed and manifold
    BrickMap bricks;
};

// The surface of the scene over a grid; the same for any number of threads. About 4.5 vertices per squared cell of
// surface. Details thinner than a cell are lost.
Extraction extract_surface(const PosedScene& scene, const Grid& grid, internal::Threads threads);

}  // namespace htvm::synth
