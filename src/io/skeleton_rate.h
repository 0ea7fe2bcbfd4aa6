// How fast meshes and the poses of a skeleton follow each other, as far as one tells it of the other.
#pragma once

#include <cstddef>
#include <string>

#include "io/skeleton_track.h"

namespace htvm {

// Seconds from the first pose to the end of the last one.
double duration_of(const SkeletonTrack& track);

// The rate of meshes of which only the skeleton's is known. Both are taken to last equally long: with so many poses for
// each mesh (2 to 16, within 5 %), or at a usual rate (within 2 %), where that tells the rate; else at the same rate.
struct MeshRate {
    double fps = 30;
    std::string note;          // what was decided, a sentence; empty: the skeleton's rate, and both as long
    bool is_doubtful = false;  // nothing fits: the durations differ by more than a third at the skeleton's rate
};
MeshRate mesh_rate_beside(const SkeletonTrack& track, std::size_t mesh_frames);

// A sentence if the meshes, of which the times are known, and the skeleton differ by more than a third of the longer
// one in how long they last; else empty.
std::string unlike_durations(const SkeletonTrack& track, double mesh_seconds);

// Gives a track whose rate is not known that of the meshes, or so many times it as there are poses for each mesh. A
// note says so.
void take_rate_of_meshes(SkeletonTrack& track, double fps, std::size_t mesh_frames);

}  // namespace htvm
