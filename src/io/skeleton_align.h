// Aligns a skeleton's motion with the mesh frames: one complete pose per mesh frame.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "htvm/result.hpp"
#include "io/skeleton_track.h"

namespace htvm {

// When the mesh frames were captured.
struct MeshClock {
    std::size_t frames = 0;
    double fps = 0;  // frames per second; 0: unknown, then each pose belongs to one mesh frame
    std::vector<double>
        timestamps;  // seconds, one per frame, not decreasing; empty: frame / fps from the track's start
};

struct AlignOptions {
    double offset = 0;                // seconds to add to the skeleton's timestamps if its clock is known to be off
    std::size_t first_used = 0;       // the notes count the mesh frames from this one on,
    std::size_t used = 0;             // and so many of them; 0: all
    bool derive_orientations = true;  // false: bones whose orientation is in no frame are left unknown_orientation
};

struct AlignedPoses {
    // One per mesh frame, every joint finite. tracked is false for joints that had to be filled in. orientations are
    // one per bone (empty if the track has none and none are to be derived).
    std::vector<Pose> poses;
    std::vector<std::string> notes;  // what was filled in, resampled or assumed, one sentence each, for the user
};

// Poses at the times of the mesh frames. A pose within 0.2 ms of a mesh frame is taken as it is; otherwise joints are
// interpolated linearly in time between the poses around it, which counts as tracked. If the tracker lost a joint or a
// frame (or skipped more than half a frame's time), the joint is interpolated in time between the nearest poses that
// have it, and held before the first and after the last of them; then it has tracked = false. A joint that no pose has
// is put where the nearest joint along the skeleton is.
//
// If rate and length agree (within 0.5 %), or the mesh rate is unknown, pose i belongs to mesh frame i. If both have
// timestamps that do not overlap at all, both are assumed to start together.
//
// Orientations in the file are interpolated in the same way. Those of a bone that has none in any frame are derived
// from positions, relative to the first mesh frame (derive_turning_orientations).
//
// Errors (bad_input): no pose with a joint while there are mesh frames; arrays whose lengths disagree; timestamps that
// are not finite or not in order.
Result<AlignedPoses> align(const SkeletonTrack& track, const MeshClock& mesh, const AlignOptions& options = {});

}  // namespace htvm
