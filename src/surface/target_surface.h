// The surface that a deformed reference is registered to, ready for searches that mind which way it faces. Encoder
// side.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "surface/oriented_points.h"
#include "htvm/mesh.hpp"
#include "core/thread.h"

namespace htvm::internal {

// One a vertex: the normals of the triangles around it, weighted by area, unit length; zero where there are none.
std::vector<Point3f> vertex_normals(std::span<const Point3f> positions, std::span<const Triangle> triangles,
                                    Threads threads = {});

// About how far apart neighbours are where `count` points are spread over the surface.
float point_gap(std::span<const Point3f> positions, std::span<const Triangle> triangles, std::size_t count);

struct TargetSurface {
    std::vector<Point3f> positions, normals;
    std::vector<Triangle> triangles;
    std::vector<Point3f> triangle_normals;            // unit length; zero where a triangle has no area
    std::vector<std::uint32_t> first_around, around;  // triangles around each vertex, in compressed rows
    std::vector<std::uint32_t> samples;  // every so many vertices, for searches far away and for the way back
    float fine_gap, coarse_gap;          // between vertices, and between samples
    OrientedPoints fine;                 // all vertices
    OrientedPoints coarse;               // the samples; found indices count in samples
};

// Copies what it needs. Every index < positions.size(). cell: side of the fine search's cells, about two edges long;
// samples: about how many vertices the coarse search knows.
TargetSurface make_target_surface(std::span<const Point3f> positions, std::span<const Triangle> triangles, float cell,
                                  std::size_t samples, Threads threads);

// A point of the target's surface for a vertex of the deformed reference.
struct SurfaceTarget {
    Point3f point{};
    Point3f normal{};            // of the triangle, unit length
    std::uint32_t triangle = 0;  // where it lies
    bool valid = false;          // false: nothing that faces the same way within reach; the rest says nothing
};

struct SurfaceTargetOptions {
    float reach = 30;         // the positions' units: further away there is no target
    float agreement = 0.35F;  // least product of the two normals
    Threads threads = {};
};

// Points on a mesh, and which way it faces there.
struct SurfaceSamples {
    std::vector<Point3f> points, normals;  // normals: unit length, or zero
};
// Adds a triangle's middle. points, normals: of the mesh's vertices, which may stand at the beginning of the samples.
void add_middle(SurfaceSamples& samples, std::span<const Point3f> points, std::span<const Point3f> normals,
                const Triangle& triangle);

// The closest point for each of the moved reference's vertices, among the triangles around the nearest target vertex
// whose normal agrees. normals: of the moved vertices (vertex_normals).
std::vector<SurfaceTarget> surface_targets(std::span<const Point3f> moved, std::span<const Point3f> normals,
                                           const TargetSurface& target, const SurfaceTargetOptions& options);

}  // namespace htvm::internal
