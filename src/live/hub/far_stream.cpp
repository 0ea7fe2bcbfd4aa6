#include "live/hub/far_stream.h"

#include <algorithm>

namespace htvm::live {

void FarStream::give(Bytes bytes, std::vector<Bytes>& out) {
    ++counters_.packets;
    counters_.bytes += bytes.size();
    out.push_back(std::move(bytes));
}

// What is held and can go on, since nothing is missing before it. If some stays, something is.
void FarStream::give_held(std::vector<Bytes>& out) {
    while (!held_.empty() && held_.begin()->first <= *next_) {
        auto first = held_.extract(held_.begin());
        held_bytes_ -= first.mapped().size();
        if (first.key() < *next_) continue;
        give(std::move(first.mapped()), out);
        ++*next_;
    }
    const bool gap = !held_.empty();
    if (gap && !lacking_) {
        ++counters_.gaps;
        asked_.reset();
    }
    lacking_ = gap;
}

std::vector<Bytes> FarStream::receive(PublishedPacket message) {
    std::vector<Bytes> out;
    auto& packet = message.packet;
    if (message.claim != claim_) return out;
    if ((next_ && packet.number < *next_) || held_.contains(packet.number)) {
        ++counters_.doubled;
        return out;
    }
    held_bytes_ += packet.bytes.size();
    held_[packet.number] = std::move(packet.bytes);
    while (held_bytes_ > limits_.held_bytes) {
        held_bytes_ -= held_.begin()->second.size();
        held_.erase(held_.begin());
    }
    if (next_) give_held(out);
    return out;
}

// Leaves out what was given already of the closure. Nothing else is missing from before it: what is needed now was
// needed when it was passed by, and was given then.
std::vector<Bytes> FarStream::receive(ClosureAnswer message) {
    std::vector<Bytes> out;
    if (message.claim != claim_ || (next_ && message.next < *next_)) return out;
    ++counters_.closures;
    const auto given = next_.value_or(0);
    for (auto& packet : message.packets)
        if (packet.number >= given) give(std::move(packet.bytes), out);
    next_ = message.next;
    announced_ = 0;
    behind_since_.reset();
    give_held(out);
    return out;
}

void FarStream::announced(std::uint64_t next, Clock::time_point now) {
    announced_ = std::max(announced_, next);
    if (next_ && announced_ > *next_ && !behind_since_) behind_since_ = now;
}

bool FarStream::asks(Clock::time_point now) {
    if (!next_ || announced_ <= *next_) behind_since_.reset();
    if (behind_since_ && now - *behind_since_ >= limits_.overdue && !lacking_) {
        lacking_ = true;
        ++counters_.gaps;
        asked_.reset();
    }
    if (!lacking_ || (asked_ && now - *asked_ < limits_.ask_again)) return false;
    asked_ = now;
    return true;
}

}  // namespace htvm::live
