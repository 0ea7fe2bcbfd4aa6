// The payload of the index at the beginning of a file. All numbers are differences from the entry before, and read with
// sums that wrap: they may be an attacker's.
#include <algorithm>
#include <bit>
#include <cmath>

#include "core/bytes.h"
#include "htvm/stream_index.hpp"

namespace htvm {

using namespace internal;
namespace {

constexpr std::uint8_t has_bounds = 1;

tl::unexpected<Error> corrupt(const char* what) {
    return fail(ErrorKind::corrupt_stream, std::string("index: ") + what);
}

bool is_sound(const SpaceBounds& bounds) {
    for (std::size_t axis = 0; axis < 3; ++axis)
        if (!std::isfinite(bounds.low[axis]) || !std::isfinite(bounds.high[axis]) ||
            bounds.low[axis] > bounds.high[axis])
            return false;
    return true;
}

}  // namespace

Packet write_index(const StreamIndex& index) {
    ByteWriter out;
    out.varint(index.frames);
    out.signed_varint(index.first_timestamp_us);
    out.varint(index.duration_us);
    out.varint(index.bytes);
    out.u8(index.bounds ? has_bounds : 0);
    if (index.bounds)
        for (const auto& corner : {index.bounds->low, index.bounds->high})
            for (const float c : corner) out.u32(std::bit_cast<std::uint32_t>(c));
    out.varint(index.sequences.size());
    SequencePoint sequence;
    for (const auto& next : index.sequences) {
        out.varint(next.offset - sequence.offset);
        out.varint(next.first_frame - sequence.first_frame);
        sequence = next;
    }
    out.varint(index.points.size());
    AccessPoint point;
    for (const auto& next : index.points) {
        out.varint(next.frame - point.frame);
        out.signed_varint(static_cast<std::int64_t>(static_cast<std::uint64_t>(next.timestamp_us) -
                                                    static_cast<std::uint64_t>(point.timestamp_us)));
        out.varint(next.offset - point.offset);
        out.varint(next.back);
        out.u8(next.flags);
        point = next;
    }
    Packet packet;
    packet.kind = PacketKind::front_index;
    packet.flags = packet_flag::flags_valid;
    packet.frame = static_cast<std::uint32_t>(index.frames);
    packet.timestamp_us = index.first_timestamp_us;
    packet.payload = out.take();
    return packet;
}

Result<StreamIndex> read_index(const Packet& packet) {
    if (packet.kind != PacketKind::front_index) return corrupt("the packet is another");
    ByteReader in(packet.payload);
    StreamIndex out;
    out.frames = in.varint();
    out.first_timestamp_us = in.signed_varint();
    out.duration_us = in.varint();
    out.bytes = in.varint();
    if (in.u8() & has_bounds) {
        auto& bounds = out.bounds.emplace();
        for (auto* corner : {&bounds.low, &bounds.high})
            for (auto& c : *corner) c = std::bit_cast<float>(in.u32());
        if (!is_sound(bounds)) return corrupt("its bounds are none");
    }
    SequencePoint sequence;
    for (std::uint64_t left = in.varint(); left > 0 && in.ok(); --left) {
        sequence.offset += in.varint();
        sequence.first_frame += in.varint();
        if (sequence.offset >= out.bytes) return corrupt("a sequence lies behind the end");
        if (in.ok()) out.sequences.push_back(sequence);
    }
    AccessPoint point;
    for (std::uint64_t left = in.varint(); left > 0 && in.ok(); --left) {
        point.frame += in.varint();
        point.timestamp_us = static_cast<std::int64_t>(static_cast<std::uint64_t>(point.timestamp_us) +
                                                       static_cast<std::uint64_t>(in.signed_varint()));
        point.offset += in.varint();
        const auto back = in.varint();
        point.flags = in.u8();
        if (back > out.points.size()) return corrupt("an entry refers to one that is not there");
        point.back = static_cast<std::uint32_t>(back);
        const auto* before = out.points.empty() ? nullptr : &out.points.back();
        if (point.offset >= out.bytes || point.frame >= out.frames ||
            (before && (point.frame <= before->frame || point.offset <= before->offset)))
            return corrupt("its entries do not ascend, or lie behind the end");
        if (in.ok()) out.points.push_back(point);
    }
    if (!in.ok()) return corrupt("it ends too early");
    return out;
}

const AccessPoint* point_before(const StreamIndex& index, std::uint64_t frame) {
    const AccessPoint* last = nullptr;
    const AccessPoint* followed = nullptr;
    for (const auto& point : index.points) {
        if (point.frame > frame) break;
        last = &point;
        if ((point.flags & packet_flag::referred) != 0) followed = &point;
    }
    return followed ? followed : last;
}

const SequencePoint* sequence_of(const StreamIndex& index, const AccessPoint& point) {
    const SequencePoint* out = nullptr;
    for (const auto& sequence : index.sequences)
        if (sequence.first_frame <= point.frame) out = &sequence;
    return out;
}

}  // namespace htvm
