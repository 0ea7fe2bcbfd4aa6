// Small streams of every kind of frame.
#pragma once

#include <vector>

#include "codec/enhanced_options.h"
#include "codec/moving_sequences.h"
#include "codec/tracked_sequences.h"

namespace htvm::test {

using namespace internal;

// Header, I, then P- and EP-frames, whole and in part, twice over.
inline std::vector<Packet> animated_stream(int vertices) {
    auto options = motion_based(40, 3);
    options.topology.frame_choice = FrameChoice::motion;
    options.topology.predicted_below = 800;
    return encode(walking(6, vertices), options).packets;
}

// Header, I and four T-frames, from the I-frame and from the previous frame.
inline std::vector<Packet> tracked_stream(int vertices) {
    EncoderOptions options = test::enhanced_options();
    options.key_interval = 1;
    ChanceMotion motion;
    motion.fields.turned = true;
    return with_tracked_frames(encode(synthetic(true, 2, vertices), options).packets, 1500, motion, 0, 1);
}

}  // namespace htvm::test
