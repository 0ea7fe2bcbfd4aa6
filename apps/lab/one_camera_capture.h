// What stands in for the paper's "Alex", a person captured by a single depth camera whose neighbouring pixels are
// joined where there is no step between them: the synthetic person before one Kinect, made in memory, with the true
// skeleton.
#pragma once

#include <string>
#include <vector>

#include "core/thread.h"
#include "htvm/result.hpp"
#include "htvm/skeleton.hpp"
#include "sweep.h"

namespace htvm::lab {

struct OneCameraCapture {
    SourceFrames source;
    std::vector<Pose> true_poses;  // one per frame, without the noise of tracking
    std::string key;               // everything that the capture depends on
};

// Frames from the first one on; the same for any number of threads.
Result<OneCameraCapture> one_camera_capture(int frames, const SourceOptions& options, internal::Threads threads);

}  // namespace htvm::lab
