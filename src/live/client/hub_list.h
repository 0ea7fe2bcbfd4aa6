// Which hub a client connects to next, and when: docs/live.md, section 2.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "live/client/hub_address.h"

namespace htvm::live {

class HubList {
public:
    // At least one address. seed: of the pauses.
    explicit HubList(std::vector<HubAddress> addresses, std::uint64_t seed = std::random_device()())
        : addresses_(std::move(addresses)), random_(seed) {}

    const HubAddress& current() const { return addresses_[at_]; }
    std::size_t size() const { return addresses_.size(); }

    // The connection stood: the next pause is the shortest again.
    void held() { most_pause_ = shortest; }
    // It did not, or ended: goes to the next address, and says after which pause.
    std::chrono::milliseconds next() {
        at_ = (at_ + 1) % addresses_.size();
        // Many clients lose a hub at the same moment; they should not all come to the next one at once.
        std::uniform_int_distribution<std::int64_t> pause(most_pause_.count() / 2, most_pause_.count());
        const std::chrono::milliseconds out(pause(random_));
        most_pause_ = std::min(2 * most_pause_, longest);
        return out;
    }
    // What a hub told of others: their schemes, hosts and ports. Their paths are that of the hub, unless they have
    // some. Whoever came by TLS goes to no address without.
    void learn(const std::vector<std::string>& told) {
        for (const auto& text : told) {
            auto address = parse_hub_address(text);
            if (!address || addresses_.size() >= most_addresses) continue;
            if (addresses_[0].secure && !address->secure) continue;
            if (address->target == "/") address->target = addresses_[0].target;
            if (std::find(addresses_.begin(), addresses_.end(), *address) == addresses_.end())
                addresses_.push_back(std::move(*address));
        }
    }

private:
    static constexpr std::chrono::milliseconds shortest{100}, longest{3000};
    static constexpr std::size_t most_addresses = 16;
    std::vector<HubAddress> addresses_;
    std::size_t at_ = 0;
    std::chrono::milliseconds most_pause_ = shortest;
    std::mt19937_64 random_;
};

}  // namespace htvm::live
