// Rate control: chooses the next frame's quality such that the stream keeps to a bitrate and a buffer. Knows nothing of
// meshes: it sees frame types, qualities and bits.
//
// The buffer is a leaky bucket at the receiver's side of the line. A frame adds its bits at once; the line removes
// bits_per_second. The bucket must never hold more than bits_per_second * buffer_seconds, which is the delay that a
// live receiver needs. Running empty is no fault: the line idles.
//
// The model: log2(bits) of an I- or EP-frame is linear in quality; T-frames behave like EP-frames, and TP-frames take
// besides that share of an I-frame's bits that is the share of their vertices that are new; the size of P-frames does
// not depend on quality. One term, shared by all frames, follows the content; the slope and the extra size of an
// I-frame are learned.
//
// The controller looks for the quality at which the usual mixture of types spends what the line carries, slightly more
// or less until the long-run average is on target. All types share this quality. It moves in small steps, and between
// I-frames only if it is well off.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "codec/format/frame_kinds.h"
#include "htvm/frame.hpp"

namespace htvm::internal {

struct RateControlOptions {
    double bits_per_second = 8e6;
    double frames_per_second = 30;
    double buffer_seconds = 1;
    int key_interval = 30;                             // number of frames over which the bits of an I-frame are spread
    double lowest_quality = 0, highest_quality = 100;  // range of the quality setting
    double largest_step = 2;    // largest change of quality from frame to frame, unless the buffer is in danger
    double stay = 1.5;          // smallest change between I-frames: another quality needs other codebooks, which at
                                // 6,000 vertices take a tenth of the frame that brings them
    double intra_extra = 0.25;  // log2: how much larger an I-frame is than others, assumed until one is seen
};

// What is known about the sizes of frames.
struct FrameSizeModel {
    double content = 17;                       // log2(bits) of an EP-frame at quality 0, for the present content
    double intra_extra = 0.25;                 // log2: how much larger an I-frame is
    double moved_bits = 4e3;                   // bits of a P-frame
    double slope = 0.04;                       // change of log2(bits) per unit of quality
    double slope_weight = 100, slope_sum = 4;  // sums over steps seen: of squared quality steps, and of their products
                                               // with steps of log2(bits)
    double last_surprise = 0;                  // log2; at the last I- or EP-frame
    double usual_belief = 0.15;                // 0..1: how far `content` follows a surprise of usual size
    std::array<int, frame_type_count> seen{};  // number of frames, by type
    std::array<FrameCost, frame_type_count> last{};  // the last frame, by type
};

// Bits that a frame of this class should take at this quality. renewed: FrameCost::renewed.
double expected_bits(const FrameSizeModel& model, RateClass rate, double quality, double renewed = 0);
// Learns from a coded frame; frames without bits are ignored.
void learn(FrameSizeModel& model, const FrameCost& frame);

class RateController {
public:
    // first_pass: empty, or one per frame of the whole sequence, in order.
    explicit RateController(const RateControlOptions& options, std::vector<FrameCost> first_pass = {});
    // The quality at which to code the next frame if it is of this type: lowest_quality..highest_quality.
    double quality(FrameType type) const;
    // The most bits that the next frame may take without overflowing the buffer.
    double room() const;
    const RateControlOptions& options() const { return options_; }  // with the rate in force
    // For a frame that took too many bits, more than room(), at this quality: a lower quality at which it should fit.
    // The fifth call for the same frame, at the latest, returns lowest_quality; if that is still too much, the frame
    // must become a P-frame or be dropped.
    double lower_quality(FrameType type, double quality, double bits);
    // A frame was coded at this quality only to see its size, and is not sent.
    void tried(const FrameCost& frame) { learn(model_, frame); }
    // Whether no frame of this type has been coded yet, so that quality() is a guess that tried() improves.
    bool is_guess(FrameType type) const;
    // The frame as finally coded; or that it was dropped, which takes no bits.
    void coded(const FrameCost& frame);
    void dropped(double quality) { coded({FrameType::predicted, quality, 0}); }
    // The line carries so many bits a second from the next frame on. The quality follows at once, as far as the model
    // knows how, and then in larger steps than usual for half a second. What was planned from a first pass is dropped.
    void change_rate(double bits_per_second);

private:
    void follow_bitrate();       // what follows from the bitrate
    double wanted_bits() const;  // per frame on average, from now on
    double live_quality(FrameType type) const;
    double planned_quality() const;
    double planned_bits(std::size_t frame, double correction) const;
    double remaining_correction() const;
    void correct_plan(RateClass rate);
    double peak_of_plan(double correction) const;

    RateControlOptions options_;
    std::vector<FrameCost> first_pass_;
    FrameSizeModel model_;
    double per_frame_ = 0, capacity_ = 0;  // bits that the line carries in the time of a frame; that the buffer holds
    double buffer_ = 0, idle_bits_ = 0;
    std::size_t frames_ = 0;
    double total_bits_ = 0;
    int calls_ = 0;    // number of calls of lower_quality for the next frame
    int hurries_ = 0;  // number of frames from now on in which the quality may change by more
    int since_intra_ = 0;
    bool sent_between_ = false;                // whether an EP- or T-frame was sent
    double level_ = 0;                         // the quality shared by I- and EP-frames
    double renewed_ = 0;                       // share of the vertices that a frame between I-frames has new, usually
    std::vector<RateClass> recent_;            // classes of the last key_interval frames, as a ring
    std::vector<double> plan_;                 // planned quality of each frame, from the first pass
    std::vector<std::array<double, 2>> rest_;  // planned bits from each frame to the end: of P-frames, of others
    double plan_slope_ = 0.04;                 // change of log2(bits) per unit of quality in the first pass
    double planned_surprise_ = 0;              // log2(coded bits / planned bits), apart from the effect of quality
    double correction_ = 0;                    // added to the planned qualities
};

}  // namespace htvm::internal
