#include "live/client/broadcast.h"

#include <algorithm>
#include <iterator>

#include "codec/format/frame_kinds.h"
#include "htvm/decoder.hpp"
#include "htvm/texture.hpp"

namespace htvm::live {
namespace {

bool is_index(PacketKind kind) { return kind == PacketKind::index || kind == PacketKind::front_index; }

using Places = std::vector<std::uint64_t>;

Places ascending(Places places) {
    std::sort(places.begin(), places.end());
    return places;
}

Places without(const Places& all, const Places& some) {
    Places out;
    std::set_difference(all.begin(), all.end(), some.begin(), some.end(), std::back_inserter(out));
    return out;
}

Places united(const Places& a, const Places& b) {
    Places out;
    std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(out));
    return out;
}

}  // namespace

Packet packet_of(const LivePacket& packet) {
    Packet out;
    static_cast<PacketHeader&>(out) = packet.header;
    out.payload.assign(packet.bytes.begin() + packet_header_bytes,
                       packet.bytes.end() - (packet_overhead - packet_header_bytes));
    return out;
}

bool LivePacket::is_frame() const { return frame_type(header.kind).has_value(); }

bool LivePacket::is_reference() const {
    const auto type = frame_type(header.kind);
    if (!type) return false;
    const auto& rules = internal::rules_of(*type);
    return rules.renews && internal::is_referred(header, rules);
}

bool LivePacket::is_access() const {
    using namespace packet_flag;
    return is_reference() || (is_frame() && header.has(referred) && header.has(access));
}

std::optional<std::uint64_t> Broadcast::push(SharedPacket packet, Clock::time_point now) {
    if (is_index(packet->header.kind) || is_kept(*packet)) return std::nullopt;
    const bool begins = packet->header.kind == PacketKind::sequence || packet->header.kind == PacketKind::intra;
    if (kept_.size() >= limits_.kept_packets && !begins) {
        if (packet->is_frame()) ++undecodable_;
        return std::nullopt;
    }
    const auto sequence = dependencies_.sequences();
    const auto place = dependencies_.push(packet->header);
    next_place_ = place + 1;
    // What is left of the sequence before must not be sent behind the new header.
    if (dependencies_.sequences() != sequence) closure_.clear();
    const bool frame = packet->is_frame(), picture = packet->is_picture();
    if (picture && dependencies_.picture_closure().empty()) return place;  // nobody could decode it
    packets_[place] = std::move(packet);
    kept_ = ascending(dependencies_.kept());
    kept_pictures_ = picture ? united(kept_pictures_, {place}) : kept_pictures_;
    std::erase_if(kept_pictures_, [&](auto one) { return !std::binary_search(kept_.begin(), kept_.end(), one); });
    const auto closure = ascending(dependencies_.closure());
    if (frame) closure_ = closure;
    forget_all_but(united(united(kept_, closure_), {place}));
    if (kept_bytes() > limits_.kept_bytes)
        forget_all_but(united(without(united(kept_, closure_), kept_pictures_), {place}));
    if (kept_bytes() > limits_.kept_bytes) forget_all_but({place});
    if (frame && closure.empty()) {
        ++undecodable_;
        return place;
    }
    for (auto& [viewer, queue] : viewers_) {
        const bool slept = queue.waiting.empty();
        if (queue.in_step && picture)
            give_picture(queue, place, now);
        else if (queue.in_step)
            give_in_step(queue, place, now);
        else if (frame)
            try_to_follow(queue, now);
        if (slept && !queue.waiting.empty()) queue.wake();
    }
    return place;
}

bool Broadcast::is_kept(const LivePacket& packet) const {
    if (packet.header.kind == PacketKind::sequence) return false;
    const auto same = [&](std::uint64_t place) {
        const auto found = packets_.find(place);
        return found != packets_.end() && found->second->header.frame == packet.header.frame &&
               found->second->bytes == packet.bytes;
    };
    return std::any_of(kept_.begin(), kept_.end(), same) || std::any_of(closure_.begin(), closure_.end(), same);
}

