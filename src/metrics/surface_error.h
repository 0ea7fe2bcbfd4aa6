// M2: the surface metric of the paper (section VI-A2, equations 11 and 12), computed as METRO does (Cignoni, Rocchini,
// Scopigno: Metro: measuring error on simplified surfaces, 1998; version 4).
//
// One direction samples one mesh, and measures the distance of every sample to the surface of the other. The samples
// are METRO's, all of equal weight: every vertex that a triangle uses; points evenly along every edge, sqrt(samples
// left per area) of them per length; the rest uniformly by area on the faces. For a target of n samples, V used
// vertices and E edge samples, the faces get n - 2 V - E: METRO subtracts the vertices twice, and so do we.
// Differences: face samples are METRO's Monte Carlo ones (its -s0) with our own seeded generator, the same on every
// machine; edge samples are limited by the target (slivers would ask for billions); METRO's search grid drops samples
// further away than the box's diagonal, ours drops none.
//
// It was checked to be within 1 % of METRO's definition by closed forms in the tests (parallel planes, concentric
// spheres, a roof of known RMS over its faces and with METRO's mixture), and by comparing a real capture of 72,000
// triangles with its 9-bit quantisation, also in MeshLab 2020.09, whose Hausdorff filter is METRO's code with n samples
// of each kind:
//     RMS, mm     vertices 0.816875 (MeshLab 0.816876), edges 0.713474 (0.713341), faces 0.676227 (0.675335),
//                 all together in MeshLab's mixture 0.698324 (0.697836): a difference of 0.07 %.
//
// A mesh without triangles is measured from its vertices, and to its vertices.
#pragma once

#include <cstdint>

#include "core/thread.h"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"

namespace htvm {

struct SurfaceErrorOptions {
    std::uint64_t samples = 0;       // target in each direction; 0: METRO's default, 10 times the larger triangle count
    std::uint64_t seed = 1;          // for the face samples
    bool vertices = true;            // sample the vertices
    bool edges = true;               // sample the edges
    bool faces = true;               // sample the faces
    internal::Threads threads = {};  // the number of threads does not change the result
};

// Point-to-surface distances of one frame in one direction.
struct SurfaceDistances {
    std::uint64_t samples = 0;
    double rms = 0;      // mm
    double mean = 0;     // mm
    double largest = 0;  // mm, the one-sided Hausdorff distance over the samples
};

// Distances of samples on `from` to the surface of `to`. Zeros if there is nothing to sample, infinite if there is
// nothing to measure to.
Result<SurfaceDistances> surface_distances(const Mesh& from, const Mesh& to, const SurfaceErrorOptions& options = {});

// Both directions: forward from samples on the original, backward from samples on the decoded mesh.
struct SurfaceError {
    SurfaceDistances forward, backward;
};
Result<SurfaceError> surface_error(const Mesh& original, const Mesh& decoded, const SurfaceErrorOptions& options = {});

// A sequence by eq. 11: all frames have the same weight, whatever their size.
struct SurfaceErrorSums {
    std::uint64_t frames = 0;
    SurfaceDistances forward, backward;  // rms and mean: sums over the frames; largest: over all frames
    double worst_frame_rms = 0;          // mm, the larger direction in the worst frame
};
SurfaceErrorSums& operator+=(SurfaceErrorSums& sums, const SurfaceError& frame);

// One direction: the mean of rms and mean over the frames (eq. 11), and the largest distance of all; zeros without
// frames.
SurfaceDistances sequence_forward(const SurfaceErrorSums& sums);
SurfaceDistances sequence_backward(const SurfaceErrorSums& sums);

// RMSE_s of eq. 12 in mm: the larger direction.
double m2(const SurfaceErrorSums& sums);
double m2(const SurfaceError& frame);

}  // namespace htvm
