// The project's own skeleton file: one JSON object.
//
//   {
//     "units": "mm",                         mm, cm or m: of the positions. Absent: mm
//     "fps": 30,                             frames per second. Absent: from the timestamps, else 30
//     "joints": ["hip", "knee", "foot"],     names
//     "bones": [[0, 1], [1, 2]],             first joint (the bone turns about it), second joint: indices or names
//     "frames": [                            one per frame:
//       [[0, 900, 0], [0, 480, 20], null],     one [x, y, z] per joint, null where the joint is not tracked
//       null                                   the whole frame is missing
//     ],
//     "timestamps": [0, 0.0333],             optional: seconds, one per frame, increasing. Absent: frame / fps
//     "orientations": [                      optional: one per frame:
//       [[[1,0,0],[0,1,0],[0,0,1]], null],     one 3x3 rotation per bone, row-major (three rows, or nine numbers),
//       null                                   null where unknown (a bone, or the whole frame)
//     ],
//     "radii": [80, 60]                      optional: mm whatever the units, one per bone (paper, eq. 3)
//   }
//
// Other members are ignored.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "htvm/result.hpp"
#include "io/skeleton_track.h"

namespace htvm {

// Reads the format above; positions are converted to mm. Every count, index and number is checked; errors (bad_input;
// limit for too many joints or bones) name the frame and the joint. Rotations that are slightly off (1e-3) are
// corrected.
Result<SkeletonTrack> parse_skeleton_json(std::string_view text);

// The same from parsed JSON.
Result<SkeletonTrack> skeleton_from_json(const nlohmann::json& document);

// Writes the format above, in mm. Reading it gives the same track bit for bit, except that joints that are not tracked
// lose their position. Timestamps are omitted if they equal frame / fps. Notes are not written. Error (bad_input):
// arrays whose lengths disagree, or numbers that are not finite.
Result<std::string> format_skeleton_json(const SkeletonTrack& track);

}  // namespace htvm
