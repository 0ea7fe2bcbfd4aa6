// How many bits a second a live encoder should make, by how its packets get on.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>

namespace htvm::app {

// What is known of the line when a frame was sent.
struct LineState {
    std::chrono::steady_clock::time_point now{};
    bool connected = false;
    std::chrono::milliseconds wait{};  // of the first packet that has not been sent
    std::uint64_t sent_bytes = 0;      // in all
};

// Where packets wait, the line carries less than is made: the rate falls below what was sent meanwhile, so that what
// waits goes away. Where nothing has waited for a while, it rises again, slowly, up to what was asked for: a line tells
// that it is full only by letting packets wait.
class LineRate {
public:
    explicit LineRate(double bits_per_second) : wanted_(bits_per_second), rate_(bits_per_second) {}
    // After each frame. The rate from now on, bits per second, where it changes.
    std::optional<double> follow(const LineState& line);
    double bits_per_second() const { return rate_; }

private:
    using Time = std::chrono::steady_clock::time_point;
    struct Sent {
        Time time;
        std::uint64_t bytes;
    };
    std::optional<double> change(double bits_per_second, Time now);

    double wanted_, rate_;
    std::deque<Sent> sent_;  // in the last second
    Time changed_{}, waited_{};
};

}  // namespace htvm::app
