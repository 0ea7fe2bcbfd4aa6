// Codes T-frames in groups (tracked/frame_group.h). Frames are registered, and their kinds chosen, in the order of
// showing, as if there were no groups; those that become T-frames are held until their group is whole, and coded anew.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "codec/encoder/tracked/tracked_work.h"

namespace htvm::internal {

// A T-frame that waits for its group, with what it takes to code it again.
struct HeldFrame {
    std::uint32_t number = 0;
    std::int64_t timestamp_us = 0;
    LatticeMesh mesh;  // as captured
    std::shared_ptr<const SurfaceIndex> surface;
    NodeRegistration registered;
    FrameSteps steps;                          // asked for
    RemovedNoise noise;                        // of the capture
    Presence presence;                         // what is there, in streams that tell it
    std::optional<FilmProjection> projection;  // how the camera saw it, where the texture is its film
};

// What a group may refer to, besides the reference.
struct GroupAnchor {
    std::uint32_t frame = 0;  // the number that names it
    TrackedState state;       // of the last frame of the group before
};

struct CodedGroup {
    std::vector<OutgoingFrame> frames;  // in the order of showing
    GroupAnchor anchor;                 // for the next group
};

// held: one to most_in_group frames in a row. before: null where the group is to refer to the reference alone.
Result<CodedGroup> code_group(const Configuration& configuration, const TrackedReference& reference,
                              const GroupAnchor* before, std::span<const HeldFrame> held,
                              std::vector<StageTime>& stages);

}  // namespace htvm::internal