bool Broadcast::is_picture(std::uint64_t place) const {
    return std::binary_search(kept_pictures_.begin(), kept_pictures_.end(), place);
}

bool Broadcast::has_all_pictures() const {
    return std::all_of(kept_pictures_.begin(), kept_pictures_.end(),
                       [&](std::uint64_t place) { return packets_.contains(place); });
}

std::optional<std::vector<Broadcast::Placed>> Broadcast::kept() const {
    std::vector<Placed> out;
    const bool pictures = has_all_pictures();
    for (const auto place : united(kept_, closure_)) {
        if (!pictures && is_picture(place)) continue;
        const auto found = packets_.find(place);
        if (found == packets_.end()) return std::nullopt;
        out.push_back({place, found->second});
    }
    // A header that was repeated came behind the I-frame that it is needed for.
    std::stable_partition(out.begin(), out.end(),
                          [](const Placed& placed) { return placed.packet->header.kind == PacketKind::sequence; });
    return out;
}

void Broadcast::forget() {
    dependencies_ = Dependencies();
    packets_.clear();
    kept_.clear();
    closure_.clear();
    kept_pictures_.clear();
    next_place_ = 0;
    for (auto& [viewer, queue] : viewers_) queue = {.wake = queue.wake, .counters = queue.counters};
}

Broadcast::Viewer Broadcast::join(std::function<void()> wake, Clock::time_point now) {
    const Viewer viewer = next_viewer_++;
    auto& queue = viewers_[viewer];
    queue.wake = std::move(wake);
    if (!closure_.empty()) try_to_follow(queue, now);
    if (!queue.waiting.empty()) queue.wake();
    return viewer;
}

SharedPacket Broadcast::next(Viewer viewer) {
    auto& queue = viewers_.at(viewer);
    if (queue.waiting.empty()) return nullptr;
    auto packet = std::move(queue.waiting.front().packet);
    queue.waiting.pop_front();
    queue.bytes -= packet->bytes.size();
    ++queue.counters.packets;
    queue.counters.bytes += packet->bytes.size();
    return packet;
}

Broadcast::Clock::duration Broadcast::waiting_time(Viewer viewer, Clock::time_point now) const {
    const auto& waiting = viewers_.at(viewer).waiting;
    return waiting.empty() ? Clock::duration{} : now - waiting.front().arrived;
}

std::size_t Broadcast::kept_bytes() const {
    std::size_t out = 0;
    for (const auto& [place, packet] : packets_) out += packet->bytes.size();
    return out;
}

bool Broadcast::fits(const Queue& queue, const LivePacket& packet, Clock::time_point now) const {
    if (queue.waiting.empty()) return true;
    return queue.bytes + packet.bytes.size() <= limits_.bytes && now - queue.waiting.front().arrived <= limits_.wait;
}

void Broadcast::give(Queue& queue, std::uint64_t place, Clock::time_point now) {
    const auto& packet = packets_.at(place);
    queue.waiting.push_back({place, packet, now});
    queue.bytes += packet->bytes.size();
}

void Broadcast::give_in_step(Queue& queue, std::uint64_t place, Clock::time_point now) {
    const auto& packet = *packets_.at(place);
    if (fits(queue, packet, now)) return give(queue, place, now);
    drop_pictures(queue);
    if (fits(queue, packet, now)) return give(queue, place, now);
    const bool frame = packet.is_frame();
    // Nothing depends on it, as on sound.
    if (packet.header.has(packet_flag::droppable)) {
        queue.counters.dropped_frames += frame ? 1 : 0;
        return;
    }
    fall_behind(queue, place);
    if (frame) try_to_follow(queue, now);
}

