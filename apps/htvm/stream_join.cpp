#include "stream_join.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "htvm/decoder.hpp"

namespace htvm::app {

Packet StreamJoin::moved(Packet packet) const {
    const auto by = static_cast<std::uint32_t>(stream_.number) - stream_.first;
    packet.frame += by;
    if (packet.kind != PacketKind::sequence) packet.reference += by;
    packet.timestamp_us = static_cast<std::int64_t>(static_cast<std::uint64_t>(packet.timestamp_us) +
                                                    static_cast<std::uint64_t>(stream_.later_us));
    return packet;
}

// With the same header it is the same sequence; with another one a new sequence begins.
void StreamJoin::begin_sequence(const Packet& frame) {
    const bool goes_on = header_ && *header_ == stream_.in_force->payload;
    const bool ascends = frames_ == 0 || frame.timestamp_us > last_us_;
    if (!goes_on) {
        next_number_ = 0;
        ++sequences_;
    } else if (!stream_.begun) {
        const double seconds = (static_cast<double>(frame.timestamp_us) - static_cast<double>(last_us_)) / 1e6;
        const double of_a_frame = static_cast<double>(stream_.time.one_frame_us()) / 1e6;
        // Half a frame more is jitter.
        if (!ascends || seconds > 1.5 * of_a_frame) stream_.pause_seconds = ascends ? seconds - of_a_frame : -1;
    }
    stream_.first = frame.frame;
    stream_.number = next_number_;
    stream_.later_us =
        ascends ? 0
                : static_cast<std::int64_t>(static_cast<std::uint64_t>(last_us_) + stream_.time.one_frame_us() -
                                            static_cast<std::uint64_t>(frame.timestamp_us));
    stream_.header = stream_.in_force;
    stream_.begun = true;
    header_ = stream_.in_force->payload;
}

// Numbers have 32 bits: those of one sequence must neither wrap nor come before its first one.
Result<void> StreamJoin::check_number(const Packet& frame) const {
    constexpr std::uint64_t most = std::numeric_limits<std::uint32_t>::max();
    if (frame.frame >= stream_.first && stream_.number + (frame.frame - stream_.first) <= most) return {};
    return fail(ErrorKind::limit, "frame " + std::to_string(frame.frame) +
                                      " cannot be numbered on behind the frames before it: frames of one sequence have "
                                      "numbers below 2^32");
}

Result<void> StreamJoin::write_frame(Packet packet) {
    if (auto ok = check_number(packet); !ok) return ok;
    auto frame = moved(std::move(packet));
    if (stream_.header) {
        auto header = moved(*std::exchange(stream_.header, std::nullopt));
        header.frame = frame.frame;
        header.timestamp_us = frame.timestamp_us;
        if (auto ok = output_.write(header); !ok) return ok;
    }
    for (auto& before : std::exchange(stream_.waiting, {}))
        if (auto ok = output_.write(moved(std::move(before))); !ok) return ok;
    ++frames_;
    next_number_ = std::max(next_number_, std::uint64_t{frame.frame} + 1);
    last_us_ = frame.timestamp_us;
    return output_.write(frame);
}

Result<void> StreamJoin::take(Packet packet) {
    stream_.numbers.push(packet);
    stream_.time.push(packet, stream_.numbers.begins_sequence());
    output_.add_bounds_of(packet);
    if (packet.kind == PacketKind::index || packet.kind == PacketKind::front_index) return {};
    if (packet.kind == PacketKind::sequence) {
        stream_.in_force = stream_.header = std::move(packet);
        return {};
    }
    // What comes behind a frame stays there, also behind the last one.
    const bool before_frame = !stream_.begun || stream_.header;
    const bool stays = packet.kind == PacketKind::audio || packet.kind == PacketKind::texture;
    if (stays && !before_frame) return output_.write(moved(std::move(packet)));
    if (!frame_type(packet.kind)) {
        stream_.waiting.push_back(std::move(packet));
        return {};
    }
    if (!stream_.in_force) return {};
    if (stream_.numbers.begins_sequence()) begin_sequence(packet);
    return write_frame(std::move(packet));
}

}  // namespace htvm::app
