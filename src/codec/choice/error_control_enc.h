// Error control: which quality the next frame gets so that its surface error (M2) is what was asked for. Knows nothing
// of meshes: it sees frame types, qualities and errors.
#pragma once

#include <array>

#include "htvm/frame.hpp"

namespace htvm::internal {

class ErrorController {
public:
    // target: mm, > 0.
    explicit ErrorController(double target) : target_(target) { log_ratio_.fill(-2.15); }
    // The quality, 0..100, to code a frame of this type with.
    double quality(FrameType type) const;
    // A frame of this type at this quality has this error, mm: learns how error goes with quality. Gives whether the
    // frame is as asked for, or as near as the quality knob goes; else it should be coded again with quality().
    bool accept(FrameType type, double quality, double error);

private:
    double target_;
    // log2 of a frame's error over its step, by type: about 2/9 of the step at first, as measured.
    std::array<double, frame_type_count> log_ratio_;
};

}  // namespace htvm::internal
