// How long something took, counted by how long: what Prometheus calls a histogram.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace htvm::live {

class Histogram {
public:
    // Seconds: an event counts below the first that is not less.
    static constexpr std::array<double, 14> bounds = {0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05,
                                                      0.1,    0.25,  0.5,    1,     2.5,  5,     10};

    void add(std::chrono::steady_clock::duration time) {
        const auto seconds = std::chrono::duration<double>(time).count();
        const auto place = std::lower_bound(bounds.begin(), bounds.end(), seconds) - bounds.begin();
        ++counts_[static_cast<std::size_t>(place)];
        seconds_ += seconds;
    }
    // Those up to each of the bounds, and behind these all.
    std::array<std::uint64_t, bounds.size() + 1> up_to() const {
        auto out = counts_;
        for (std::size_t i = 1; i < out.size(); ++i) out[i] += out[i - 1];
        return out;
    }
    double seconds() const { return seconds_; }

private:
    std::array<std::uint64_t, bounds.size() + 1> counts_{};
    double seconds_ = 0;
};

}  // namespace htvm::live
