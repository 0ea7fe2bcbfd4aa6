#include "live_rounds.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "codec/format/sequence.h"
#include "htvm/decoder.hpp"

namespace htvm::app {

using namespace internal;

void LiveRounds::begin_round() {
    numbers_ = {};
    header_.reset();
    waiting_.clear();
    begun_ = false;
}

Result<Packet> LiveRounds::header_of_session(const Packet& header) const {
    auto read = read_sequence_header(header.payload);
    if (!read) return tl::unexpected(read.error());
    if (read->version < session_version)
        return fail(ErrorKind::unsupported,
                    "streams of version " + std::to_string(read->version) + " cannot be live; encode it again");
    read->session = drawn_;
    auto out = sequence_packet(*read);
    out.frame = header.frame;
    out.timestamp_us = header.timestamp_us;
    return out;
}

Packet LiveRounds::in_time(Packet packet) const {
    packet.timestamp_us =
        std::llround(std::clamp((static_cast<double>(packet.timestamp_us) + later_us_) / speed_, -9e15, 9e15));
    return packet;
}

Result<std::vector<Packet>> LiveRounds::take(Packet packet) {
    std::vector<Packet> out;
    if (packet.kind == PacketKind::index || packet.kind == PacketKind::front_index) return out;
    numbers_.push(packet);
    time_.push(packet, numbers_.begins_sequence());
    const bool frame = frame_type(packet.kind).has_value();
    if (packet.kind == PacketKind::sequence) {
        header_ = std::move(packet);
        return out;
    }
    // What comes behind a frame stays there.
    if (!frame && (!begun_ || header_)) {
        waiting_.push_back(std::move(packet));
        return out;
    }
    if (frame) {
        if (!header_ && !begun_) return out;  // nobody could decode it
        if (numbers_.begins_sequence()) drawn_ = session_();
        later_us_ = static_cast<double>(time_.microseconds() + put_off_us_) - static_cast<double>(packet.timestamp_us);
        begun_ = true;
        ++frames_;
    }
    if (header_) {
        auto header = header_of_session(*std::exchange(header_, std::nullopt));
        if (!header) return tl::unexpected(header.error());
        header->frame = packet.frame;
        header->timestamp_us = packet.timestamp_us;
        out.push_back(in_time(std::move(*header)));
    }
    for (auto& before : std::exchange(waiting_, {})) out.push_back(in_time(std::move(before)));
    out.push_back(in_time(std::move(packet)));
    return out;
}

}  // namespace htvm::app
