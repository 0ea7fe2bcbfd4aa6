// Rate control: which quality the next frame gets, so that the stream keeps to a bitrate and a buffer. Knows nothing of
// meshes: it sees frame types, qualities and bits.
//
// The buffer is a leaky bucket at the receiver's side of the line: a frame adds its bits at once, the line takes
// bits_per_second away; it must never hold more than bits_per_second * buffer_seconds, which is the delay a live
// receiver needs. An emptier bucket is no fault: the line idles.
//
// The model: log2(bits) of an I- or EP-frame is linear in quality; T-frames are as EP-frames. What all frames share
// follows the content, what an I-frame costs more and the slope are learned; P-frames cost what they cost. The quality
// sought is the one at which the usual mixture of types spends what the line carries, a little more or less until the
// long-run average is on target; all types share it, it moves by small steps, and between I-frames only where it is
// well off.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "codec/frame_kinds.h"
#include "htvm/frame.hpp"

namespace htvm::internal {

struct RateControlOptions {
    double bits_per_second = 8e6;
    double frames_per_second = 30;
    double buffer_seconds = 1;
    int key_interval = 30;                             // frames that an I-frame's bits are spread over
    double lowest_quality = 0, highest_quality = 100;  // of the quality knob
    double largest_step = 2;    // most that the quality changes from frame to frame, unless the buffer is in danger
    double stay = 1.5;          // least that it changes between I-frames: another quality needs other codebooks, and
                                // those of 6,000 vertices take a tenth of the frame that brings them
    double intra_extra = 0.25;  // log2: how much more an I-frame takes than others, before any is seen
};

// What is known of the sizes of frames.
struct FrameSizeModel {
    double content = 17;                       // log2(bits) of an EP-frame at quality 0, of the content as it is now
    double intra_extra = 0.25;                 // how much more an I-frame's is
    double moved_bits = 4e3;                   // of a P-frame
    double slope = 0.04;                       // of log2(bits) over quality
    double slope_weight = 100, slope_sum = 4;  // squared quality steps seen and their products with those of log2(bits)
    double last_surprise = 0;                  // log2, of the last I- or EP-frame
    double usual_belief = 0.15;                // 0..1: how far content follows a frame that is off as usual
    std::array<int, frame_type_count> seen{};  // frames by type
    std::array<FrameCost, frame_type_count> last{};  // by type
};

// Bits that a frame of this class should take at this quality.
double expected_bits(const FrameSizeModel& model, RateClass rate, double quality);
// Learns from a frame that was coded; frames without bits teach nothing.
void learn(FrameSizeModel& model, const FrameCost& frame);

class RateController {
public:
    // first_pass: empty, or one a frame of the whole sequence, in order.
    explicit RateController(const RateControlOptions& options, std::vector<FrameCost> first_pass = {});
    // The quality to code the next frame with, were it of this type: lowest_quality..highest_quality.
    double quality(FrameType type) const;
    // Bits that the next frame may take at most without the buffer running over.
    double room() const;
    // A frame took too many bits, more than room(), at this quality: a lower one that should fit. The fifth call for
    // the same frame at the latest returns lowest_quality; if that is too much as well, the frame must become a
    // P-frame or be dropped.
    double lower_quality(FrameType type, double quality, double bits);
    // A frame was coded at this quality to see what it takes, and is not sent.
    void tried(FrameType type, double quality, double bits) { learn(model_, {type, quality, bits}); }
    // Whether frames of this type are coded for the first time, and quality() is a guess that tried() mends.
    bool is_guess(FrameType type) const;
    // The frame as it was coded at last; a dropped frame takes 0 bits.
    void coded(FrameType type, double quality, double bits);
    double buffer_bits() const { return buffer_; }
    double total_bits() const { return total_bits_; }  // of all frames so far

private:
    double wanted_bits() const;  // of a frame on average, from now on
    double live_quality(FrameType type) const;
    double planned_quality() const;
    double planned_bits(std::size_t frame, double correction) const;
    double remaining_correction() const;
    void correct_plan(RateClass rate);
    double peak_of_plan(double correction) const;

    RateControlOptions options_;
    std::vector<FrameCost> first_pass_;
    FrameSizeModel model_;
    double per_frame_ = 0, capacity_ = 0;  // bits the line takes in a frame's time; that the buffer holds
    double buffer_ = 0, idle_bits_ = 0;
    std::size_t frames_ = 0;
    double total_bits_ = 0;
    int calls_ = 0;  // of lower_quality for the next frame
    int since_intra_ = 0;
    bool sent_between_ = false;                // an EP- or T-frame
    double level_ = 0;                         // the quality that I- and EP-frames share
    std::vector<RateClass> recent_;            // classes of the last key_interval frames, a ring
    std::vector<double> plan_;                 // quality of each frame of the first pass
    std::vector<std::array<double, 2>> rest_;  // bits planned from each frame on: of P-frames, of others
    double plan_slope_ = 0.04;                 // of log2(bits) over quality in the first pass
    double planned_surprise_ = 0;              // log2 of coded over planned bits, quality aside
    double correction_ = 0;                    // added to the plan's qualities
};

}  // namespace htvm::internal
