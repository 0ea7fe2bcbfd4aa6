#include "htvm/running_time.hpp"

#include <algorithm>

#include "codec/stream/sequence.h"
#include "htvm/decoder.hpp"

namespace htvm {

using namespace internal;

namespace {

std::uint64_t in_microseconds(double seconds) {
    constexpr double most = 9e12;  // in microseconds still a number of 64 bits
    return static_cast<std::uint64_t>(std::clamp(seconds, 0.0, most) * 1e6 + 0.5);
}

}  // namespace

void RunningTime::take(const Packet& packet, bool begins_sequence) {
    if (packet.kind == PacketKind::sequence)
        if (const auto header = read_sequence_header(packet.payload))
            one_frame_us_ = in_microseconds(static_cast<double>(header->fps_denominator) / header->fps_numerator);
    if (!frame_type(packet.kind)) return;
    if (begins_sequence && !in_the_middle_) {
        before_us_ = total_us();
        first_us_ = packet.timestamp_us;
        frames_ = 0;
    }
    in_the_middle_ = false;
    ++frames_;
    last_us_ = packet.timestamp_us;
    lone_us_ = one_frame_us_;
}

void RunningTime::begin(std::int64_t first_timestamp_us) {
    first_us_ = last_us_ = first_timestamp_us;
    in_the_middle_ = true;
}

std::uint64_t RunningTime::total_us() const {
    if (frames_ == 0) return before_us_;
    if (frames_ == 1) return before_us_ + lone_us_;
    const auto frames = static_cast<double>(frames_);
    return before_us_ + in_microseconds(span() * frames / (frames - 1));
}

std::uint64_t RunningTime::microseconds() const { return before_us_ + in_microseconds(span()); }

double RunningTime::span() const { return (static_cast<double>(last_us_) - static_cast<double>(first_us_)) / 1e6; }

}  // namespace htvm
