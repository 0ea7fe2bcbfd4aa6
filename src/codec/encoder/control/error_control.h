// Error control: chooses the next frame's quality such that its surface error (M2) is the one asked for. Knows nothing
// of meshes: it sees frame types, qualities and errors.
#pragma once

#include <array>

#include "htvm/frame.hpp"

namespace htvm::internal {

class ErrorController {
public:
    // target: mm, > 0.
    explicit ErrorController(double target) : target_(target) { log_ratio_.fill(-2.15); }
    // The quality, 0..100, at which to code a frame of this type.
    double quality(FrameType type) const;
    // Learns how error depends on quality from a frame of this type that had this error (mm) at this quality. Gives
    // whether the frame is good enough: the error is as asked for, or quality cannot go further. If not, the frame
    // should be coded again with quality().
    bool accept(FrameType type, double quality, double error);

private:
    double target_;
    // log2(error / step) of a frame, by type. The start value, about 2/9 of the step, was measured.
    std::array<double, frame_type_count> log_ratio_;
};

}  // namespace htvm::internal
