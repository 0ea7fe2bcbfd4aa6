#include "htvm/running_time.hpp"

#include <algorithm>
#include <cmath>

#include "codec/format/sequence.h"
#include "htvm/decoder.hpp"

namespace htvm {

using namespace internal;

namespace {

std::uint64_t in_microseconds(double seconds) {
    constexpr double most = 9e12;  // in microseconds still a number of 64 bits
    return static_cast<std::uint64_t>(std::clamp(seconds, 0.0, most) * 1e6 + 0.5);
}

double span(std::int64_t first_us, std::int64_t last_us) {
    return (static_cast<double>(last_us) - static_cast<double>(first_us)) / 1e6;
}

}  // namespace

double seconds_of_frames(std::int64_t first_us, std::int64_t last_us, std::uint64_t frames, double of_one) {
    if (frames < 2) return frames == 0 ? 0 : of_one;
    const auto count = static_cast<double>(frames);
    const double seconds = span(first_us, last_us);
    // Frames missing between others are no reason for the last one to last longer: where the times are on the grid of
    // the frame rate, and more than half of its places have a frame.
    const double places = of_one > 0 ? std::round(seconds / of_one) : 0;
    const bool on_grid = std::abs(seconds - places * of_one) <= 0.1 * of_one;
    if (on_grid && places > count - 1 && places < 2 * (count - 1)) return seconds + of_one;
    return seconds * count / (count - 1);
}

void RunningTime::push(const Packet& packet, bool begins_sequence) {
    if (packet.kind == PacketKind::sequence)
        if (const auto header = read_sequence_header(packet.payload))
            of_one_ = static_cast<double>(header->fps_denominator) / header->fps_numerator;
    if (!frame_type(packet.kind)) return;
    if (begins_sequence && !in_the_middle_) {
        before_us_ = total_us();
        first_us_ = packet.timestamp_us;
        frames_ = 0;
    }
    in_the_middle_ = false;
    ++frames_;
    last_us_ = packet.timestamp_us;
    of_lone_ = of_one_;
}

void RunningTime::begin(std::int64_t first_timestamp_us) {
    first_us_ = last_us_ = first_timestamp_us;
    in_the_middle_ = true;
}

std::uint64_t RunningTime::total_us() const {
    return before_us_ + in_microseconds(seconds_of_frames(first_us_, last_us_, frames_, of_lone_));
}

std::uint64_t RunningTime::microseconds() const { return before_us_ + in_microseconds(span(first_us_, last_us_)); }

std::uint64_t RunningTime::one_frame_us() const { return in_microseconds(of_one_); }

}  // namespace htvm
