#include "line_rate.h"

#include <algorithm>

namespace htvm::app {
namespace {

using namespace std::chrono_literals;

constexpr auto window = 1000ms;     // over which is measured what the line carries
constexpr auto too_long = 250ms;    // waiting that means that the line is full, not that a large frame is on its way
constexpr auto effect = 500ms;      // until a change shows
constexpr auto patience = 2000ms;   // without waiting, before the rate rises
constexpr double below = 0.85;      // of what the line carries, so that what waits goes away
constexpr double rise = 1.08;       // each time
constexpr double least = 1.0 / 16;  // of the rate asked for: below that a picture is not worth having

}  // namespace

std::optional<double> LineRate::change(double bits_per_second, Time now) {
    const double next = std::clamp(bits_per_second, wanted_ * least, wanted_);
    if (next == rate_) return std::nullopt;
    changed_ = now;
    rate_ = next;
    return rate_;
}

std::optional<double> LineRate::follow(const LineState& line) {
    const auto now = line.now;
    if (changed_ == Time{}) changed_ = waited_ = now;
    // What was sent while nobody listened says nothing of the line.
    if (!line.connected) {
        sent_.clear();
        waited_ = now;
        return std::nullopt;
    }
    sent_.push_back({now, line.sent_bytes});
    while (sent_.size() > 2 && now - sent_[1].time >= window) sent_.pop_front();
    if (line.wait >= too_long) {
        waited_ = now;
        const double seconds = std::chrono::duration<double>(now - sent_.front().time).count();
        if (now - changed_ < effect || seconds * 2 < std::chrono::duration<double>(window).count()) return std::nullopt;
        const double carried = 8.0 * static_cast<double>(line.sent_bytes - sent_.front().bytes) / seconds;
        return change(std::min(below * carried, below * rate_), now);
    }
    if (line.wait > 50ms) waited_ = now;
    if (now - waited_ < patience || now - changed_ < effect) return std::nullopt;
    return change(rate_ * rise, now);
}

}  // namespace htvm::app
