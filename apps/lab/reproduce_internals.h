// One run of the paper's coder, looked into: its layers, distance orders and times frame by frame (figures 21 to 25).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "htvm/frame.hpp"
#include "htvm/result.hpp"
#include "rd_source.h"

namespace htvm::lab {

struct InternalFrame {
    FrameInfo info;
    double encode_ms = 0, decode_ms = 0;  // wall clock
};

struct StageMean {
    std::string stage;
    double milliseconds = 0;  // mean over the EP-frames
};

struct InternalRun {
    double quality = 50, geometry_step = 2, colour_step = 6;
    unsigned threads = 1;
    std::vector<InternalFrame> frames;
    std::vector<StageMean> stages;                     // of encoding an EP-frame
    std::vector<std::uint64_t> distance_order_counts;  // inside frame `order_frame`, the escapes last; may be empty
    std::size_t order_frame = 0;
    double bits_per_vertex = 0;  // of all frames
};

// The quality of 20, 25 ... 95 whose rate over EP-frames in the middle and at the end is nearest to `rate`, bpvf.
Result<double> quality_near_rate(const SourceFrames& source, double rate, int key_interval, unsigned threads);

// The paper's coder over the whole sequence.
Result<InternalRun> run_internals(const SourceFrames& source, double quality, int key_interval, unsigned threads);

// Bits per captured vertex of one layer of one EP-frame each.
std::vector<double> layer_rates(const InternalRun& run, std::size_t (*bytes)(const LayerBytes&));

double mean_of(const std::vector<double>& values);  // 0 of none

}  // namespace htvm::lab
