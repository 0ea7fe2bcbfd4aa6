// Frames at the time at which they are due, by the clock.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>

namespace htvm::app {

// Says when a frame is due. The times follow from the first frame's, so they do not drift, however long it runs. What
// is late by more than a little is not made up for, which would be a burst: everything behind it is that much later.
class Pacing {
public:
    using Clock = std::chrono::steady_clock;
    Clock::time_point due(std::int64_t timestamp_us, Clock::time_point now) {
        if (!begun_) {
            begun_ = now;
            first_us_ = timestamp_us;
        }
        constexpr double most_seconds = 1e8;  // some years
        const double seconds = (static_cast<double>(timestamp_us) - static_cast<double>(first_us_)) / 1e6;
        const auto since = std::chrono::duration<double>(std::clamp(seconds, -most_seconds, most_seconds));
        const auto due = *begun_ + std::chrono::duration_cast<Clock::duration>(since);
        if (now - due <= a_little) return due;
        *begun_ += now - due;
        return now;
    }

private:
    static constexpr std::chrono::milliseconds a_little{100};
    std::optional<Clock::time_point> begun_;
    std::int64_t first_us_ = 0;
};

// Returns then, or soon after the program was interrupted.
void wait_until(Pacing::Clock::time_point time);

}  // namespace htvm::app
