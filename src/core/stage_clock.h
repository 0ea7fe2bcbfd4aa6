// Measures how long the stages of a frame take.
#pragma once

#include <chrono>
#include <vector>

#include "htvm/stage_time.hpp"

namespace htvm::internal {

class StageClock {
public:
    explicit StageClock(std::vector<StageTime>& stages) : stages_(stages) {}
    // Assigns the time since the last call, or since construction, to this stage.
    void done(const char* stage) {
        const auto now = std::chrono::steady_clock::now();
        stages_.push_back({stage, std::chrono::duration<double, std::milli>(now - last_).count()});
        last_ = now;
    }

private:
    std::vector<StageTime>& stages_;
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace htvm::internal
