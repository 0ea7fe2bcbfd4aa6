#include "live/hub/hub.h"

#include <algorithm>
#include <utility>

#include "codec/format/sequence.h"
#include "core/bytes.h"
#include "core/crc32.h"

namespace htvm::live {
namespace {

// Text messages: viewers have little to say; a publisher may stamp each frame.
constexpr double viewer_burst = 50, viewer_texts_each_second = 10;
constexpr double publisher_burst = 1000, publisher_texts_each_second = 500;

constexpr const char* memory_used_up = "this hub's memory for packets is used up";
constexpr const char* too_many_streams = "there are as many streams as this hub carries";
constexpr const char* too_much_of_nothing = "too many messages that carry nothing";
constexpr const char* connection_ended = "the connection has ended";

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

std::int64_t microseconds(Hub::Clock::duration time) {
    return std::chrono::duration_cast<std::chrono::microseconds>(time).count();
}

CloseCode code_of(const Error& error) {
    return error.kind == ErrorKind::limit ? CloseCode::try_later : CloseCode::refused;
}

// Why the connection of whoever sent this text message ends; nothing if it may go on.
template <class Message>
std::optional<Closing> text_refused(std::string_view text, const Result<Message>& message, TextAllowance& allowance,
                                    Hub::Clock::time_point now) {
    if (message && allowance.allow(now)) return std::nullopt;
    return Closing{text.size() > most_text_bytes ? CloseCode::too_large : CloseCode::refused,
                   message ? "too many text messages" : message.error().message};
}

std::optional<std::uint64_t> session_of(const std::optional<StreamInfo::Header>& header) {
    return header && header->session != 0 ? std::optional(header->session) : std::nullopt;
}

// Beginning with another one for each viewer: clients try them in this order, and those who lose a hub at the same
// moment spread over all others instead of falling upon the first.
std::vector<std::string> in_turn(std::vector<std::string> hubs, std::uint64_t viewer) {
    if (!hubs.empty())
        std::rotate(hubs.begin(), hubs.begin() + static_cast<std::ptrdiff_t>(viewer % hubs.size()), hubs.end());
    return hubs;
}

}  // namespace

// ---- Clocks and allowances ------------------------------------------------------------------------------------------

void PublisherClock::tell(std::int64_t clock_us, Clock::time_point now) {
    // Few enough that two clocks that differ in speed, by 0.02 % at most, stay together within two milliseconds.
    constexpr std::size_t remembered = 8;
    constexpr std::int64_t step = 500'000;
    const auto ahead = clock_us - microseconds(now.time_since_epoch());
    // The clock was set back, or the publisher itself was held up.
    if (!ahead_us_.empty() && *std::max_element(ahead_us_.begin(), ahead_us_.end()) - ahead > step) forget();
    ahead_us_.push_back(ahead);
    if (ahead_us_.size() > remembered) ahead_us_.pop_front();
}

std::optional<std::int64_t> PublisherClock::at(Clock::time_point now) const {
    if (ahead_us_.empty()) return std::nullopt;
    return microseconds(now.time_since_epoch()) + *std::max_element(ahead_us_.begin(), ahead_us_.end());
}

bool TextAllowance::allow(Clock::time_point now) {
    const std::chrono::duration<double> passed = now - last_;
    left_ = std::min(burst_, left_ + passed.count() * each_second_);
    last_ = now;
    if (left_ < 1) return false;
    left_ -= 1;
    return true;
}

// ---- Publishers -----------------------------------------------------------------------------------------------------

Result<Hub::Publisher> Hub::publish(const std::string& name, std::function<void()> wake, Clock::time_point now) {
    // Whoever connects again and again without a first packet has one connection's memory, not one for each.
    for (auto& [number, other] : connections_)
        if (other.stream == name && !other.admitted && !other.closing) {
            ++counters_.refused_publishers_limit;
            static_cast<void>(
                refuse(other, {ErrorKind::limit, "a newer connection publishes this stream"}, CloseCode::try_later));
        }
    if (!has_place_for(name)) {
        ++counters_.refused_publishers_limit;
        return fail(ErrorKind::limit, too_many_streams);
    }
    return connect(name, std::move(wake), now);
}

// Connections that have yet to begin their stream take its place already.
bool Hub::has_place_for(const std::string& name) const {
    if (streams_.contains(name)) return true;
    std::size_t waiting = 0;
    for (const auto& [number, other] : connections_)
        waiting += !other.admitted && !other.closing && !streams_.contains(other.stream) ? 1u : 0u;
    return streams_.size() + waiting < limits_.streams;
}

Hub::Publisher Hub::connect(const std::string& name, std::function<void()> wake, Clock::time_point now) {
    const auto number = next_connection_++;
    connections_.emplace(number, Connection{.stream = name,
                                            .share = memory_.share_of(name),
                                            .wake = std::move(wake),
                                            .allowance = {publisher_burst, publisher_texts_each_second},
                                            .heard = now,
                                            .heartbeat_at = now + limits_.heartbeat});
    return Publisher{number};
}

// Begins it if there is none.
Hub::Stream& Hub::stream_named(const std::string& name) {
    const auto [found, first] = streams_.try_emplace(name);
    auto& stream = found->second;
    if (!first) return stream;
    stream.number = next_stream_++;
    stream.broadcast = Broadcast(limits_.broadcast);
    stream.share = memory_.share_of(name);
    return stream;
}

// The stream that the connection publishes; null if none.
Hub::Stream* Hub::published_by(const Connection& connection) {
    const auto found = streams_.find(connection.stream);
    return connection.admitted && found != streams_.end() ? &found->second : nullptr;
}

bool Hub::is_far(const Stream& stream) const { return stream.connection && connections_.at(*stream.connection).far; }

bool Hub::is_published(const Stream& stream) const {
    return stream.connection && (!is_far(stream) || stream.alive_afar);
}

void Hub::changed(const std::string& name) const {
    for (const auto& listener : listeners_)
        if (listener.changed) listener.changed(name);
}

// The connection is of no use; it is told why.
Result<void> Hub::refuse(Connection& connection, const Error& error, CloseCode code) {
    connection.closing = Closing{code, error.message};
    connection.wake();
    tell({.name = "refused", .text = "refused: " + error.message, .stream = connection.stream});
    return tl::unexpected(error);
}

// Another connection goes on with the stream.
void Hub::replace_publisher(Stream& stream, std::uint32_t checksum) {
    stream.free = false;
    if (!stream.connection) return;
    auto& before = connections_.at(*stream.connection);
    before.admitted = false;
    before.closing = stream.checksum == checksum
                         ? Closing{CloseCode::continued, "this session was continued by another connection"}
                         : Closing{CloseCode::taken_over, "another session took the stream over"};
    before.wake();
}

// The first packet decides whose stream it is.
Result<void> Hub::admit(std::uint64_t number, Connection& connection, const PacketHeader& header,
                        Clock::time_point now) {
    if (header.kind != PacketKind::sequence || !header.has(packet_flag::flags_valid)) {
        ++counters_.refused_publishers_message;
        return fail(ErrorKind::bad_input, "the first packet must be a sequence header of version 2 or later");
    }
    const auto known = streams_.find(connection.stream);
    if (known == streams_.end()) {
        if (streams_.size() >= limits_.streams) {
            ++counters_.refused_publishers_limit;
            return fail(ErrorKind::limit, too_many_streams);
        }
    } else {
        auto& stream = known->second;
        const bool same = stream.checksum == header.reference;
        if (!same && !stream.free && now - stream.heard < limits_.silence) {
            ++counters_.refused_publishers_busy;
            return fail(ErrorKind::bad_input,
                        stream.connection
                            ? "'" + connection.stream + "' is being published by another session; end that one, or wait"
                            : "'" + connection.stream +
                                  "' was published by another session a moment ago; wait for two seconds");
        }
        replace_publisher(stream, header.reference);
    }
    auto& stream = stream_named(connection.stream);
    stream.connection = number;
    connection.admitted = true;
    changed(connection.stream);
    tell({.name = "published", .text = "a publisher is connected", .stream = connection.stream});
    return {};
}

Result<Hub::Publisher> Hub::publish_from_afar(const std::string& name, std::uint32_t checksum, Clock::time_point now) {
    if (!has_place_for(name)) {
        ++counters_.refused_publishers_limit;
        return fail(ErrorKind::limit, too_many_streams);
    }
    const auto publisher = connect(
        name, [] {}, now);
    auto& stream = stream_named(name);
    replace_publisher(stream, checksum);
    stream.connection = publisher.connection;
    stream.alive_afar = false;
    stream.viewers_afar = 0;
    auto& connection = connections_.at(publisher.connection);
    connection.far = connection.admitted = true;
    tell_from_afar(publisher, false, checksum, now);
    return publisher;
}

void Hub::tell_from_afar(Publisher publisher, bool published, std::optional<std::uint32_t> checksum,
                         Clock::time_point now) {
    const auto found = connections_.find(publisher.connection);
    auto* stream = found == connections_.end() ? nullptr : published_by(found->second);
    if (!stream) return;
    if (checksum && *checksum != stream->checksum) forget_session(*stream, *checksum);
    if (published) stream->heard = now;
    if (std::exchange(stream->alive_afar, published) && !published)
        tell_gone(*stream, "the publisher cannot be reached");
}

void Hub::tell_viewers_afar(const std::string& name, std::size_t viewers) {
    if (const auto found = streams_.find(name); found != streams_.end()) found->second.viewers_afar = viewers;
}

void Hub::forget_packets(const std::string& name) {
    const auto found = streams_.find(name);
    if (found == streams_.end()) return;
    found->second.broadcast.forget();
    found->second.last_packet.reset();
}

std::optional<Hub::Closure> Hub::closure(const std::string& name) const {
    const auto found = streams_.find(name);
    if (found == streams_.end()) return std::nullopt;
    const auto& broadcast = found->second.broadcast;
    auto packets = broadcast.kept();
    if (!packets) return std::nullopt;
    return Closure{std::move(*packets), broadcast.next_place()};
}

void Hub::forget_session(Stream& stream, std::uint32_t next_checksum) {
    stream.checksum = next_checksum;
    stream.clock.forget();
    stream.has_frames = false;
    stream.header.reset();
}

// What a sequence header tells of the stream. The same connection may begin another session, such as the next round of
// a loop.
void Hub::begin_session(const std::string& name, Stream& stream, const PacketHeader& header,
                        std::span<const std::uint8_t> message) {
    // The session of a stream that is published on another hub may be known before its header comes.
    const bool same = stream.checksum == header.reference;
    if (same && stream.header) return;
    if (!same) forget_session(stream, header.reference);
    const auto payload = message.subspan(packet_header_bytes, message.size() - packet_overhead);
    if (const auto read = internal::read_sequence_header(payload))
        stream.header = StreamInfo::Header{read->session, read->fps_numerator, read->fps_denominator};
    if (!same) changed(name);
}

// It counts as memory as long as anybody holds it, which may be longer than the hub.
std::shared_ptr<LivePacket> Hub::counted(LivePacket packet, const HubMemory::SharedShare& share) {
    const auto bytes = packet.bytes.size();
    share->take(bytes);
    return {new LivePacket(std::move(packet)), [share, bytes](const LivePacket* held) {
                share->give_back(bytes);
                delete held;
            }};
}

bool Hub::make_room(const HubMemory::Share& share, std::size_t bytes, Clock::time_point now) {
    auto room = memory_.room_for(share, bytes, now);
    for (; room == HubMemory::Room::after_another_gave_way; room = memory_.room_for(share, bytes, now))
        give_way(*memory_.largest(now), now);
    return room == HubMemory::Room::there;
}

// Whatever holds memory under this name gives it back: an unfinished message, what is kept for those who may join, and
// what viewers have yet to take. Who publishes whole packets stays, and so do viewers who keep up.
void Hub::give_way(HubMemory::Share& share, Clock::time_point now) {
    memory_.gives_way(share, now);
    ++counters_.gave_way;
    const auto& name = share.stream();
    tell({.name = "gave_way",
          .text = "the hub's memory for packets is used up, and this stream, which holds most, gives way",
          .stream = name,
          .numbers = {{"bytes", static_cast<std::int64_t>(share.bytes())}},
          .warning = true});
    for (auto& [number, connection] : connections_) {
        if (connection.stream != name || connection.part.bytes == 0 || connection.closing) continue;
        ++counters_.refused_publishers_limit;
        detach(connection, "the hub has no memory for it", now);
        static_cast<void>(refuse(connection, {ErrorKind::limit, memory_used_up}, CloseCode::try_later));
    }
    const auto empty = [&](Stream& stream) {
        stream.broadcast.drop_kept();
        for (auto& [viewer, watching] : stream.watching) {
            const bool holds = watching.writing || stream.broadcast.waiting_bytes(viewer) > 0;
            if (!holds || watching.closing) continue;
            watching.closing = Closing{CloseCode::try_later, memory_used_up, true};
            watching.wake();
        }
    };
    if (const auto found = streams_.find(name); found != streams_.end()) empty(found->second);
    for (auto& [number, stream] : ended_)
        if (stream.share.get() == &share) empty(stream);
    for (const auto& listener : listeners_)
        if (listener.gave_way) listener.gave_way(name);
}

// False if there is no memory for so much.
bool Hub::hold(PartOfMessage& part, HubMemory::Share& share, std::size_t bytes, Clock::time_point now) {
    if (part.bytes == 0) part.since = now;
    share.take(bytes);
    share.give_back(std::exchange(part.bytes, bytes));
    return make_room(share, 0, now);
}

// The message is whole, or nothing more of it will come.
void Hub::drop(PartOfMessage& part, HubMemory::Share& share) { share.give_back(std::exchange(part.bytes, 0)); }

Result<void> Hub::receive_part(Publisher publisher, std::size_t bytes, Clock::time_point now) {
    const auto found = connections_.find(publisher.connection);
    if (found == connections_.end() || found->second.closing) return fail(ErrorKind::bad_input, connection_ended);
    auto& connection = found->second;
    heard(publisher, now);
    if (!connection.admitted && bytes > limits_.first_message_bytes) {
        ++counters_.refused_publishers_message;
        return refuse(connection, {ErrorKind::bad_input, "the first message is too large for a sequence header"},
                      CloseCode::too_large);
    }
    if (hold(connection.part, *connection.share, bytes, now)) return {};
    ++counters_.refused_publishers_limit;
    detach(connection, "the hub has no memory for it", now);
    return refuse(connection, {ErrorKind::limit, memory_used_up}, CloseCode::try_later);
}

Result<void> Hub::receive_packet(Publisher publisher, std::vector<std::uint8_t> message, Clock::time_point now) {
    const auto found = connections_.find(publisher.connection);
    if (found == connections_.end() || found->second.closing) return fail(ErrorKind::bad_input, connection_ended);
    auto& connection = found->second;
    connection.heard = now;
    drop(connection.part, *connection.share);
    auto header = header_of(message, limits_.packet_bytes);
    if (!connection.admitted) {
        if (!header) {
            ++counters_.refused_publishers_message;
            return refuse(connection, {ErrorKind::bad_input, "the first message is not a packet"}, CloseCode::refused);
        }
        if (const auto ok = admit(publisher.connection, connection, *header, now); !ok)
            return refuse(connection, ok.error(), code_of(ok.error()));
    }
    auto& stream = streams_.at(connection.stream);
    if (!header) {
        ++stream.counters.damaged;
        ++counters_.damaged_messages;
        return {};
    }
    if (!make_room(*stream.share, message.size(), now)) {
        ++counters_.dropped_for_memory;
        // Without its header nothing of the stream can be shown.
        if (header->kind == PacketKind::sequence) {
            detach(connection, "the hub has no memory for it", now);
            return refuse(connection, {ErrorKind::limit, memory_used_up}, CloseCode::try_later);
        }
        ask_for_key_frame(stream, now);
        return {};
    }
    stream.heard = now;
    stream.last_packet = now;
    ++stream.counters.packets;
    ++counters_.packets_in;
    stream.counters.bytes += message.size();
    counters_.bytes_in += message.size();
    if (header->kind == PacketKind::sequence) begin_session(connection.stream, stream, *header, message);
    auto packet = counted({*header, std::move(message), {}}, stream.share);
    const bool frame = packet->is_frame();
    stream.has_frames = stream.has_frames || frame;
    if (frame && stream.stamp) {
        if (stream.stamp->frame == header->frame) packet->stamp = stream.stamp;
        if (packet->stamp) packet->stamp->hub = system_microseconds();
        stream.stamp.reset();
    }
    const auto undecodable = stream.broadcast.undecodable_frames();
    const auto place = stream.broadcast.push(packet, now);
    const bool new_one = place.has_value();
    if (new_one)
        for (const auto& listener : listeners_)
            if (listener.received) listener.received(connection.stream, *place, packet);
    if (stream.broadcast.undecodable_frames() > undecodable) {
        ++counters_.undecodable_frames;
        ask_for_key_frame(stream, now);
        return {};
    }
    if (new_one && header->kind == PacketKind::intra) stream.wants_key_frame = false;
    if (new_one)
        for (const auto& listener : listeners_)
            if (listener.sent) listener.sent(connection.stream, packet, now);
    return {};
}

Result<void> Hub::receive_text(Publisher publisher, std::string_view text, Clock::time_point now) {
    const auto found = connections_.find(publisher.connection);
    if (found == connections_.end() || found->second.closing) return fail(ErrorKind::bad_input, connection_ended);
    auto& connection = found->second;
    drop(connection.part, *connection.share);
    const auto message = read_from_publisher(text);
    const auto refusal = text_refused(text, message, connection.allowance, now);
    if (!refusal) {
        receive_text(publisher, *message, now);
        return {};
    }
    ++counters_.refused_publishers_message;
    detach(connection, "the publisher sent a text message that is not allowed", now);
    return refuse(connection, {ErrorKind::bad_input, refusal->reason}, *refusal->code);
}

Result<void> Hub::receive_nothing(Publisher publisher, Clock::time_point now) {
    const auto found = connections_.find(publisher.connection);
    if (found == connections_.end() || found->second.closing) return fail(ErrorKind::bad_input, connection_ended);
    auto& connection = found->second;
    if (connection.allowance.allow(now)) return {};
    ++counters_.refused_publishers_message;
    detach(connection, "the publisher sent too much that carries nothing", now);
    return refuse(connection, {ErrorKind::bad_input, too_much_of_nothing}, CloseCode::refused);
}

void Hub::receive_text(Publisher publisher, const FromPublisher& message, Clock::time_point now) {
    heard(publisher, now);
    const auto found = connections_.find(publisher.connection);
    auto* stream = found == connections_.end() ? nullptr : published_by(found->second);
    if (!stream) return;
    found->second.ends_stream = found->second.ends_stream || std::holds_alternative<EndOfStream>(message);
    if (const auto* heartbeat = std::get_if<HeartbeatFromPublisher>(&message)) {
        stream->last_heartbeat = now;
        if (heartbeat->clock) stream->clock.tell(*heartbeat->clock, now);
    }
    if (const auto* stamp = std::get_if<Stamp>(&message)) stream->stamp = *stamp;
}

void Hub::heard(Publisher publisher, Clock::time_point now) {
    const auto found = connections_.find(publisher.connection);
    if (found == connections_.end()) return;
    found->second.heard = now;
    if (auto* stream = published_by(found->second)) stream->heard = now;
}

ForPublisher Hub::next(Publisher publisher) {
    const auto found = connections_.find(publisher.connection);
    if (found == connections_.end()) return Closing{};
    auto& connection = found->second;
    if (connection.closing) return *connection.closing;
    const auto known = streams_.find(connection.stream);
    const auto* stream = known == streams_.end() ? nullptr : &known->second;
    if (std::exchange(connection.hello, false))
        return Hello{.stream = connection.stream,
                     .session = stream ? session_of(stream->header) : std::nullopt,
                     .hubs = other_hubs_};
    if (std::exchange(connection.key_frame, false)) return KeyFrameRequest{};
    if (!std::exchange(connection.heartbeat, false)) return {};
    if (!connection.admitted) return HeartbeatToPublisher{};
    const auto& counters = stream->counters;
    return HeartbeatToPublisher{stream->watching.size() + stream->viewers_afar, counters.packets, counters.bytes,
                                counters.damaged};
}

void Hub::count_close(const char* whose, const std::optional<Closing>& closing) {
    const auto why = !closing ? "left" : closing->code ? name_of(*closing->code) : "dead";
    ++counters_.closed[std::string(whose) + '_' + why];
}

// The connection publishes no more; the stream waits for it to come back.
void Hub::detach(Connection& connection, const std::string& why, Clock::time_point now) {
    if (auto* stream = published_by(connection)) {
        stream->connection.reset();
        stream->free = connection.lets_go;
        stream->heard = now;
        stream->stamp.reset();
        tell_gone(*stream, why);
        changed(connection.stream);
        const auto& counters = stream->counters;
        tell({.name = "left",
              .text = why + " (" + std::to_string(counters.packets) + " packets of the stream so far)",
              .stream = connection.stream,
              .numbers = {{"packets", static_cast<std::int64_t>(counters.packets)},
                          {"bytes", static_cast<std::int64_t>(counters.bytes)},
                          {"damaged", static_cast<std::int64_t>(counters.damaged)}}});
    }
    connection.admitted = false;
}

void Hub::lets_go(Publisher publisher) {
    const auto found = connections_.find(publisher.connection);
    if (found != connections_.end()) found->second.lets_go = true;
}

void Hub::leave(Publisher publisher, bool ended_stream, Clock::time_point now) {
    const auto found = connections_.find(publisher.connection);
    if (found == connections_.end()) return;
    const bool published = found->second.admitted;
    const bool ends = ended_stream || found->second.ends_stream;
    const auto name = found->second.stream;
    if (!found->second.far) count_close("publisher", found->second.closing);
    drop(found->second.part, *found->second.share);
    detach(found->second, "the publisher's connection ended", now);
    connections_.erase(found);
    if (published && ends) end_stream(streams_.find(name), "the publisher ended the stream");
}

// Passed on at once, or by tick() once a second has passed since the last one; unless such a frame came meanwhile.
void Hub::ask_for_key_frame(Stream& stream, Clock::time_point now) {
    stream.wants_key_frame = true;
    const bool too_soon = stream.asked_for_key_frame && now - *stream.asked_for_key_frame < limits_.key_frame;
    if (!stream.connection || too_soon) return;
    stream.wants_key_frame = false;
    stream.asked_for_key_frame = now;
    ++stream.key_frame_requests;
    ++counters_.key_frame_requests;
    auto& connection = connections_.at(*stream.connection);
    connection.key_frame = true;
    connection.wake();
}

void Hub::ask_for_key_frame(const std::string& name, Clock::time_point now) {
    if (const auto found = streams_.find(name); found != streams_.end()) ask_for_key_frame(found->second, now);
}

// ---- Viewers --------------------------------------------------------------------------------------------------------

Result<Hub::Viewer> Hub::watch(const std::string& name, std::function<void()> wake, const WatchOptions& options,
                               Clock::time_point now) {
    const auto found = streams_.find(name);
    if (found == streams_.end()) {
        ++counters_.refused_viewers_no_stream;
        return fail(ErrorKind::bad_input, "there is no stream '" + name + "'");
    }
    auto& stream = found->second;
    if (stream.broadcast.viewers() >= limits_.viewers) {
        ++counters_.refused_viewers_limit;
        return fail(ErrorKind::limit, "'" + name + "' has as many viewers as this hub serves");
    }
    ++counters_.joined;
    const auto viewer = stream.broadcast.join(wake, now);
    // Heartbeats of many who came at once are spread over the second.
    const auto first = limits_.heartbeat * static_cast<int>(1 + viewer % 10) / 10;
    stream.watching.emplace(viewer, Watching{.wake = std::move(wake),
                                             .options = options,
                                             .allowance = {viewer_burst, viewer_texts_each_second},
                                             .heartbeat_at = now + first});
    stream.watching.at(viewer).wake();
    if (stream.watching.size() == 1) changed(name);
    // What was kept was too much, or the newest frames cannot be decoded.
    if (stream.has_frames && stream.broadcast.waiting_bytes(viewer) == 0) ask_for_key_frame(stream, now);
    return Viewer{name, stream.number, viewer};
}

// Null if it has ended and its viewers have left.
Hub::Stream* Hub::stream_of(const Viewer& viewer) {
    const auto found = streams_.find(viewer.stream);
    if (found != streams_.end() && found->second.number == viewer.number) return &found->second;
    const auto ended = ended_.find(viewer.number);
    return ended == ended_.end() ? nullptr : &ended->second;
}

Hub::Watching* Hub::watching(const Viewer& viewer) {
    auto* stream = stream_of(viewer);
    if (!stream) return nullptr;
    const auto found = stream->watching.find(viewer.viewer);
    return found == stream->watching.end() ? nullptr : &found->second;
}

void Hub::leave(const Viewer& viewer) {
    auto* watching = this->watching(viewer);
    if (!watching) return;
    auto& stream = *stream_of(viewer);
    drop(watching->part, *stream.share);
    const bool at_end = stream.ended && stream.broadcast.waiting_bytes(viewer.viewer) == 0;
    count_close("viewer", at_end && !watching->closing ? Closing{CloseCode::ended} : watching->closing);
    const auto& counters = stream.broadcast.counters(viewer.viewer);
    counters_.dropped_frames += counters.dropped_frames;
    counters_.fallen_behind += counters.fallen_behind;
    stream.broadcast.leave(viewer.viewer);
    stream.watching.erase(viewer.viewer);
    if (stream.watching.empty() && !stream.ended) changed(viewer.stream);
    if (stream.ended && stream.watching.empty()) ended_.erase(viewer.number);
}

Result<void> Hub::receive_part(const Viewer& viewer, std::size_t bytes, Clock::time_point now) {
    auto* watching = this->watching(viewer);
    if (!watching || watching->closing) return fail(ErrorKind::bad_input, connection_ended);
    if (hold(watching->part, *stream_of(viewer)->share, bytes, now)) return {};
    ++counters_.refused_viewers_limit;
    watching->closing = Closing{CloseCode::try_later, memory_used_up};
    watching->wake();
    return fail(ErrorKind::limit, memory_used_up);
}

Result<void> Hub::receive_text(const Viewer& viewer, std::string_view text, Clock::time_point now) {
    auto* watching = this->watching(viewer);
    if (!watching || watching->closing) return fail(ErrorKind::bad_input, connection_ended);
    drop(watching->part, *stream_of(viewer)->share);
    const auto message = read_from_viewer(text);
    const auto refusal = text_refused(text, message, watching->allowance, now);
    if (!refusal) {
        if (std::holds_alternative<KeyFrameRequest>(*message)) ask_for_key_frame(*stream_of(viewer), now);
        return {};
    }
    ++counters_.refused_viewers_message;
    watching->closing = refusal;
    watching->wake();
    return fail(ErrorKind::bad_input, refusal->reason);
}

Result<void> Hub::receive_nothing(const Viewer& viewer, Clock::time_point now) {
    auto* watching = this->watching(viewer);
    if (!watching || watching->closing) return fail(ErrorKind::bad_input, connection_ended);
    if (watching->allowance.allow(now)) return {};
    ++counters_.refused_viewers_message;
    watching->closing = Closing{CloseCode::refused, too_much_of_nothing};
    watching->wake();
    return fail(ErrorKind::bad_input, too_much_of_nothing);
}

ForViewer Hub::next(const Viewer& viewer, Clock::time_point now) {
    auto* watching = this->watching(viewer);
    if (!watching) return Closing{};
    watching->writing = false;
    if (watching->closing) return *watching->closing;
    auto& stream = *stream_of(viewer);
    const bool texts = watching->options.texts;
    if (std::exchange(watching->hello, false) && texts)
        return Hello{
            .stream = viewer.stream, .session = session_of(stream.header), .hubs = in_turn(other_hubs_, viewer.viewer)};
    if (!stream.ended && std::exchange(watching->gone, false) && texts) return Gone{stream.gone};
    if (std::exchange(watching->heartbeat, false) && texts)
        return HeartbeatToViewer{.published = is_published(stream),
                                 .clock = is_published(stream) ? stream.clock.at(now) : std::nullopt,
                                 .session = session_of(stream.header),
                                 .viewers = stream.watching.size() + stream.viewers_afar,
                                 .dropped = stream.broadcast.counters(viewer.viewer).dropped_frames};
    auto packet = std::exchange(watching->behind_stamp, nullptr);
    if (!packet) {
        const auto waited = stream.broadcast.waiting_time(viewer.viewer, now);
        packet = stream.broadcast.next(viewer.viewer);
        if (packet) counters_.packet_time.add(waited);
        if (packet && packet->stamp && watching->options.stamps) {
            watching->behind_stamp = packet;
            watching->writing = true;
            return *packet->stamp;
        }
    }
    if (packet) {
        ++counters_.packets_out;
        counters_.bytes_out += packet->bytes.size();
        watching->writing = true;
        return packet;
    }
    if (!stream.ended) return {};
    if (std::exchange(watching->gone, false) && texts) return Gone{stream.gone};
    return Closing{CloseCode::ended, stream.gone};
}

bool Hub::ends_at_once(const Viewer& viewer) {
    const auto* watching = this->watching(viewer);
    return watching && watching->closing && (watching->closing->at_once || !watching->closing->code);
}

void Hub::tell_gone(Stream& stream, const std::string& reason) {
    stream.gone = reason;
    for (auto& [viewer, watching] : stream.watching) {
        watching.gone = true;
        watching.wake();
    }
}

// ---- The life of streams --------------------------------------------------------------------------------------------

void Hub::end_stream(std::map<std::string, Stream>::iterator found, const std::string& reason) {
    auto stream = streams_.extract(found);
    for (const auto& listener : listeners_)
        if (listener.ended) listener.ended(stream.key());
    stream.mapped().ended = true;
    tell({.name = "ended", .text = reason, .stream = stream.key()});
    tell_gone(stream.mapped(), reason);
    if (!stream.mapped().watching.empty()) ended_.emplace(stream.mapped().number, std::move(stream.mapped()));
    changed(stream.key());
}

void Hub::tick(Clock::time_point now) {
    const auto beat = [&](auto& other) {
        if (now < other.heartbeat_at) return;
        // Without catching up with those that were missed.
        other.heartbeat_at = std::max(other.heartbeat_at + limits_.heartbeat, now);
        other.heartbeat = true;
        other.wake();
    };
    // The line is as good as dead; or somebody holds memory by sending a byte now and then.
    const auto takes_too_long = [&](auto& other, const std::string& stream) {
        if (other.part.bytes == 0 || now - other.part.since < limits_.message_time) return false;
        const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(limits_.message_time).count();
        const auto why = "a message has not come whole within " + std::to_string(seconds) + " seconds";
        other.closing = Closing{CloseCode::try_later, why, true};
        other.wake();
        tell({.name = "cut_off", .text = "cut off: " + why, .stream = stream});
        return true;
    };
    for (auto& [number, connection] : connections_) {
        if (connection.closing || connection.far) continue;
        beat(connection);
        if (takes_too_long(connection, connection.stream)) {
            ++counters_.slow_publishers;
            detach(connection, "the publisher takes too long for a message", now);
            continue;
        }
        if (now - connection.heard < limits_.publisher_silence) continue;
        ++counters_.silent_publishers;
        detach(connection, "the publisher has fallen silent", now);
        connection.closing = Closing{CloseCode::try_later, "nothing was heard of the publisher", true};
        connection.wake();
    }
    for (auto it = streams_.begin(); it != streams_.end();) {
        auto& stream = it->second;
        for (auto& [viewer, watching] : stream.watching) {
            if (watching.closing) continue;
            beat(watching);
            if (takes_too_long(watching, it->first)) ++counters_.slow_viewers;
        }
        if (stream.wants_key_frame) ask_for_key_frame(stream, now);
        const auto found = it++;
        if (!stream.connection && now - stream.heard > limits_.remembered_without_publisher)
            end_stream(found, "the stream has ended");
    }
    memory_.forget_unused();
}

void Hub::close_publishers(CloseCode code, const std::string& reason) {
    for (auto& [number, connection] : connections_) {
        connection.closing = Closing{code, reason};
        connection.wake();
    }
}

void Hub::close_all(CloseCode code, const std::string& reason) {
    close_publishers(code, reason);
    const auto close = [&](auto& other) {
        other.closing = Closing{code, reason};
        other.wake();
    };
    for (auto& [name, stream] : streams_)
        for (auto& [viewer, watching] : stream.watching) close(watching);
    for (auto& [number, stream] : ended_)
        for (auto& [viewer, watching] : stream.watching) close(watching);
}

// ---- What is told ---------------------------------------------------------------------------------------------------

StreamInfo Hub::info(const std::string& name, const Stream& stream, Clock::time_point now) const {
    const auto since = [&](const std::optional<Clock::time_point>& then) {
        return then ? std::optional(std::chrono::duration_cast<std::chrono::milliseconds>(now - *then)) : std::nullopt;
    };
    StreamInfo out{.name = name,
                   .published = is_published(stream),
                   .far = is_far(stream),
                   .connection = stream.connection.value_or(0),
                   .checksum = stream.checksum.value_or(0),
                   .next_place = stream.broadcast.next_place(),
                   .viewers = stream.watching.size(),
                   .viewers_afar = stream.viewers_afar,
                   .publisher = stream.counters,
                   .undecodable_frames = stream.broadcast.undecodable_frames(),
                   .kept_bytes = stream.broadcast.kept_bytes(),
                   .key_frame_requests = stream.key_frame_requests,
                   .header = stream.header,
                   .clock = is_published(stream) ? stream.clock.at(now) : std::nullopt,
                   .since_packet = since(stream.last_packet),
                   .since_heartbeat = since(stream.last_heartbeat)};
    for (const auto& [viewer, watching] : stream.watching) {
        out.dropped_frames += stream.broadcast.counters(viewer).dropped_frames;
        out.queue_bytes += stream.broadcast.waiting_bytes(viewer);
    }
    return out;
}

std::vector<StreamInfo> Hub::streams(Clock::time_point now) const {
    std::vector<StreamInfo> out;
    for (const auto& [name, stream] : streams_) out.push_back(info(name, stream, now));
    return out;
}

std::optional<StreamInfo> Hub::stream(const std::string& name, Clock::time_point now) const {
    const auto found = streams_.find(name);
    return found == streams_.end() ? std::nullopt : std::optional(info(name, found->second, now));
}

HubCounters Hub::counters() const {
    auto out = counters_;
    out.memory = memory_.bytes();
    const auto add = [&](const Stream& stream) {
        for (const auto& [viewer, watching] : stream.watching) {
            out.dropped_frames += stream.broadcast.counters(viewer).dropped_frames;
            out.fallen_behind += stream.broadcast.counters(viewer).fallen_behind;
        }
    };
    for (const auto& [name, stream] : streams_) add(stream);
    for (const auto& [number, stream] : ended_) add(stream);
    return out;
}

}  // namespace htvm::live
