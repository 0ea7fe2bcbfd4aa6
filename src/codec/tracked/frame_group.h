// T-frames in groups, from version 5 of the stream on: a frame between two others is predicted from both.
//
// A group is one to eight T-frames in a row of one reference. Frames are counted from 1 here; 0 is the frame before the
// group, or the reference itself, whichever the group refers to. The last frame is coded first, as any T-frame; then
// the one in the middle between 0 and the last, from both; and so on in each half (path_to()).
//
// There is still one packet a frame, in the order of showing. A packet brings its own frame and, in front of it, those
// that this one needs and no packet before brought: they stay hidden until their own packets come, which then bring
// nothing. So each frame can be shown when its packet is there, and each packet needs one other at most (needed_by()).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "codec/tracked/tracked_frame.h"
#include "htvm/result.hpp"

namespace htvm::internal {

inline constexpr std::size_t most_in_group = 8;

// A frame between two others of its group, or the last one, which has none behind it.
struct GroupFrame {
    std::size_t frame = 1;    // 1 to the group's length
    std::size_t earlier = 0;  // what it is predicted from
    std::size_t later = 0;    // likewise; 0: it is the last
    std::size_t above = 0;    // whichever of the two was coded later; 0: it is the last
    std::size_t level = 0;    // how many frames are above it, one above the other
};

// The frame, and before it those that it needs, in the order of coding. frame: 1 to length.
std::vector<GroupFrame> path_to(std::size_t frame, std::size_t length);
// Those of them that the frame's own packet brings; none if earlier packets brought it.
std::vector<GroupFrame> brought_by(std::size_t frame, std::size_t length);
// The frame whose packet this one's refers to, with what that refers to all that it needs of its group; 0 for the first
// packet, which refers to what is before the group.
std::size_t needed_by(std::size_t frame, std::size_t length);
// Whether a later packet of the group refers to this one's, or, of the first one's, the next group.
bool is_needed(std::size_t frame, std::size_t length);

// What a T-frame's payload begins with.
struct GroupPlace {
    std::size_t length = 1, frame = 1;
};
// What a packet brings: payloads as decode_tracked_frame() takes them, one for each of brought_by().
struct GroupPayload {
    GroupPlace place;
    std::vector<std::span<const std::uint8_t>> frames;
};
std::vector<std::uint8_t> write_group_payload(GroupPlace place, std::span<const std::vector<std::uint8_t>> frames);
Result<GroupPlace> read_group_place(std::span<const std::uint8_t> payload);
// The frames are views of the payload.
Result<GroupPayload> read_group_payload(std::span<const std::uint8_t> payload);

// The steps of a frame of the next level are 6/5 of these.
std::uint32_t coarser_step(std::uint32_t step);

// What stands for the frame before one between two others: transforms and fields are the means of theirs, weighted by
// how near they are in time; steps are a level coarser than those of the frame above. earlier: null for the reference.
struct FramesAround {
    const TrackedState* earlier = nullptr;
    const TrackedState* later = nullptr;
    const TrackedHead* above = nullptr;
};
TrackedState state_between(const NodeReference& reference, const FramesAround& around, const GroupFrame& frame);

}  // namespace htvm::internal
