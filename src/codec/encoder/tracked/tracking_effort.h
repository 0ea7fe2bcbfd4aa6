// How much is searched for a T-frame, from live to archive: what an effort of 0 to 9 stands for. The numbers are those
// that paid at their place: docs/experiments/efforts.md has what each level takes and gives.
#pragma once

#include "codec/encoder/tracked/captured_surface.h"
#include "surface/tracked_registration.h"

namespace htvm::internal {

inline constexpr int usual_effort = 5, most_effort = 9;

struct TrackingEffort {
    double samples = 1;                                      // registration's samples, relative to DeformationOptions'
    int coarse_rounds = DeformationOptions{}.coarse_rounds;  // as what follows
    int fine_rounds = DeformationOptions{}.fine_rounds;
    int surface_rounds = DeformationOptions{}.surface_rounds;
    int solver_iterations = DeformationOptions{}.solver_iterations;
    TargetSamples target_samples = TargetSamples::middles;  // see TargetSearch
    bool levels = true;                // whether references are coded in levels unless it is said; and whether with
    bool thorough_levels = false;      // all rounds of their fit, which take twice the time for 2 % of the bits
    bool always_other_starts = false;  // other starts are registered for every frame, not for lost ones alone
    int group = 1;                     // TrackedOptions::group where that is not given
    bool motion_alone = false;         // nothing but the motion of the nodes is coded, unless the picture falls apart
};

// effort: 0 to most_effort. 0 is what a frame gets that would be late: see Encoder::set_effort().
TrackingEffort tracking_effort(int effort);

// options with what the effort says in place of its own.
DeformationOptions with_effort(DeformationOptions options, const TrackingEffort& effort);

}  // namespace htvm::internal
