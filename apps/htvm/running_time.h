// The time of frames in a whole stream: that of each of its sequences begins where the one before ends.
#pragma once

#include <cstddef>
#include <cstdint>

namespace htvm::app {

class RunningTime {
public:
    // The next frame. seconds_of_one_frame: by the frame rate; how long a frame lasts that is alone in its sequence.
    void take(std::int64_t timestamp_us, bool begins_sequence, double seconds_of_one_frame) {
        if (begins_sequence) {
            before_ = total();
            first_us_ = timestamp_us;
            frames_ = 0;
        }
        ++frames_;
        last_us_ = timestamp_us;
        one_frame_ = seconds_of_one_frame;
    }
    // When the last frame begins, seconds from the first one.
    double seconds() const { return before_ + span(); }
    // When it ends: a mean frame later.
    double total() const {
        if (frames_ == 0) return before_;
        if (frames_ == 1) return before_ + one_frame_;
        const auto frames = static_cast<double>(frames_);
        return before_ + span() * frames / (frames - 1);
    }

private:
    double span() const { return (static_cast<double>(last_us_) - static_cast<double>(first_us_)) / 1e6; }
    std::int64_t first_us_ = 0, last_us_ = 0;
    std::size_t frames_ = 0;
    double before_ = 0, one_frame_ = 0;
};

}  // namespace htvm::app
