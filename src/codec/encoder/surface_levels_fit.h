// Finds how far the vertices of all levels have to be displaced so that the finest surface is nearest to the captured
// one, with few displacements: least squares over samples of the captured surface, where a displacement that spares
// less than it costs is none.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/intra/surface_levels.h"
#include "codec/intra/surface_levels_walk.h"
#include "core/length.h"
#include "core/thread.h"
#include "surface/surface_index.h"

namespace htvm::internal {

struct SurfaceFitOptions {
    LatticeUnits reach{480};      // how far the surfaces may be apart at first
    LatticeUnits last_reach{96};  // and in the end
    float agreement = 0.6F;       // least dot product of the normals of what belongs together
    double least_moved = 0.7;  // a displacement that spares less than one of so many steps of the finest level is none
    double farthest = 0.5;     // of a displacement, in lengths of the edge that was split
    double back = 1;           // weight of the shown surface's vertices beside that of the captured surface
    double held = 0.05;  // weight by which each is held at none, in those of the finest level: where nothing is near
    int choices = 3;     // of displacements that are worth their bits, in each round
    int iterations = 6;  // of conjugate gradients, for each choice
    Threads threads = {};
};

// The captured surface as it is searched and sampled here: long triangles, as those of a sole, are cut into smaller
// ones that lie in them, since searches by direction go by vertices.
SurfaceIndex evenly_sampled(const LatticeMesh& captured, Threads threads);

class SurfaceFit {
public:
    // All that is passed must outlive the fit. levels.rules are set. displaced: the last level whose vertices may be
    // displaced; those below follow by their rules alone.
    SurfaceFit(const SurfaceIndex& captured, const LatticeMesh& base, std::span<const SubdivisionLevel> subdivision,
               const SurfaceLevels& levels, std::size_t displaced, const SurfaceFitOptions& options);

    // Sets displacements of the levels from `first` on to what fits best beside those above.
    void improve(std::size_t first, int rounds);
    // Says what a vertex's displacement is, in lattice units: the next improve() begins below it.
    void set(std::size_t vertex, double displacement) { displacements_[vertex] = displacement; }

    // The finest level's vertices with the displacements as they are.
    std::span<const LatticePoint> surface() { return rebuild(), positions_; }
    std::span<const double> displacements() const { return displacements_; }  // of all vertices, lattice units
    // What a squared lattice unit of error of each displacement costs, in those of one vertex of the finest level.
    std::span<const double> weights() const { return weights_; }

private:
    struct Sample {
        Triangle corners;
        std::array<float, 3> shares;
        Vector3f normal;
        float residual, weight;
    };
    // Of a vertex of the shown surface.
    struct SampleBack {
        std::uint32_t vertex;
        Vector3d normal;
        double residual, weight;
    };
    void rebuild();
    void find_samples();
    void find_samples_back(std::span<const Triangle> triangles);
    void weigh();
    std::vector<Vector3d> moved_by(std::span<const double> change) const;
    std::vector<double> gradient(std::span<const Vector3d> moved, bool residuals) const;
    double least(std::size_t v) const;
    void solve(std::span<const std::uint8_t> is_free, std::vector<double> rest);
    void choose_and_solve(std::size_t first);
    std::size_t begin_of(std::size_t level) const;
    std::size_t end_of(std::size_t level) const;

    const SurfaceIndex& captured_;
    const LatticeMesh& base_;
    std::span<const SubdivisionLevel> subdivision_;
    const SurfaceLevels& levels_;
    const std::size_t displaced_;
    const SurfaceFitOptions& options_;
    std::vector<Point3f> points_, facing_;  // samples of the captured surface
    std::vector<float> areas_;              // that each stands for
    std::vector<std::uint32_t> guesses_, guesses_back_;
    std::vector<double> displacements_, change_, farthest_, weights_;
    std::vector<double> mass_;  // area of the surface that each displacement moves
    double finest_mass_ = 1;    // mean of the finest level
    float reach_ = 0;
    int rounds_ = 0;  // so far
    std::vector<LatticePoint> positions_;
    std::vector<Vector3d> normals_;             // along which each vertex is displaced
    std::vector<std::vector<Vector3d>> above_;  // by level, the normals of all vertices above
    std::vector<Sample> samples_;
    std::vector<SampleBack> samples_back_;
};

}  // namespace htvm::internal
