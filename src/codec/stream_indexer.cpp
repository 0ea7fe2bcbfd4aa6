// The index of a stream, made while its packets go by.
#include <algorithm>

#include "codec/frame_kinds.h"
#include "codec/stream/sequence.h"
#include "htvm/decoder.hpp"
#include "htvm/stream_index.hpp"

namespace htvm {

using namespace internal;

void StreamIndexer::add(const Packet& packet, std::uint64_t offset) {
    numbers_.take(packet);
    if (packet.kind == PacketKind::sequence) {
        header_offset_ = offset;
        if (const auto header = read_sequence_header(packet.payload))
            seconds_of_one_frame_ = static_cast<double>(header->fps_denominator) / header->fps_numerator;
    }
    const auto type = frame_type(packet.kind);
    if (!type) return;
    const std::uint64_t number = numbers_.of(packet.frame);
    if (index_.frames == 0) index_.first_timestamp_us = packet.timestamp_us;
    index_.frames = std::max(index_.frames, number + 1);
    if (numbers_.begins_sequence()) {
        end_sequence();
        index_.sequences.push_back({header_offset_, number});
        first_us_ = packet.timestamp_us;
    }
    ++frames_of_sequence_;
    last_us_ = packet.timestamp_us;
    if (!stands_alone(*type)) return;
    const bool ascends = index_.points.empty() || number > index_.points.back().frame;
    if (ascends) index_.points.push_back({number, packet.timestamp_us, offset, 0, told_header(packet).flags});
}

void StreamIndexer::add(const SpaceBounds& bounds) {
    index_.bounds = index_.bounds ? united(*index_.bounds, bounds) : bounds;
}

void StreamIndexer::end_sequence() {
    if (frames_of_sequence_ == 0) return;
    double seconds = seconds_of_one_frame_;
    if (frames_of_sequence_ > 1) {
        const auto frames = static_cast<double>(frames_of_sequence_);
        seconds = (static_cast<double>(last_us_) - static_cast<double>(first_us_)) / 1e6 * frames / (frames - 1);
    }
    constexpr double most_seconds = 9e12;  // in microseconds still a number of 64 bits
    index_.duration_us += static_cast<std::uint64_t>(std::clamp(seconds, 0.0, most_seconds) * 1e6 + 0.5);
    frames_of_sequence_ = 0;
}

StreamIndex StreamIndexer::finish(std::uint64_t bytes) {
    end_sequence();
    index_.bytes = bytes;
    return index_;
}

}  // namespace htvm
