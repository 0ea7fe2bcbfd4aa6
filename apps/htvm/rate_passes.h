// A bitrate on short captures: rate control learns while it codes, and 30 frames are over before it knows them. What
// several passes over the capture took tells the next one what to expect.
#pragma once

#include <vector>

#include "htvm/frame.hpp"

namespace htvm::app {

// Farther off the rate than this, another pass is worth its time. Measured: docs/experiments/rate_control.md.
inline constexpr double rate_tolerance = 0.05;
// Passes over a capture, the first included.
inline constexpr int most_passes = 8;

class RatePasses {
public:
    // wanted_bits: of the whole stream.
    explicit RatePasses(double wanted_bits) : wanted_bits_(wanted_bits) {}
    // What is wanted from now on, where meshes have another part of it than before.
    void want(double bits) { wanted_bits_ = bits; }
    // What each frame took in a pass, in order; dropped ones with 0 bits.
    void add(std::vector<FrameCost> costs);
    // For RateOptions::first_pass of the next pass: each frame at a quality between those of the passes that took just
    // too little and just too much, with bits between theirs, so that all together are as wanted; what the last pass
    // took if all took too little, or too much.
    std::vector<FrameCost> expected() const;

private:
    struct Pass {
        std::vector<FrameCost> costs;
        double bits = 0;
    };
    const Pass* nearest(bool above) const;
    double wanted_bits_;
    std::vector<Pass> passes_;
};

}  // namespace htvm::app
