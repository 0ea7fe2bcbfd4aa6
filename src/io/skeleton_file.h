// Skeleton files of any format that the library reads.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "htvm/result.hpp"
#include "io/skeleton_bvh.h"
#include "io/skeleton_track.h"

namespace htvm {

struct SkeletonReadOptions {
    BvhOptions bvh;                                 // for BVH, which does not state its unit
    std::size_t max_bytes = std::size_t{1} << 30U;  // larger files are refused
};

// Reads a skeleton from text, and recognises the format by its contents: BVH starts with HIERARCHY; JSON with bodies is
// Azure Kinect's, other JSON is ours. Errors: bad_input, unsupported, limit.
Result<SkeletonTrack> parse_skeleton(std::string_view text, const SkeletonReadOptions& options = {});

// The same from a file; messages start with the path.
Result<SkeletonTrack> read_skeleton(const std::string& path, const SkeletonReadOptions& options = {});

// Writes our JSON (skeleton_json.h) to a file.
Result<void> write_skeleton(const std::string& path, const SkeletonTrack& track);

}  // namespace htvm
