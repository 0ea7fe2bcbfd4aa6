// Where tracking is lost in one region, as when a hand comes out of a pocket: what of the tracked mesh goes, and the
// piece of the captured surface that comes in its place, already joined to what stays.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "codec/encoder/tracked/captured_surface.h"
#include "codec/encoder/tracking_numbers.h"
#include "codec/tracked/surface_patch.h"
#include "core/lattice.h"
#include "core/length.h"
#include "core/thread.h"
#include "surface/surface_index.h"

namespace htvm::internal {

// The defaults suit an adult on the default lattice.
struct SurfacePatchOptions {
    // A region is lost where the surfaces are farther apart than this, as far as they are apart by half of it.
    LatticeUnits lost = Scale{}.on_lattice(tracking_numbers.lost);
    // How far to search for the other surface.
    LatticeUnits reach = Scale{}.on_lattice(tracking_numbers.reach);
    // Side of a square: lost regions of a smaller area are left alone.
    LatticeUnits speck = Scale{}.on_lattice(tracking_numbers.speck);
    // Side of the cubes of space by which a frame is judged: see TrackedFitOptions.
    LatticeUnits region = Scale{}.on_lattice(tracking_numbers.region);
    int margin = 1;           // rings of triangles around a lost region that go as well, >= 0
    double stretch = 3;       // a triangle is lost, too, where a side is longer than at rest by this factor
    double gap = 0.5;         // between what stays and the piece, before they are joined: in mean edges there
    double most_share = 0.3;  // of the tracked mesh's area that may go
    int attempts = 5;         // where the two borders do not fit together, more goes around them and they are cut again
    SimplifiedReferenceOptions simplification;  // of the piece
    Threads threads = {};                       // their number does not change the result
};

// A tracked mesh to be patched.
struct TrackedMesh {
    const LatticeMesh& decoded;                // as the decoder has it
    std::span<const LatticePoint> rest = {};   // its vertices in the mesh that it refers to, by which stretched and
                                               // folded triangles are told; or none
    std::span<const std::uint32_t> near = {};  // TrackedTargets::near, where searches begin; or none
    std::span<const std::uint8_t> seen = {};   // TrackedTargets::seen: what is not cannot be lost; or none
    bool is_unseen(const Triangle& t) const {
        return !seen.empty() && (seen[t[0]] == 0 || seen[t[1]] == 0 || seen[t[2]] == 0);
    }
};

// Looks for patches of one tracked mesh. What is lost is measured once, then it may be tried to replace more or less.
class SurfacePatchSearch {
public:
    // surface: index by direction of `captured`. All must outlive this object.
    SurfacePatchSearch(const TrackedMesh& tracked, const LatticeMesh& captured, const SurfaceIndex& surface,
                       const SurfacePatchOptions& options);
    SurfacePatchSearch(SurfacePatchSearch&&) noexcept;
    SurfacePatchSearch& operator=(SurfacePatchSearch&&) noexcept;
    ~SurfacePatchSearch();

    // region_lost: RMS distance from which on a cube is lost; 0: regions are lost by themselves. The result is nothing
    // if nothing is lost, too much is lost, the borders cannot be joined clearly, or the capture has texture
    // coordinates: an I-frame is what is left then. Where the borders of the captured surface are known
    // (SurfaceIndex::from_border), what it has beyond the tracked mesh is added, also where nothing goes.
    std::optional<SurfacePatch> find(LatticeUnits region_lost) const;

private:
    struct Measured;
    std::unique_ptr<const Measured> measured_;  // null where no patch is possible
};

}  // namespace htvm::internal
