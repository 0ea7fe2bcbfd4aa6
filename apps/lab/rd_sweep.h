// The sweep itself: every coder at every quality over the whole sequence.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "metrics/compare.h"
#include "rd_coders.h"
#include "rd_result.h"
#include "rd_source.h"

namespace htvm::lab {

struct SweepJob {
    const CoderUnderTest* coder = nullptr;
    QualityPoint quality;
    std::filesystem::path keep_frames;  // decoded frames go here as PLY; empty: nowhere
};

struct SweepOptions {
    CompareOptions compare;
    std::size_t measure_every = 1;  // metrics on every so many-th frame, from the first; rates on all
    unsigned threads = 1;           // jobs at once; a job has its thread for coding and measuring
};

// Runs the jobs side by side, each on its own: one frame after the other is coded, decoded and measured. done(job,
// result) is called once a job, from one thread at a time, as soon as it is through; step() once a frame, likewise.
void sweep(const std::vector<SweepJob>& jobs, const SourceFrames& source, const SweepOptions& options,
           const std::function<void(std::size_t, Result<RdPoint>)>& done, const std::function<void()>& step);

}  // namespace htvm::lab
