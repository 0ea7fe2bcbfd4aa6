// Rate control: which quality the next frame gets, so that the stream keeps to a bitrate and a buffer. Knows nothing of
// meshes: it sees frame types, qualities and bits.
//
// The buffer is a leaky bucket at the receiver's side of the line: a frame adds its bits at once, the line takes
// bits_per_second away; it must never hold more than bits_per_second * buffer_seconds, which is the delay a live
// receiver needs. An emptier bucket is no fault: the line idles.
#pragma once

#include <cstddef>
#include <vector>

#include "htvm/frame.hpp"

namespace htvm {

struct RateControlOptions {
    double bits_per_second = 8e6;
    double frames_per_second = 30;
    double buffer_seconds = 1;
    int key_interval = 30;                             // frames that an I-frame's bits are spread over
    double lowest_quality = 0, highest_quality = 100;  // of the quality knob
};

// What a first pass found for a frame: what the second spreads its bits by.
struct FrameCost {
    FrameType type = FrameType::intra;
    double quality = 50;
    double bits = 0;
};

class RateController {
public:
    // first_pass: empty, or one a frame of the whole sequence.
    explicit RateController(const RateControlOptions& options, std::vector<FrameCost> first_pass = {});
    // The quality to code the next frame with, were it of this type.
    double quality(FrameType type) const;
    // Bits that the next frame may take at most without the buffer running over.
    double room() const;
    // A frame took too many bits at this quality: a lower one that should fit.
    double lower_quality(FrameType type, double quality, double bits) const;
    // The frame as it was coded at last.
    void coded(FrameType type, double quality, double bits);
    double buffer_bits() const { return buffer_; }

private:
    RateControlOptions options_;
    std::vector<FrameCost> first_pass_;
    double buffer_ = 0;
    std::size_t frames_ = 0;
    double total_bits_ = 0;
};

}  // namespace htvm
