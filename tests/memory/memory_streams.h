// Small streams of every kind of frame.
#pragma once

#include <vector>

#include "codec/enhanced_options.h"
#include "codec/moving_sequences.h"
#include "codec/presence_by_chance.h"
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

// Of each I-frame's mesh a part is there, and another in each of the T-frames behind it.
inline std::vector<Packet> presence_stream(const std::vector<Packet>& intra) {
    ChanceMotion motion;
    motion.fields.turned = true;
    PresenceStreamByChance out(intra[0], 1500, motion, 1);
    for (const auto& packet : intra) {
        if (packet.kind != PacketKind::intra) continue;
        out.add_intra(packet, Removal::region);
        for (const bool from_last : {false, true, true}) out.add_tracked(from_last, out.any_change());
    }
    return out.packets();
}

}  // namespace htvm::test