// Pictures may fill half of a queue: the rest is the meshes'.
void Broadcast::give_picture(Queue& queue, std::uint64_t place, Clock::time_point now) {
    const auto& packet = *packets_.at(place);
    const bool room = queue.waiting.empty() || (2 * (queue.bytes + packet.bytes.size()) <= limits_.bytes &&
                                                2 * (now - queue.waiting.front().arrived) <= limits_.wait);
    queue.pictures = room && (queue.pictures || is_key_picture(packet.header));
    if (queue.pictures) return give(queue, place, now);
    ++queue.counters.dropped_pictures;
}

void Broadcast::drop_pictures(Queue& queue) {
    queue.pictures = false;
    std::erase_if(queue.waiting, [&](const Waiting& waiting) {
        if (!waiting.packet->is_picture()) return false;
        queue.bytes -= waiting.packet->bytes.size();
        ++queue.counters.dropped_pictures;
        return true;
    });
}

// What waits is dropped: by the time it could be sent it would be late. `place`: the packet that does not fit.
void Broadcast::fall_behind(Queue& queue, std::uint64_t place) {
    Places dropped;
    for (const auto& waiting : queue.waiting) {
        dropped.push_back(waiting.place);
        if (waiting.packet->is_frame()) ++queue.counters.dropped_frames;
        if (waiting.packet->is_picture()) ++queue.counters.dropped_pictures;
    }
    dropped.push_back(place);
    std::sort(dropped.begin(), dropped.end());
    queue.has = without(kept_, dropped);
    queue.waiting.clear();
    queue.bytes = 0;
    queue.in_step = false;
    queue.pictures = false;
    ++queue.counters.fallen_behind;
}

// Gives the newest frame with all that it and later ones need, if that is little, or the viewer has just come. Missed
// references count by their bytes alone: until the next I-frame, which may be long in coming, no frame needs fewer. Who
// comes is given the pictures too, if they are not much; who comes back waits for the next key picture.
void Broadcast::try_to_follow(Queue& queue, Clock::time_point now) {
    auto needed = without(without(united(kept_, closure_), kept_pictures_), queue.has);
    std::size_t missed = 0, references = 0, bytes = 0;  // of the missed frames, how many are references
    bool there = true;
    for (const auto place : needed) {
        there = there && packets_.contains(place);
        if (!there) break;
        const auto& packet = *packets_.at(place);
        bytes += packet.bytes.size();
        if (!packet.is_frame() || place == closure_.back()) continue;
        ++missed;
        references += packet.is_reference() ? 1 : 0;
    }
    const bool little = (queue.joining || missed - references <= limits_.most_missed) && bytes <= limits_.bytes;
    if (!there || (missed > 0 && !little)) {
        if (!queue.joining) ++queue.counters.dropped_frames;
        return;
    }
    std::size_t picture_bytes = 0;
    const bool pictures = queue.joining && has_all_pictures();
    for (const auto place : kept_pictures_) picture_bytes += pictures ? packets_.at(place)->bytes.size() : 0;
    queue.pictures = pictures && !kept_pictures_.empty() && bytes + picture_bytes <= limits_.bytes;
    if (queue.pictures) needed = united(needed, kept_pictures_);
    // A header that was repeated comes behind the I-frame that it is needed for.
    for (const bool header : {true, false})
        for (const auto place : needed)
            if ((packets_.at(place)->header.kind == PacketKind::sequence) == header) give(queue, place, now);
    queue.has.clear();
    queue.in_step = true;
    queue.joining = false;
}

void Broadcast::forget_all_but(const std::vector<std::uint64_t>& needed) {
    const auto forgotten = [&](std::uint64_t place) {
        return !std::binary_search(needed.begin(), needed.end(), place);
    };
    std::erase_if(packets_, [&](const auto& entry) { return forgotten(entry.first); });
    for (auto& [viewer, queue] : viewers_) std::erase_if(queue.has, forgotten);
}

}  // namespace htvm::live
