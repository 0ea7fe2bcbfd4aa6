// A stream watched from afar: whatever the network does to its messages, what goes on is the publisher's packets in
// order, and every frame can be decoded to the same bits as there.
#include "live/hub/far_stream.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <memory>
#include <random>

#include "htvm/decoder.hpp"
#include "live/client/broadcast.h"

namespace htvm::live {
namespace {

using namespace std::chrono_literals;
using namespace packet_flag;
using Time = FarStream::Clock::time_point;

constexpr Time start{};
const Claim claim{7, 100};

Bytes packet(std::uint32_t number) {
    Packet out;
    out.kind = PacketKind::audio;
    out.frame = number;
    return write_packet(out);
}
PublishedPacket published(std::uint32_t number) { return {"anna", claim, {number, packet(number)}}; }

std::vector<std::uint32_t> frames(const std::vector<Bytes>& packets) {
    std::vector<std::uint32_t> out;
    std::uint32_t payload = 0;
    for (const auto& bytes : packets) out.push_back(read_packet_header(bytes, payload)->frame);
    return out;
}
ClosureAnswer closure(std::uint64_t next, const std::vector<std::uint32_t>& numbers) {
    ClosureAnswer out{"anna", claim, next, {}};
    for (const auto number : numbers) out.packets.push_back({number, packet(number)});
    return out;
}
using Frames = std::vector<std::uint32_t>;

TEST(FarStream, WhatComesBeforeTheClosureIsHeldBack) {
    FarStream stream(claim);
    EXPECT_TRUE(stream.asks(start));
    for (const auto number : {8u, 9u, 10u}) EXPECT_TRUE(stream.receive(published(number)).empty());
    EXPECT_EQ(frames(stream.receive(closure(9, {4, 8}))), (Frames{4, 8, 9, 10}));
    EXPECT_EQ(frames(stream.receive(published(11))), Frames{11});
    EXPECT_FALSE(stream.asks(start + 1h));
}

TEST(FarStream, OfAClosureBehindAGapOnlyWhatIsMissingGoesOn) {
    FarStream stream(claim);
    EXPECT_EQ(frames(stream.receive(closure(3, {0, 1, 2}))), (Frames{0, 1, 2}));
    EXPECT_TRUE(stream.receive(published(5)).empty());
    EXPECT_TRUE(stream.asks(start));
    EXPECT_EQ(frames(stream.receive(closure(6, {0, 1, 2, 3}))), Frames{3});  // 4 and 5 are not needed any more
    EXPECT_EQ(frames(stream.receive(published(6))), Frames{6});
    EXPECT_EQ(stream.counters().gaps, 1u);
}

TEST(FarStream, AskingIsRepeatedUntilItIsAnswered) {
    FarStream stream(claim, {.ask_again = 300ms});
    EXPECT_TRUE(stream.asks(start));
    EXPECT_FALSE(stream.asks(start + 200ms));
    EXPECT_TRUE(stream.asks(start + 300ms));
    stream.receive(closure(0, {}));
    EXPECT_FALSE(stream.asks(start + 10s));
}

TEST(FarStream, WhatCameLateIsTakenWithoutAClosure) {
    FarStream stream(claim);
    stream.receive(closure(0, {}));
    EXPECT_TRUE(stream.receive(published(1)).empty());
    EXPECT_EQ(frames(stream.receive(published(0))), (Frames{0, 1}));
    EXPECT_FALSE(stream.asks(start));
    EXPECT_TRUE(stream.receive(published(1)).empty());
    EXPECT_EQ(stream.counters().doubled, 1u);
}

TEST(FarStream, ThatTheLastPacketsWereLostIsKnownFromTheAnnouncement) {
    FarStream stream(claim, {.overdue = 200ms});
    stream.receive(closure(3, {2}));
    stream.announced(4, start);
    EXPECT_FALSE(stream.asks(start + 100ms));  // it may be on its way
    EXPECT_TRUE(stream.asks(start + 200ms));
    EXPECT_EQ(frames(stream.receive(closure(4, {2, 3}))), Frames{3});
    EXPECT_FALSE(stream.asks(start + 10s));
}

TEST(FarStream, MessagesOfAnotherClaimArePassedOver) {
    FarStream stream({7, 101});
    EXPECT_TRUE(stream.receive(closure(3, {0, 1, 2})).empty());
    EXPECT_TRUE(stream.receive(published(3)).empty());
}

TEST(FarStream, WhatIsHeldIsBounded) {
    FarStream stream(claim, {.held_bytes = 10 * packet(0).size()});
    for (std::uint32_t number = 0; number < 100; ++number) stream.receive(published(number));
    EXPECT_EQ(frames(stream.receive(closure(90, {}))), (Frames{90, 91, 92, 93, 94, 95, 96, 97, 98, 99}));
}

// A publisher of every kind of frame; its hub keeps what is needed.
struct NearHub {
    std::mt19937& random;
    Broadcast broadcast{};
    std::vector<SharedPacket> packets{};  // by number
    std::uint32_t frame = 0, intra = 0, last_tracked = 0;

