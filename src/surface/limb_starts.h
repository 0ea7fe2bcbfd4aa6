// Where a limb may have gone that moved farther than closest points can tell: hands, feet and head are the extremities
// of a body, of the reference as well as of a captured surface. A limb whose end is near no captured extremity is
// turned about its root towards the nearest one that no other limb has. Encoder only: a registration begins there, and
// what is nearer to the surface is kept.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "core/length.h"
#include "surface/place_graph.h"
#include "surface/rigid_registration.h"
#include "surface/surface_index.h"
#include "surface/tracked_registration.h"

namespace htvm::internal {

// A place for each connected part of the surface within a cube of this side: parts that only pass near each other, as a
// hand beside a hip, are not beside each other.
PlaceGraph graph_of_surface(const SurfaceIndex& surface, LatticeUnits side);

// The places that are farther from all others on average, along the graph, than every other within `reach` along it,
// and by a sixth farther than the nearest to all; ascending (average geodesic distance: Zhang, Mischaikow, Turk 2005).
std::vector<std::uint32_t> extremities(const PlaceGraph& graph, LatticeUnits reach);

// The handles from an extremity on to where the limb leaves the body.
struct Limb {
    std::vector<std::uint16_t> handles;  // the extremity first, the root last, by distance along the surface
    std::vector<double> from_root;       // share of the way from the root to the extremity, 0 to 1, one per handle
};
std::vector<Limb> limbs_of(const DeformableMesh& mesh, LatticeUnits reach);

struct LimbReach {
    Scale scale;                     // of the lattice on which the positions are
    AdultMillimetres apart{250};     // along the surface between extremities, at least
    AdultMillimetres matched{120};   // a limb that ends as near as this to a captured extremity has it
    AdultMillimetres farthest{700};  // that the end of a limb may have moved
    double longer = 1.25;            // how much farther from the root than it was, straight, its end may be
    AdultMillimetres cell{40};       // side of the cubes of graph_of_surface()
};

// `motions`, with each limb that ends near no extremity of the target as it was at `last` (one motion per handle, or
// none: at rest), carried on by its root and turned about it towards the nearest extremity that no limb has. None if
// there is no such limb.
std::vector<RigidMotion> reached_for_extremities(const DeformableMesh& mesh, const SurfaceIndex& target,
                                                 std::span<const RigidMotion> motions,
                                                 std::span<const RigidMotion> last, const LimbReach& options);

}  // namespace htvm::internal
