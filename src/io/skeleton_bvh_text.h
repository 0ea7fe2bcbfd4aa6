// The text of BVH files: the hierarchy of joints, and the channels' values in each frame, before they become poses.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "htvm/result.hpp"
#include "htvm/skeleton.hpp"

namespace htvm {

inline constexpr std::size_t no_bvh_parent = static_cast<std::size_t>(-1);

struct BvhChannel {
    std::size_t axis = 0;  // 0, 1, 2: x, y, z
    bool rotation = false;
};

struct BvhJoint {
    std::string name;
    std::size_t parent = no_bvh_parent;
    Vector3d offset{};
    bool has_offset = false;
    bool end_site = false;
    bool channels_repeat_offset = false;
    std::vector<BvhChannel> channels;
};

struct BvhHierarchy {
    std::vector<BvhJoint> joints;  // parents before children
    std::size_t channel_count = 0;
};

struct BvhFrame {
    std::vector<double> values;  // of all channels; empty: one is not a number
};

struct BvhText {
    BvhHierarchy hierarchy;
    std::vector<BvhFrame> frames;    // at least one with values
    double frame_time = 0;           // seconds; 0: the file does not say
    std::vector<std::string> notes;  // as of SkeletonTrack
};

// Reads a BVH text as programs write it: keywords in any case, with or without spaces around the colons; lines that
// end with \n, \r\n or \r; a byte order mark; comments behind # or //; decimal commas where the numbers of the
// hierarchy, or of the motion, hold no points, else commas between numbers; end sites without OFFSET, which are left
// out. As many frames are taken as are there, whatever number is declared; a note says if it is another. A frame time
// that is a rounded usual rate (0.033, 0.0083) is that rate's. Errors: bad_input with the line, or the frame;
// unsupported for several roots or scale channels; limit for too many joints, or motion that would take far more memory
// than the file.
Result<BvhText> read_bvh_text(std::string_view text);

}  // namespace htvm
