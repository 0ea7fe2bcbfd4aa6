// Noise is not motion: what a T-frame is to say of displacement and colours is filtered over time, along the tracked
// surface, before it is coded. A capture's noise is new in every frame; coded, it takes more bits than the motion.
//
// Only detail is filtered: what a target has beyond the mean of its surroundings. What is smooth follows the capture at
// once, and with it whatever the nodes' motion misses or jitters by. Detail follows as a Kalman filter has it: by a
// gain from the noise, measured against how far the targets lie from the estimate. Where they lie farther than the
// noise explains, something has moved, and the gain goes to one.
//
// The noise is measured, too: as the changes of detail from frame to frame undo each other. Noise comes and goes, so
// that a change is followed by its opposite; motion goes on. Without noise, targets pass unchanged.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/encoder/tracked/captured_surface.h"
#include "codec/encoder/tracking_numbers.h"
#include "core/length.h"
#include "htvm/mesh.hpp"

namespace htvm::internal {

// A vertex's displacement in lattice units, then red, green and blue in levels.
using TargetDetail = std::array<float, 4>;
// Variances: of the displacement, and of the colours, the mean of the three components.
using TargetVariance = std::array<float, 2>;

// What filtering a frame leaves for the next. Lists are by vertex of the reference.
struct TargetHistory {
    std::vector<TargetDetail> seen;      // in the last frame; empty: there was none on this reference
    std::vector<TargetDetail> change;    // of `seen` from the frame before; empty: likewise
    std::vector<TargetDetail> estimate;  // without the noise
    std::vector<TargetVariance> unsure;  // of the estimate
    std::vector<TargetVariance> noise;   // as measured there so far, recent frames most
    TargetVariance usual_noise{};        // the same over the whole surface
    double calm = 0;                     // how much of the change of displacements was left out, from 0 to 1
    int measured = 0;                    // frames in which noise was measured
};

struct TargetFilterOptions {
    // By which the reference itself may be off, the second in levels.
    LatticeUnits geometry_step = tracking_numbers.finer * usual_request.geometry_step;
    double colour_step = tracking_numbers.coarser_colours * usual_request.colour_step;
    LatticeUnits captured_edge = usual_request.captured_edge;  // mean edge of the captured mesh
};

// Replaces the targets by what they are without noise. triangles: of the reference. before: of the frame before, or of
// none.
TargetHistory filter_targets(TrackedTargets& targets, std::span<const Triangle> triangles, const TargetHistory& before,
                             const TargetFilterOptions& options);

// By how much less a bit should cost than where all targets are new in each frame: where they are calm, an error that
// is left stays for long. step: of the displacement. From 0.2 to 1, which it is where nothing was
// filtered.
double price_of_bits(const TargetHistory& filtered, LatticeUnits step);

// What is left of the history when the surface that was coded becomes the reference, with `vertices` vertices. kept:
// which vertices its first ones were before; the others are new, or all of them.
TargetHistory on_new_reference(const TargetHistory& before, std::span<const std::uint32_t> kept, std::size_t vertices,
                               const TargetFilterOptions& options);

}  // namespace htvm::internal