    void publish(PacketKind kind, std::uint32_t reference, std::uint8_t flags) {
        Packet next;
        next.kind = kind;
        next.frame = frame;
        next.reference = reference;
        next.flags = static_cast<std::uint8_t>(flags_valid | flags);
        next.timestamp_us = frame * 1000;
        const auto size = random() % 400;  // before the bytes, for every compiler
        next.payload.resize(size, static_cast<std::uint8_t>(random()));
        packets.push_back(std::make_shared<LivePacket>(LivePacket{next, write_packet(next)}));
        ASSERT_EQ(broadcast.push(packets.back(), start), packets.size() - 1);
    }
    void publish_some() {
        const auto choice = packets.empty() ? 0 : random() % 40;
        if (choice == 0) publish(PacketKind::sequence, 7, session);
        ++frame;
        if (choice < 2) {
            intra = last_tracked = frame;
            publish(PacketKind::intra, frame, referred | access);
        } else if (choice < 4) {
            publish(PacketKind::codebook, intra, choice == 2 ? colour : 0);
        } else if (choice < 14) {
            publish(PacketKind::enhanced, intra, droppable | access);
        } else if (choice < 18) {
            publish(PacketKind::audio, 0, droppable);
        } else {
            publish(PacketKind::tracked, last_tracked, referred);
            last_tracked = frame;
        }
    }
};

// The packets that the last one needs, by what came here or there.
std::vector<Bytes> needed(const std::vector<SharedPacket>& came) {
    Dependencies dependencies;
    for (const auto& next : came) dependencies.push(next->header);
    std::vector<Bytes> out;
    for (const auto place : dependencies.closure()) out.push_back(came[place]->bytes);
    return out;
}

TEST(FarStream, WhateverIsLostDoubledOrReorderedEveryFrameHasTheSameClosureAsAtThePublishersHub) {
    for (std::uint32_t seed = 0; seed < 60; ++seed) {
        std::mt19937 random(seed);
        NearHub near{.random = random};
        auto stream = std::make_unique<FarStream>(claim, FarStreamLimits{.held_bytes = 4000, .ask_again = 5ms});
        PartReader parts(100000);
        std::deque<Bytes> network;
        std::vector<SharedPacket> came;
        std::uint64_t message = 0;
        const auto losing = random() % 3 * 60, doubling = random() % 100, reordering = random() % 100;
        const auto send = [&](const HubMessage& next, bool sure) {
            for (auto& part : cut_into_parts(1, message++, write_hub_message(next), 400)) {
                if (!sure && random() % 1000 < losing) continue;
                if (random() % 1000 < doubling) network.push_back(part);
                network.push_back(std::move(part));
                if (network.size() > 1 && random() % 1000 < reordering)
                    std::swap(network.back(), network[random() % network.size()]);
            }
        };
        const auto give_on = [&](std::vector<Bytes> packets) {
            for (auto& bytes : packets) {
                std::uint32_t payload = 0;
                const auto header = *read_packet_header(bytes, payload);
                came.push_back(std::make_shared<LivePacket>(LivePacket{header, std::move(bytes)}));
                if (!frame_type(header.kind)) continue;
                const auto number = std::find_if(near.packets.begin(), near.packets.end(), [&](const auto& other) {
                    return other->header.frame == header.frame && other->header.kind == header.kind;
                });
                const auto there = needed({near.packets.begin(), number + 1});
                EXPECT_EQ(needed(came), there) << "seed " << seed << ", frame " << header.frame;
            }
        };
        const int steps = 150;
        for (int step = 0; step < steps && !testing::Test::HasFailure(); ++step) {
            const auto now = start + std::chrono::milliseconds(step);
            const bool calm = step > steps - 20;  // so that it can end well
            auto number = near.packets.size();
            near.publish_some();
            for (; number < near.packets.size(); ++number)
                send(PublishedPacket{"anna", claim, {number, near.packets[number]->bytes}}, calm);
            if (stream->asks(now)) {
                ClosureAnswer answer{"anna", claim, near.broadcast.next_place(), {}};
                const auto kept = near.broadcast.kept();
                ASSERT_TRUE(kept);
                for (const auto& placed : *kept) answer.packets.push_back({placed.place, placed.packet->bytes});
                send(answer, calm);
            }
            if (!calm && random() % 100 == 0) {  // the hub here starts again
                stream = std::make_unique<FarStream>(claim, FarStreamLimits{.held_bytes = 4000, .ask_again = 5ms});
                came.clear();
            }
            while (network.size() > random() % 6 * (calm ? 0 : 1)) {
                const auto whole = parts.add(network.front());
                network.pop_front();
                if (!whole) continue;
                auto read = read_hub_message(whole->message);
                ASSERT_TRUE(read);
                if (auto* next = std::get_if<PublishedPacket>(&*read)) give_on(stream->receive(std::move(*next)));
                if (auto* next = std::get_if<ClosureAnswer>(&*read)) give_on(stream->receive(std::move(*next)));
            }
        }
        ASSERT_FALSE(came.empty()) << "seed " << seed;
        EXPECT_EQ(came.back()->bytes, near.packets.back()->bytes) << "seed " << seed;
    }
}

}  // namespace
}  // namespace htvm::live
