// What became of a bitrate or a target error: for the summary of htvm encode and its JSON.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "buffer_model.h"
#include "htvm/encoder.hpp"

namespace htvm::app {

struct RateReport {
    explicit RateReport(const EncoderOptions& options);
    bool rate_controlled() const { return bits_per_second > 0; }
    bool controlled() const { return bits_per_second > 0 || target_error > 0; }

    double bits_per_second = 0, buffer_seconds = 0, target_error = 0;  // as asked for; 0: not
    BufferModel buffer;
    std::vector<FrameCost> costs;      // one a frame of the capture, of 0 bits where it was dropped
    std::vector<std::size_t> dropped;  // frames of the capture
};

void add_coded(RateReport& report, const FrameCost& cost);
void add_dropped(RateReport& report);

struct QualityRange {
    double lowest = 0, mean = 0, highest = 0;
};
// Over the frames whose bits depend on it, that is all but P-frames and dropped ones.
QualityRange quality_range(const RateReport& report);

// bytes: of the stream; seconds: of the capture, dropped frames among them.
std::string rate_summary(const RateReport& report, std::uint64_t bytes, double seconds);
nlohmann::json rate_json(const RateReport& report, std::uint64_t bytes, double seconds);

}  // namespace htvm::app
