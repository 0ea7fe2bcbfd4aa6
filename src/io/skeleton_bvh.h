// BVH motion capture files: a joint hierarchy with its rest offsets, and Euler angles per frame.
#pragma once

#include <string_view>

#include "htvm/result.hpp"
#include "io/skeleton_track.h"

namespace htvm {

struct BvhOptions {
    double mm_per_unit = 0;  // mm per unit of the file; 0: guessed from the skeleton's height, with a note
};

// Reads a BVH text (as read_bvh_text() does): joint positions by forward kinematics (rotations in the order of the
// channels, degrees), in mm; bones from each joint to its children, including end sites (named "PARENT end"), oriented
// like their first joint. BVH has no units: a skeleton lower than 10 is taken as metres, lower than 600 as centimetres,
// otherwise as mm; one of many joints, a person, from 4 to 8 as feet and from 48 to 90 as inches; a note says which.
// Position channels are relative to the parent. They replace the joint's OFFSET if those of the first frame are nearer
// to OFFSET than to zero (they repeat it); otherwise they are added to it. A note says which if it makes a difference.
// A frame with values that are not numbers is a missing frame. Errors: bad_input with the line, or the frame;
// unsupported for several roots or scale channels; limit for too many joints, or motion that would take far more memory
// than the file.
Result<SkeletonTrack> parse_skeleton_bvh(std::string_view text, const BvhOptions& options = {});

}  // namespace htvm
