#include "live/hub/hub_memory.h"

#include <algorithm>

namespace htvm::live {

constexpr std::chrono::seconds giving_back{1};

HubMemory::SharedShare HubMemory::share_of(const std::string& stream) {
    auto& known = shares_[stream];
    auto share = known.lock();
    if (!share) known = share = std::make_shared<Share>(total_, stream);
    return share;
}

bool HubMemory::gave_way_lately(const Share& share, Clock::time_point now) const {
    return share.gave_way_ && now - *share.gave_way_ < giving_back;
}

HubMemory::Room HubMemory::room_for(const Share& share, std::size_t bytes, Clock::time_point now) const {
    if (share.bytes() + bytes > most_of_one_ || gave_way_lately(share, now)) return Room::none;
    if (*total_ + bytes <= most_) return Room::there;
    std::size_t held = 0, others_most = 0;
    for (const auto& [stream, known] : shares_) {
        const auto other = known.lock();
        if (!other || gave_way_lately(*other, now)) continue;
        held += other->bytes();
        if (other.get() != &share) others_most = std::max(others_most, other->bytes());
    }
    if (held + bytes <= most_) return Room::there;
    return others_most > share.bytes() + bytes ? Room::after_another_gave_way : Room::none;
}

HubMemory::SharedShare HubMemory::largest(Clock::time_point now) const {
    SharedShare out;
    for (const auto& [stream, known] : shares_) {
        auto share = known.lock();
        if (!share || share->bytes() == 0 || gave_way_lately(*share, now)) continue;
        if (!out || share->bytes() > out->bytes()) out = std::move(share);
    }
    return out;
}

void HubMemory::forget_unused() {
    std::erase_if(shares_, [](const auto& known) { return known.second.expired(); });
}

}  // namespace htvm::live
