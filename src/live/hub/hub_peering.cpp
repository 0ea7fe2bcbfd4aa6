#include "live/hub/hub_peering.h"

#include <algorithm>
#include <set>
#include <utility>

#include "live/client/control.h"
#include "live/hub/stream_name.h"

namespace htvm::live {
namespace {

// Whoever may send messages can take memory here, but not without bound.
constexpr std::size_t most_hubs = 1000, most_streams = 10000;
constexpr std::chrono::milliseconds answer_again{50};  // between two closures for one hub

void add(HubPeeringCounters& sum, const FarStreamCounters& stream) {
    sum.packets += stream.packets;
    sum.bytes += stream.bytes;
    sum.gaps += stream.gaps;
    sum.closures += stream.closures;
    sum.doubled += stream.doubled;
}

}  // namespace

HubPeering::HubPeering(Hub& hub, const HubPeeringOptions& options, HubNetwork network)
    : hub_(hub), options_(options), network_(std::move(network)) {
    if (!options_.system_time) options_.system_time = system_microseconds;
    // The hub has its connections for longer than the peering.
    const std::weak_ptr<bool> alive = alive_;
    HubListener listener;
    listener.changed = [this, alive](const std::string& stream) {
        if (!alive.expired()) stream_changed(stream);
    };
    listener.received = [this, alive](const std::string& stream, std::uint64_t place, const SharedPacket& packet) {
        if (!alive.expired()) packet_received(stream, place, packet);
    };
    hub_.listen(std::move(listener));
}

// ---- What is heard --------------------------------------------------------------------------------------------------

void HubPeering::connected(Clock::time_point now) {
    now_ = now;
    connected_ = true;
    announce_soon_ = true;
    for (auto& [number, other] : others_) other.heard = now;
    for (auto& [name, far] : far_)
        if (far.stream) far.stream->doubt();
}

// What is published elsewhere cannot be heard of: its streams stay, without a publisher, until the network is back.
void HubPeering::disconnected(Clock::time_point now) {
    now_ = now;
    connected_ = false;
    for (auto& [name, far] : far_) hub_.tell_from_afar(far.publisher, false, {}, now);
}

void HubPeering::receive(const std::string& subject, std::span<const std::uint8_t> part, Clock::time_point now) {
    now_ = now;
    auto whole = parts_.add(part);
    if (!whole || whole->hub == options_.number) return;
    auto message = read_hub_message(whole->message);
    // Whoever may send on one subject only cannot speak of another stream, nor for another hub.
    const auto sound = [&](const std::string& right, const Claim* claim) {
        return subject == right && (!claim || claim->hub == whole->hub);
    };
    auto* announcement = message ? std::get_if<Announcement>(&*message) : nullptr;
    auto* packet = message ? std::get_if<PublishedPacket>(&*message) : nullptr;
    auto* request = message ? std::get_if<StreamRequest>(&*message) : nullptr;
    auto* closure = message ? std::get_if<ClosureAnswer>(&*message) : nullptr;
    const auto mine = hub_subject(options_.number);
    const bool right = (announcement && sound(announcements_subject(), nullptr)) ||
                       (packet && sound(packets_subject(packet->stream), &packet->claim)) ||
                       (request && sound(mine, nullptr)) || (closure && sound(mine, &closure->claim));
    if (!right) {
        ++counters_.damaged;
        return;
    }
    ++counters_.received;
    if (announcement) hear(*announcement, whole->hub, now);
    if (request) hear(std::move(*request), whole->hub, now);
    if (!packet && !closure) return;
    const auto name = packet ? packet->stream : closure->stream;
    const auto found = far_.find(name);
    if (found == far_.end() || !found->second.stream) return;
    auto& stream = *found->second.stream;
    for (auto& bytes : packet ? stream.receive(std::move(*packet)) : stream.receive(std::move(*closure)))
        static_cast<void>(hub_.receive_packet(found->second.publisher, std::move(bytes), now));
    if (stream.asks(now)) ask(name, found->second, true, now);
}

void HubPeering::hear(const Announcement& message, std::uint64_t hub, Clock::time_point now) {
    if (!others_.contains(hub)) {
        if (others_.size() >= most_hubs) return;
        announce_soon_ = true;  // it has not heard of this one either
    }
    auto& other = others_[hub];
    const auto url = std::exchange(other.url, message.url);
    other.heard = now;
    std::set<std::string> names;
    for (const auto& [name, stream] : other.streams) names.insert(name);
    other.streams.clear();
    for (const auto& stream : message.streams) {
        if (other.streams.size() >= most_streams) break;
        if (!is_stream_name(stream.stream)) continue;
        other.streams[stream.stream] = stream;
        names.insert(stream.stream);
    }
    if (url != other.url) name_hubs();
    for (const auto& name : names) settle(name, now);
}

void HubPeering::hear(StreamRequest message, std::uint64_t hub, Clock::time_point now) {
    const auto found = own_.find(message.stream);
    if (found == own_.end() || found->second.claim != message.claim) return;
    auto& wanted = found->second.wanted;
    if (!wanted.contains(hub) && wanted.size() >= most_hubs) return;
    auto& by = wanted[hub];
    by.until = now + options_.wanted;
    by.viewers = message.viewers;
    count_viewers(message.stream, found->second);
    if (message.key_frame) hub_.ask_for_key_frame(message.stream, now);
    if (!message.closure || now - by.answered < answer_again) return;
    // Where what is needed is too large, the next I-frame makes it small: the other hub asks again.
    const auto closure = hub_.closure(message.stream);
    if (!closure) return;
    by.answered = now;
    ClosureAnswer answer{message.stream, message.claim, closure->next, {}};
    for (const auto& placed : closure->packets) answer.packets.push_back({placed.place, placed.packet->bytes});
    send(hub_subject(hub), answer);
}

// ---- Whose stream it is ---------------------------------------------------------------------------------------------

HubPeering::Newest HubPeering::newest_claim(const std::string& name) const {
    Newest out;
    for (const auto& [number, other] : others_) {
        const auto found = other.streams.find(name);
        if (found == other.streams.end()) continue;
        const Claim claim{number, found->second.began};
        // A hub that was cut off still has a claim that has been superseded: by one whose hub may be dead by now.
        if (const auto held = held_.find(name); held != held_.end() && newer(held->second, claim)) continue;
        if (!out.stream || newer(claim, out.claim)) out = {claim, &found->second};
    }
    return out;
}

// Whether the stream is published here or there, by what is known now.
void HubPeering::settle(const std::string& name, Clock::time_point now) {
    const auto newest = newest_claim(name);
    const auto own = own_.find(name);
    if (own != own_.end()) {
        if (!newest.stream) return;
        if (!newer(newest.claim, own->second.claim)) {
            announce_soon_ = true;  // so that the other gives up
            return;
        }
        ++counters_.lost_claims;
        own_.erase(own);
        announce_soon_ = true;
    }
    if (newest.stream) return follow(name, newest, now);
    const auto far = far_.find(name);
    if (far == far_.end() || far->second.withdrawn_since) return;
    // Another hub may have taken it over, whose announcement is on its way.
    hub_.tell_from_afar(far->second.publisher, false, {}, now);
    far->second.withdrawn_since = now;
}

void HubPeering::follow(const std::string& name, const Newest& newest, Clock::time_point now) {
    const auto checksum = static_cast<std::uint32_t>(newest.stream->checksum);
    auto found = far_.find(name);
    if (found == far_.end()) {
        const auto publisher = hub_.publish_from_afar(name, checksum, now);
        if (!publisher) return;  // too many streams; announced again each second
        found = far_.emplace(name, Far{newest.claim, *publisher}).first;
    }
    auto& far = found->second;
    held_[name] = newest.claim;
    far.withdrawn_since.reset();
    far.silent = false;
    if (far.claim != newest.claim) {
        far.claim = newest.claim;
        if (far.stream) {
            add(counters_, far.stream->counters());
            far.stream.emplace(far.claim, options_.far_stream);
        }
    }
    // While packets come, they tell the session.
    hub_.tell_from_afar(far.publisher, newest.stream->published, far.stream ? std::nullopt : std::optional(checksum),
                        now);
    if (newest.stream->published && newest.stream->clock)
        hub_.receive_text(far.publisher, FromPublisher(HeartbeatFromPublisher{newest.stream->clock}), now);
    watch(name, far, now);
    if (!far.stream) return;
    far.stream->announced(newest.stream->next, now);
    if (far.stream->asks(now)) ask(name, far, true, now);
}

// A publisher came to this hub, went, or began another session; or viewers came or went.
void HubPeering::stream_changed(const std::string& name) {
    const auto info = hub_.stream(name, now_);
    const bool here = info && !info->far, published_here = here && info->published;
    if (!info) held_.erase(name);
    const auto own = own_.find(name);
    const auto far = far_.find(name);
    if (published_here && far != far_.end()) {
        stop_watching(name, far->second);
        replaced_.push_back(far->second.publisher);
        far_.erase(far);
    } else if (far != far_.end() && info) {
        watch(name, far->second, now_);
    }
    if (here || own != own_.end()) announce_soon_ = true;
    if (own != own_.end() && !here) own_.erase(own);
    // Another session over the same connection goes on with the claim.
    if (published_here && (own == own_.end() || own->second.connection != info->connection)) {
        const auto newest = newest_claim(name);
        Claim claim{options_.number, options_.system_time()};
        if (newest.stream) claim.began = std::max(claim.began, newest.claim.began + 1);
        if (held_.contains(name)) claim.began = std::max(claim.began, held_[name].began + 1);
        own_[name] = {claim, info->connection, {}};
        held_[name] = claim;
    }
}

// ---- Packets --------------------------------------------------------------------------------------------------------

void HubPeering::packet_received(const std::string& name, std::uint64_t place, const SharedPacket& packet) {
    const auto own = own_.find(name);
    if (own == own_.end() || own->second.wanted.empty()) return;
    send(packets_subject(name), PublishedPacket{name, own->second.claim, {place, packet->bytes}});
}

// Asks for packets as soon as somebody watches, and notes when nobody does.
void HubPeering::watch(const std::string& name, Far& far, Clock::time_point now) {
    const auto info = hub_.stream(name, now);
    if (!info || info->viewers == 0) {
        if (!far.unwatched_since) far.unwatched_since = now;
        return;
    }
    far.unwatched_since.reset();
    if (far.stream) return;
    network_.subscribe(packets_subject(name));
    far.stream.emplace(far.claim, options_.far_stream);
    if (far.stream->asks(now)) ask(name, far, true, now);
}

void HubPeering::stop_watching(const std::string& name, Far& far) {
    if (!far.stream) return;
    network_.unsubscribe(packets_subject(name));
    add(counters_, far.stream->counters());
    far.stream.reset();
}

// Says that packets are wanted, and whether the closure is too.
void HubPeering::ask(const std::string& name, Far& far, bool closure, Clock::time_point now) {
    const auto info = hub_.stream(name, now);
    const auto viewers = static_cast<std::uint32_t>(info ? info->viewers : 0);
    far.asked = now;
    send(hub_subject(far.claim.hub),
         StreamRequest{name, far.claim, viewers, closure, std::exchange(far.key_frame, false)});
}

void HubPeering::send(const std::string& subject, const HubMessage& message) {
    const auto parts = connected_ ? cut_into_parts(options_.number, next_message_++, write_hub_message(message))
                                  : std::vector<Bytes>();
    parts.empty() ? ++counters_.unsent : ++counters_.sent;
    for (const auto& part : parts) network_.send(subject, part);
}

// ---- As time goes by ------------------------------------------------------------------------------------------------

void HubPeering::tick(Clock::time_point now) {
    now_ = now;
    for (const auto publisher : std::exchange(replaced_, {})) hub_.leave(publisher, false, now);
    if (connected_) forget_silent_hubs(now);
    for (auto it = far_.begin(); it != far_.end();) {
        const auto next = std::next(it);
        tick(it->first, it->second, now);
        it = next;
    }
    for (auto& [name, own] : own_)
        if (std::erase_if(own.wanted, [&](const auto& by) { return now >= by.second.until; }) > 0)
            count_viewers(name, own);
    if (connected_ && (announce_soon_ || !announced_ || now - *announced_ >= options_.announce)) announce(now);
}

// May end the stream.
void HubPeering::tick(const std::string& name, Far& far, Clock::time_point now) {
    if (far.withdrawn_since && now - *far.withdrawn_since >= options_.withdrawn) {
        stop_watching(name, far);
        const auto publisher = far.publisher;
        const bool ended = !far.silent;
        far_.erase(far_.find(name));
        hub_.leave(publisher, ended, now);
        return;
    }
    if (far.stream && far.unwatched_since && now - *far.unwatched_since >= options_.unwatched) {
        stop_watching(name, far);
        hub_.forget_packets(name);
    }
    // What is written to a publisher here goes to the one there, as far as it concerns it.
    for (bool more = true; more;) {
        const auto text = hub_.next(far.publisher);
        if (std::holds_alternative<KeyFrameRequest>(text)) far.key_frame = true;
        more = !std::holds_alternative<std::monostate>(text) && !std::holds_alternative<Closing>(text);
    }
    if (!far.stream || !connected_) return;
    if (far.stream->asks(now))
        ask(name, far, true, now);
    else if (far.key_frame || !far.asked || now - *far.asked >= options_.announce)
        ask(name, far, false, now);
}

// A hub that withdrew a stream has ended it; the streams of one that fell silent may come back on another.
void HubPeering::forget_silent_hubs(Clock::time_point now) {
    std::set<std::string> names;
    const auto before = others_.size();
    std::erase_if(others_, [&](const auto& entry) {
        const auto& [number, other] = entry;
        if (now - other.heard < options_.silence) return false;
        for (const auto& [name, stream] : other.streams) names.insert(name);
        return true;
    });
    if (others_.size() == before) return;
    name_hubs();
    for (const auto& name : names) {
        settle(name, now);
        const auto far = far_.find(name);
        if (far != far_.end() && far->second.withdrawn_since) far->second.silent = true;
    }
}

void HubPeering::announce(Clock::time_point now) {
    announced_ = now;
    announce_soon_ = false;
    Announcement message{options_.name, options_.url, {}};
    for (const auto& [name, own] : own_)
        if (const auto info = hub_.stream(name, now))
            message.streams.push_back(
                {name, own.claim.began, info->checksum, info->published, info->clock, info->next_place});
    send(announcements_subject(), message);
}

// Tells those that connect here the other hubs' addresses, to try in turn.
void HubPeering::name_hubs() {
    std::vector<std::string> addresses;
    for (const auto& [number, other] : others_)
        if (!other.url.empty()) addresses.push_back(other.url);
    std::sort(addresses.begin(), addresses.end());
    hub_.name_other_hubs(std::move(addresses));
}

// Sums the viewers on the other hubs.
void HubPeering::count_viewers(const std::string& name, const Own& own) {
    std::size_t viewers = 0;
    for (const auto& [hub, wanted] : own.wanted) viewers += wanted.viewers;
    hub_.tell_viewers_afar(name, viewers);
}

HubPeeringCounters HubPeering::counters() const {
    auto out = counters_;
    out.connected = connected_;
    out.hubs = others_.size();
    out.far_streams = far_.size();
    out.damaged += parts_.damaged();
    out.incomplete = parts_.incomplete();
    for (const auto& [name, far] : far_) {
        if (!far.stream) continue;
        ++out.watched;
        add(out, far.stream->counters());
    }
    for (const auto& [name, own] : own_) out.sent_streams += own.wanted.empty() ? 0 : 1;
    return out;
}

}  // namespace htvm::live
