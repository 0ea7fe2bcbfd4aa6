// The index of a stream, made while its packets go by.
#include <algorithm>

#include "codec/format/frame_kinds.h"
#include "htvm/decoder.hpp"
#include "htvm/stream_index.hpp"

namespace htvm {

using namespace internal;

void StreamIndexer::add(const Packet& packet, std::uint64_t offset) {
    numbers_.push(packet);
    time_.push(packet, numbers_.begins_sequence());
    if (packet.kind == PacketKind::sequence) header_offset_ = offset;
    const auto type = frame_type(packet.kind);
    if (!type) return;
    const std::uint64_t number = numbers_.of(packet.frame);
    if (index_.frames == 0) index_.first_timestamp_us = packet.timestamp_us;
    index_.frames = std::max(index_.frames, number + 1);
    if (numbers_.begins_sequence()) {
        index_.sequences.push_back({header_offset_, number});
        reference_.reset();
    }
    const auto& rules = rules_of(*type);
    const auto header = header_with_flags(packet);
    const bool alone = stands_alone(*type), referred = is_referred(header, rules);
    if (!alone && !(referred && header.has(packet_flag::access))) return;
    if (!index_.points.empty() && number <= index_.points.back().frame) return;
    std::uint32_t back = 0;
    if (!alone) {
        if (!reference_ || reference_->frame != packet.reference) return;
        // Whoever starts there reads the frame before anyway.
        if (!rules.renews && number == index_.points.back().frame + 1) return;
        back = static_cast<std::uint32_t>(index_.points.size() - reference_->entry);
    }
    if (rules.renews && referred) reference_ = Referred{packet.frame, index_.points.size()};
    index_.points.push_back({number, packet.timestamp_us, offset, back, header.flags});
}

void StreamIndexer::add(const SpaceBounds& bounds) { extend(index_.bounds, bounds); }

StreamIndex StreamIndexer::finish(std::uint64_t bytes) {
    index_.duration_us = time_.total_us();
    index_.bytes = bytes;
    return index_;
}

}  // namespace htvm
