#include "live/hub/hub_message.h"

#include <algorithm>

#include "core/bytes.h"

namespace htvm::live {
namespace {

using internal::ByteReader;
using internal::ByteWriter;

constexpr std::uint32_t part_mark = 0x31485448;  // "HTH1": the first version
constexpr std::size_t part_header_bytes = 24, most_begun = 256;
constexpr std::size_t longest_text = 1024;  // of names and addresses
constexpr std::uint8_t published_bit = 1, clock_bit = 2, closure_bit = 1, key_frame_bit = 2;

std::uint8_t flags(bool first, std::uint8_t first_bit, bool second, std::uint8_t second_bit) {
    return static_cast<std::uint8_t>((first ? first_bit : 0) | (second ? second_bit : 0));
}

void put(ByteWriter& out, const std::string& text) {
    const auto length = std::min(text.size(), longest_text);
    out.u16(static_cast<std::uint16_t>(length));
    out.bytes({reinterpret_cast<const std::uint8_t*>(text.data()), length});
}

std::optional<std::string> get_text(ByteReader& in) {
    const auto length = in.u16();
    if (length > longest_text) return std::nullopt;
    const auto bytes = in.bytes(length);
    return std::string(bytes.begin(), bytes.end());
}

void put(ByteWriter& out, const Claim& claim) {
    out.u64(claim.hub);
    out.u64(static_cast<std::uint64_t>(claim.began));
}

Claim get_claim(ByteReader& in) {
    Claim out;
    out.hub = in.u64();
    out.began = static_cast<std::int64_t>(in.u64());
    return out;
}

// Each message is the number of its alternative in HubMessage, and then:

void write(ByteWriter& out, const Announcement& message) {
    put(out, message.hub);
    put(out, message.url);
    out.u32(static_cast<std::uint32_t>(message.streams.size()));
    for (const auto& stream : message.streams) {
        put(out, stream.stream);
        out.u64(static_cast<std::uint64_t>(stream.began));
        out.u64(stream.checksum);
        out.u8(flags(stream.published, published_bit, stream.clock.has_value(), clock_bit));
        out.u64(static_cast<std::uint64_t>(stream.clock.value_or(0)));
        out.u64(stream.next);
    }
}

void write(ByteWriter& out, const PublishedPacket& message) {
    put(out, message.stream);
    put(out, message.claim);
    out.u64(message.packet.number);
    out.bytes(message.packet.bytes);
}

void write(ByteWriter& out, const StreamRequest& message) {
    put(out, message.stream);
    put(out, message.claim);
    out.u32(message.viewers);
    out.u8(flags(message.closure, closure_bit, message.key_frame, key_frame_bit));
}

void write(ByteWriter& out, const ClosureAnswer& message) {
    put(out, message.stream);
    put(out, message.claim);
    out.u64(message.next);
    out.u32(static_cast<std::uint32_t>(message.packets.size()));
    for (const auto& packet : message.packets) {
        out.u64(packet.number);
        out.u32(static_cast<std::uint32_t>(packet.bytes.size()));
        out.bytes(packet.bytes);
    }
}

// Counts are of items that follow, so each is checked against the bytes left before there is room made for it.
std::optional<HubMessage> read_announcement(ByteReader& in) {
    constexpr std::size_t least_stream_bytes = 35;
    const auto hub = get_text(in), url = get_text(in);
    const auto count = in.u32();
    if (!hub || !url || count > in.remaining() / least_stream_bytes) return std::nullopt;
    Announcement out{*hub, *url, std::vector<AnnouncedStream>(count)};
    for (auto& stream : out.streams) {
        const auto name = get_text(in);
        if (!name) return std::nullopt;
        stream.stream = *name;
        stream.began = static_cast<std::int64_t>(in.u64());
        stream.checksum = in.u64();
        const auto bits = in.u8();
        stream.published = (bits & published_bit) != 0;
        const auto clock = static_cast<std::int64_t>(in.u64());
        if ((bits & clock_bit) != 0) stream.clock = clock;
        stream.next = in.u64();
    }
    return out;
}

std::optional<HubMessage> read_packet(ByteReader& in) {
    const auto stream = get_text(in);
    if (!stream) return std::nullopt;
    PublishedPacket out{*stream, get_claim(in), {}};
    out.packet.number = in.u64();
    const auto bytes = in.bytes(in.remaining());
    out.packet.bytes.assign(bytes.begin(), bytes.end());
    return out;
}

std::optional<HubMessage> read_request(ByteReader& in) {
    const auto stream = get_text(in);
    if (!stream) return std::nullopt;
    StreamRequest out{*stream, get_claim(in)};
    out.viewers = in.u32();
    const auto bits = in.u8();
    out.closure = (bits & closure_bit) != 0;
    out.key_frame = (bits & key_frame_bit) != 0;
    return out;
}

std::optional<HubMessage> read_closure(ByteReader& in) {
    constexpr std::size_t least_packet_bytes = 12;
    const auto stream = get_text(in);
    if (!stream) return std::nullopt;
    ClosureAnswer out{*stream, get_claim(in), 0, {}};
    out.next = in.u64();
    const auto count = in.u32();
    if (count > in.remaining() / least_packet_bytes) return std::nullopt;
    out.packets.resize(count);
    for (auto& packet : out.packets) {
        packet.number = in.u64();
        const auto bytes = in.bytes(in.u32());
        packet.bytes.assign(bytes.begin(), bytes.end());
        if (!in.ok() || packet.number >= out.next) return std::nullopt;
    }
    return out;
}

}  // namespace

Bytes write_hub_message(const HubMessage& message) {
    ByteWriter out;
    out.u8(static_cast<std::uint8_t>(message.index()));
    std::visit([&](const auto& alternative) { write(out, alternative); }, message);
    return out.take();
}

Result<HubMessage> read_hub_message(std::span<const std::uint8_t> bytes) {
    ByteReader in(bytes);
    const auto kind = in.u8();
    auto message = kind == 0   ? read_announcement(in)
                   : kind == 1 ? read_packet(in)
                   : kind == 2 ? read_request(in)
                   : kind == 3 ? read_closure(in)
                               : std::nullopt;
    if (!message || !in.ok() || in.remaining() > 0) return fail(ErrorKind::bad_input, "not a message between hubs");
    return std::move(*message);
}

std::vector<Bytes> cut_into_parts(std::uint64_t hub, std::uint64_t number, std::span<const std::uint8_t> message,
                                  std::size_t part_bytes) {
    const auto count = std::max<std::size_t>(1, (message.size() + part_bytes - 1) / part_bytes);
    std::vector<Bytes> out;
    if (count > most_parts) return out;
    for (std::size_t part = 0; part < count; ++part) {
        ByteWriter bytes;
        bytes.u32(part_mark);
        bytes.u64(hub);
        bytes.u64(number);
        bytes.u16(static_cast<std::uint16_t>(part));
        bytes.u16(static_cast<std::uint16_t>(count));
        bytes.bytes(message.subspan(part * part_bytes, std::min(part_bytes, message.size() - part * part_bytes)));
        out.push_back(bytes.take());
    }
    return out;
}

std::optional<PartReader::Whole> PartReader::add(std::span<const std::uint8_t> bytes) {
    ByteReader in(bytes);
    const bool marked = in.u32() == part_mark;
    const auto hub = in.u64(), number = in.u64();
    const std::size_t part = in.u16(), parts = in.u16();
    if (!in.ok() || !marked || part >= parts || parts > most_parts ||
        bytes.size() > part_header_bytes + most_part_bytes) {
        ++damaged_;
        return std::nullopt;
    }
    const auto content = bytes.subspan(part_header_bytes);
    if (parts == 1) return Whole{hub, {content.begin(), content.end()}};
    const Key key{hub, number};
    const auto [found, first] = begun_.try_emplace(key);
    auto& begun = found->second;
    if (first) {
        begun.age = next_age_++;
        begun.missing = parts;
        begun.parts.resize(parts);
        by_age_[begun.age] = key;
    }
    if (begun.parts.size() != parts) {
        ++damaged_;
        return std::nullopt;
    }
    if (begun.parts[part]) return std::nullopt;  // doubled
    begun.parts[part].emplace(content.begin(), content.end());
    bytes_ += content.size();
    if (--begun.missing == 0) {
        Whole out{hub, {}};
        for (const auto& piece : begun.parts) {
            out.message.insert(out.message.end(), piece->begin(), piece->end());
            bytes_ -= piece->size();
        }
        by_age_.erase(begun.age);
        begun_.erase(found);
        return out;
    }
    while (bytes_ > most_bytes_ || begun_.size() > most_begun) give_up_oldest();
    return std::nullopt;
}

void PartReader::give_up_oldest() {
    const auto oldest = by_age_.begin();
    const auto found = begun_.find(oldest->second);
    for (const auto& part : found->second.parts)
        if (part) bytes_ -= part->size();
    begun_.erase(found);
    by_age_.erase(oldest);
    ++incomplete_;
}

std::string announcements_subject() { return "htvm.v1.announcements"; }

std::string hub_subject(std::uint64_t hub) {
    std::string out = "htvm.v1.hub.";
    for (int shift = 60; shift >= 0; shift -= 4) out += "0123456789abcdef"[(hub >> shift) & 15];
    return out;
}

std::string packets_subject(std::string_view stream) {
    std::string out = "htvm.v1.packets.";
    for (const char c : stream) {
        const bool plain =
            (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
        if (plain) {
            out += c;
            continue;
        }
        const auto byte = static_cast<std::uint8_t>(c);
        out += '=';
        out += "0123456789ABCDEF"[byte >> 4];
        out += "0123456789ABCDEF"[byte & 15];
    }
    return out;
}

}  // namespace htvm::live
