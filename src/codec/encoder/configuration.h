// What is fixed with a sequence's first frame: options, header and scale; and how coarsely frames are quantised.
#pragma once

#include <cstdint>
#include <memory>

#include "codec/encoder/pose_tracker.h"
#include "codec/format/sequence.h"
#include "core/length.h"
#include "core/thread.h"
#include "htvm/encoder.hpp"

namespace htvm::internal {

// How coarsely a frame is quantised, as asked for.
struct FrameSteps {
    std::int32_t geometry = 32;  // lattice units
    std::int32_t colour = 6;     // levels
    bool operator==(const FrameSteps&) const = default;
};

class SharedTracking;  // tracked/shared_tracking.h

struct Configuration {
    EncoderOptions options;
    SequenceHeader header;
    Threads threads = {};
    Scale scale;
    std::shared_ptr<SharedTracking> shared = {};  // with encoders of the same capture; null: this one is alone
    bool follows = false;                         // goes by what another one finds
    FrameSteps steps;                             // of the options, where neither a rate nor an error decides
    bool tells_presence() const { return header.version >= presence_version; }  // surface comes and goes
    bool intra_only() const { return options.key_interval == 1; }               // no frame refers to another
};

// Completes the configuration, whose options and threads are set, from the first frame: the origin of the lattice, the
// subject's size and, where the options do not give them, the skeleton and the radii. Gives what tracks the poses from
// then on. Errors: bad_input, as of Encoder::push().
Result<PoseTracker> configure(Configuration& configuration, const Mesh& first, const Pose* pose);

// For quality that is derived, 0..100, which means the same for every subject, whatever its size.
FrameSteps steps_of_quality(const Configuration& configuration, double quality);

}  // namespace htvm::internal
