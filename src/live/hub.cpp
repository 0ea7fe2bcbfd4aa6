#include "live/hub.h"

#include <utility>

#include "core/bytes.h"
#include "core/crc32.h"

namespace htvm::live {
namespace {

// The header of a message that is exactly one sound packet.
std::optional<PacketHeader> header_of(std::span<const std::uint8_t> message, std::size_t most_bytes) {
    std::uint32_t payload_bytes = 0;
    const auto header = read_packet_header(message, payload_bytes);
    if (!header || payload_bytes > most_bytes || message.size() != packet_overhead + payload_bytes) return std::nullopt;
    const auto payload = message.subspan(packet_header_bytes, payload_bytes);
    internal::ByteReader checksum(message.last(sizeof(std::uint32_t)));
    if (checksum.u32() != internal::crc32(payload)) return std::nullopt;
    return header;
}

}  // namespace

Result<Hub::Publisher> Hub::publish(const std::string& name, std::function<void(const std::string&)> taken_over) {
    if (!streams_.contains(name) && streams_.size() >= limits_.streams)
        return fail(ErrorKind::limit, "there are as many streams as this hub carries");
    const auto number = next_connection_++;
    connections_[number] = {name, false, std::move(taken_over)};
    return Publisher{number};
}

// The first packet decides whose stream it is.
Result<void> Hub::admit(std::uint64_t number, Connection& connection, const PacketHeader& header,
                        Clock::time_point now) {
    if (header.kind != PacketKind::sequence || !header.has(packet_flag::told))
        return fail(ErrorKind::bad_input, "the first packet must be a sequence header of version 2");
    const auto known = streams_.find(connection.stream);
    if (known == streams_.end()) {
        if (streams_.size() >= limits_.streams)
            return fail(ErrorKind::limit, "there are as many streams as this hub carries");
        auto& stream = streams_[connection.stream];
        stream.number = next_stream_++;
        stream.broadcast = Broadcast(limits_.broadcast);
    } else if (known->second.connection) {
        auto& stream = known->second;
        const bool same = stream.session == header.reference;
        if (!same && now - stream.heard < limits_.silence)
            return fail(ErrorKind::bad_input,
                        "'" + connection.stream + "' is being published by another session; end that one, or wait");
        const auto before = connections_.extract(*stream.connection);
        before.mapped().taken_over(same ? "this session was continued by another connection"
                                        : "another session took the stream over");
    } else if (known->second.session != header.reference && now - known->second.heard < limits_.silence) {
        return fail(ErrorKind::bad_input,
                    "'" + connection.stream + "' was published by another session a moment ago; wait for two seconds");
    }
    auto& stream = streams_.at(connection.stream);
    stream.connection = number;
    stream.session = header.reference;
    connection.admitted = true;
    return {};
}

Result<void> Hub::take(Publisher publisher, std::vector<std::uint8_t> message, Clock::time_point now) {
    const auto found = connections_.find(publisher.connection);
    if (found == connections_.end())
        return fail(ErrorKind::bad_input, "the stream was taken over by another connection");
    auto& connection = found->second;
    auto header = header_of(message, limits_.packet_bytes);
    if (!connection.admitted) {
        if (!header) return fail(ErrorKind::bad_input, "the first message is not a packet");
        if (auto ok = admit(publisher.connection, connection, *header, now); !ok) return ok;
    }
    auto& stream = streams_.at(connection.stream);
    if (!header) {
        ++stream.counters.damaged;
        return {};
    }
    // The same connection may begin another session, such as the next round of a loop.
    if (header->kind == PacketKind::sequence) stream.session = header->reference;
    stream.heard = now;
    ++stream.counters.packets;
    stream.counters.bytes += message.size();
    stream.broadcast.push(std::make_shared<LivePacket>(LivePacket{*header, std::move(message)}), now);
    return {};
}

void Hub::leave(Publisher publisher, Clock::time_point now) {
    const auto found = connections_.find(publisher.connection);
    if (found == connections_.end()) return;
    if (found->second.admitted) {
        auto& stream = streams_.at(found->second.stream);
        stream.connection.reset();
        stream.heard = now;
    }
    connections_.erase(found);
}

Result<Hub::Viewer> Hub::watch(const std::string& name, std::function<void()> wake, std::function<void()> gone,
                               Clock::time_point now) {
    const auto found = streams_.find(name);
    if (found == streams_.end()) return fail(ErrorKind::bad_input, "there is no stream '" + name + "'");
    auto& stream = found->second;
    if (stream.broadcast.viewers() >= limits_.viewers)
        return fail(ErrorKind::limit, "'" + name + "' has as many viewers as this hub serves");
    const auto viewer = stream.broadcast.join(std::move(wake), now);
    stream.gone[viewer] = std::move(gone);
    return Viewer{name, stream.number, viewer};
}

// Null if it has ended.
Hub::Stream* Hub::stream_of(const Viewer& viewer) {
    const auto found = streams_.find(viewer.stream);
    return found == streams_.end() || found->second.number != viewer.number ? nullptr : &found->second;
}

void Hub::leave(const Viewer& viewer) {
    auto* stream = stream_of(viewer);
    if (!stream) return;
    stream->broadcast.leave(viewer.viewer);
    stream->gone.erase(viewer.viewer);
}

SharedPacket Hub::next(const Viewer& viewer) {
    auto* stream = stream_of(viewer);
    return stream ? stream->broadcast.next(viewer.viewer) : nullptr;
}

void Hub::tidy(Clock::time_point now) {
    for (auto it = streams_.begin(); it != streams_.end();) {
        auto& stream = it->second;
        if (stream.connection || now - stream.heard <= limits_.remembered_without_publisher) {
            ++it;
            continue;
        }
        const auto gone = std::move(stream.gone);
        it = streams_.erase(it);
        for (const auto& [viewer, tell] : gone) tell();
    }
}

std::vector<StreamInfo> Hub::streams() const {
    std::vector<StreamInfo> out;
    for (const auto& [name, stream] : streams_) {
        StreamInfo info{name,
                        stream.connection.has_value(),
                        stream.broadcast.viewers(),
                        stream.counters,
                        stream.broadcast.undecodable_frames(),
                        0};
        for (const auto& [viewer, tell] : stream.gone)
            info.dropped_frames += stream.broadcast.counters(viewer).dropped_frames;
        out.push_back(std::move(info));
    }
    return out;
}

}  // namespace htvm::live
