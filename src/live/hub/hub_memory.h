// Who holds how much of the memory that a hub has for packets, and who gives way where it is used up. What is held is
// counted by the stream's name: packets, wherever they are, and what has come of others. So nobody can take more than
// one stream's share by publishing again under the same name, and where several take too much together, the one that
// holds most gives way: whoever holds little is never the one.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace htvm::live {

class HubMemory {
    using Bytes = std::atomic<std::size_t>;

public:
    using Clock = std::chrono::steady_clock;

    // What is held under one name. It lives as long as anybody holds something, which may be longer than the hub: the
    // last to hold a packet may be a recording, on its thread.
    class Share {
    public:
        Share(std::shared_ptr<Bytes> total, std::string stream)
            : total_(std::move(total)), stream_(std::move(stream)) {}
        void take(std::size_t bytes) {
            bytes_ += bytes;
            *total_ += bytes;
        }
        void give_back(std::size_t bytes) {
            bytes_ -= bytes;
            *total_ -= bytes;
        }
        std::size_t bytes() const { return bytes_; }
        const std::string& stream() const { return stream_; }

    private:
        friend class HubMemory;
        Bytes bytes_{0};
        std::shared_ptr<Bytes> total_;
        std::string stream_;
        std::optional<Clock::time_point> gave_way_{};  // known to the hub's thread alone
    };
    using SharedShare = std::shared_ptr<Share>;

    // most: of all; most_of_one: under one name.
    HubMemory(std::size_t most, std::size_t most_of_one) : most_(most), most_of_one_(most_of_one) {}

    SharedShare share_of(const std::string& stream);
    // What all hold, what is about to be given back included.
    std::size_t bytes() const { return *total_; }

    // Whether the share may take so much more.
    enum class Room { there, none, after_another_gave_way };
    // after_another_gave_way: as soon as largest() has. What gives way takes nothing for a second, in which what it
    // held, and has yet to give back, does not count.
    Room room_for(const Share& share, std::size_t bytes, Clock::time_point now) const;
    // The share that holds most and has not given way a moment ago; null if none holds anything.
    SharedShare largest(Clock::time_point now) const;
    void gives_way(Share& share, Clock::time_point now) { share.gave_way_ = now; }

    // Those that hold nothing and that nobody uses.
    void forget_unused();

private:
    bool gave_way_lately(const Share& share, Clock::time_point now) const;

    std::size_t most_, most_of_one_;
    std::shared_ptr<Bytes> total_ = std::make_shared<Bytes>(0);
    std::map<std::string, std::weak_ptr<Share>> shares_;
};

}  // namespace htvm::live
