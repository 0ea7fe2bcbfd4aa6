// Hubs on several machines, joined by a network that is given: whoever watches on one is sent what is published on
// another, whatever the network, the hubs and the publishers do.
#include "live/hub/hub_peering.h"

#include <gtest/gtest.h>

#include <deque>
#include <memory>
#include <random>
#include <set>

#include "htvm/decoder.hpp"
#include "live_packets.h"

namespace htvm::live {
namespace {

using namespace std::chrono_literals;

Bytes header(std::uint32_t session) { return write_packet(live_header(session)); }
Bytes intra(std::uint32_t frame) { return write_packet(live_intra(frame)); }
Bytes tracked(std::uint32_t frame) { return write_packet(live_tracked(frame)); }

// Machines 0, 1, ... , each with a hub; time goes on in steps of 10 ms.
struct Machines : testing::Test {
    struct Machine {
        Hub hub;
        std::unique_ptr<HubPeering> peering;
        std::set<std::string> subjects;
        bool connected = false;
    };
    struct Sent {
        std::size_t to;
        std::string subject;
        Bytes part;
    };
    Hub::Clock::time_point now{1h};
    std::vector<std::unique_ptr<Machine>> machines;
    std::deque<Sent> network;
    std::mt19937 random{1};
    unsigned losing = 0, doubling = 0, reordering = 0;  // of 1000
    std::map<std::string, int> sent;                    // messages by subject
    std::uint64_t next_number = 1;
    std::vector<std::pair<std::size_t, Hub::Publisher>> publishers;  // whose heartbeats come

    void start(std::size_t i) {
        if (machines.size() <= i) machines.resize(i + 1);
        machines[i] = std::make_unique<Machine>();
        std::erase_if(publishers, [i](const auto& publisher) { return publisher.first == i; });
        auto& machine = *machines[i];
        HubPeeringOptions options;
        options.name = "hub" + std::to_string(i);
        options.url = "ws://hub" + std::to_string(i);
        options.number = next_number++;
        options.system_time = [this] { return now.time_since_epoch() / 1us; };
        machine.peering = std::make_unique<HubPeering>(
            machine.hub, options,
            HubNetwork{[this, i](const std::string& subject, Bytes part) { send(i, subject, std::move(part)); },
                       [&machine](const std::string& subject) { machine.subjects.insert(subject); },
                       [&machine](const std::string& subject) { machine.subjects.erase(subject); }});
        for (const auto& subject : machine.peering->subjects()) machine.subjects.insert(subject);
        connect(i, true);
    }
    void connect(std::size_t i, bool connected) {
        machines[i]->connected = connected;
        connected ? machines[i]->peering->connected(now) : machines[i]->peering->disconnected(now);
    }
    void send(std::size_t from, const std::string& subject, Bytes part) {
        ++sent[subject];
        for (std::size_t to = 0; to < machines.size(); ++to) {
            if (to == from || !machines[to] || !machines[to]->connected || !machines[to]->subjects.contains(subject))
                continue;
            if (random() % 1000 < losing) continue;
            if (random() % 1000 < doubling) network.push_back({to, subject, part});
            network.push_back({to, subject, part});
            if (random() % 1000 < reordering) std::swap(network.back(), network[random() % network.size()]);
        }
    }
    void pass(std::chrono::milliseconds time) {
        for (const auto end = now + time; now < end;) {
            now += 10ms;
            for (auto& machine : machines) {
                if (!machine) continue;
                machine->hub.tick(now);
                machine->peering->tick(now);
            }
            for (const auto& [i, publisher] : publishers)
                if (machines[i]) hub(i).heard(publisher, now);
            deliver();
        }
    }
    void deliver() {
        while (!network.empty()) {
            const auto next = std::move(network.front());
            network.pop_front();
            if (machines[next.to]) machines[next.to]->peering->receive(next.subject, next.part, now);
        }
    }

    Hub& hub(std::size_t i) { return machines[i]->hub; }
    Hub::Publisher publisher(std::size_t i) {
        auto out = hub(i).publish(
            "anna", [] {}, now);
        EXPECT_TRUE(out);
        publishers = {{i, *out}};
        return *out;
    }
    void publish(std::size_t i, Hub::Publisher publisher, const std::vector<Bytes>& packets) {
        for (const auto& packet : packets) {
            EXPECT_TRUE(hub(i).receive_packet(publisher, packet, now));
            deliver();
        }
    }
    Hub::Viewer viewer(std::size_t i) {
        auto out = hub(i).watch(
            "anna", [] {}, {.texts = false}, now);
        EXPECT_TRUE(out);
        return out ? *out : Hub::Viewer{};
    }
    std::vector<SharedPacket> packets(std::size_t i, const Hub::Viewer& viewer) {
        std::vector<SharedPacket> out;
        for (;;) {
            const auto next = hub(i).next(viewer, now);
            const auto* packet = std::get_if<SharedPacket>(&next);
            if (!packet) return out;
            out.push_back(*packet);
        }
    }
    std::vector<std::uint32_t> frames(std::size_t i, const Hub::Viewer& viewer) {
        std::vector<std::uint32_t> out;
        for (const auto& packet : packets(i, viewer))
            if (packet->header.kind != PacketKind::sequence) out.push_back(packet->header.frame);
        return out;
    }
    // Why the publisher's connection is closed; nothing if it is not.
    std::optional<CloseCode> closed(std::size_t i, Hub::Publisher publisher) {
        for (int texts = 0; texts < 10; ++texts) {
            const auto next = hub(i).next(publisher);
            if (const auto* closing = std::get_if<Closing>(&next)) return closing->code;
        }
        return std::nullopt;
    }
    std::optional<StreamInfo> stream(std::size_t i) { return hub(i).stream("anna", now); }
};
using HubPeeringTest = Machines;
using Frames = std::vector<std::uint32_t>;

TEST_F(HubPeeringTest, WhatIsPublishedOnOneHubIsListedAndWatchedOnAnother) {
    for (const auto i : {0, 1, 2}) start(i);
    const auto anna = publisher(0);
    publish(0, anna, {header(1), intra(0), tracked(1)});
    pass(100ms);
    for (const auto i : {1, 2}) EXPECT_TRUE(stream(i) && stream(i)->published && stream(i)->far);
    const auto watching = viewer(2);
    deliver();
    publish(0, anna, {tracked(2), tracked(3)});
    EXPECT_EQ(frames(2, watching), (Frames{0, 1, 2, 3}));
    pass(1100ms);
    EXPECT_EQ(stream(0)->viewers_afar, 1u);
}

TEST_F(HubPeeringTest, OfNamesThatAreNoNamesOfStreamsNothingIsHeard) {
    for (const auto i : {0, 1}) start(i);
    const auto anna = publisher(0);
    for (const auto& name : std::vector<std::string>{"a b", "", ".a", "b\nc", std::string(65, 'a')}) {
        const auto odd = hub(0).publish(
            name, [] {}, now);
        ASSERT_TRUE(odd);
        publish(0, *odd, {header(1)});
    }
    publish(0, anna, {header(2)});
    pass(100ms);
    ASSERT_EQ(hub(1).streams(now).size(), 1u);
    EXPECT_EQ(hub(1).streams(now)[0].name, "anna");
}

TEST_F(HubPeeringTest, PacketsGoOverOnlyWhileSomebodyWatches) {
    for (const auto i : {0, 1}) start(i);
    const auto anna = publisher(0);
    publish(0, anna, {header(1), intra(0)});
    pass(1s);
    publish(0, anna, {intra(1)});
    EXPECT_EQ(sent["htvm.v1.packets.anna"], 0);
    const auto watching = viewer(1);
    deliver();
    publish(0, anna, {intra(2)});
    EXPECT_EQ(sent["htvm.v1.packets.anna"], 1);
    EXPECT_EQ(frames(1, watching), (Frames{1, 2}));
    hub(1).leave(watching);
    pass(4s);
    publish(0, anna, {intra(3)});
    EXPECT_EQ(sent["htvm.v1.packets.anna"], 2);  // somebody might come back
    pass(10s);
    publish(0, anna, {intra(4)});
    EXPECT_EQ(sent["htvm.v1.packets.anna"], 2);
    // Whoever comes now is sent nothing from before.
    const auto later = viewer(1);
    deliver();
    publish(0, anna, {intra(5)});
    EXPECT_EQ(frames(1, later), (Frames{4, 5}));
}

TEST_F(HubPeeringTest, APublisherWhoMovesToAnotherHubIsFollowedAndNoFrameComesTwice) {
    for (const auto i : {0, 1, 2}) start(i);
    const auto before = publisher(0);
    publish(0, before, {header(1), intra(0), tracked(1)});
    pass(100ms);
    const std::vector<Hub::Viewer> viewers = {viewer(0), viewer(1), viewer(2)};
    deliver();
    publish(0, before, {tracked(2)});
    const auto after = publisher(1);
    publish(1, after, {header(1), intra(0), tracked(1), tracked(2), tracked(3)});
    pass(100ms);
    publish(1, after, {tracked(4)});
    for (const auto i : {0u, 1u, 2u}) EXPECT_EQ(frames(i, viewers[i]), (Frames{0, 1, 2, 3, 4})) << i;
    EXPECT_EQ(closed(0, before), CloseCode::continued);
    EXPECT_TRUE(stream(0)->far && !stream(1)->far && stream(2)->far);
}

TEST_F(HubPeeringTest, AnotherSessionWaitsUntilThePublisherOnAnotherHubIsSilent) {
    for (const auto i : {0, 1}) start(i);
    const auto anna = publisher(0);
    publish(0, anna, {header(1), intra(0)});
    pass(100ms);
    const auto other = hub(1).publish(
        "anna", [] {}, now);
    ASSERT_TRUE(other);
    EXPECT_FALSE(hub(1).receive_packet(*other, header(2), now));
    hub(0).leave(anna, false, now);
    pass(2100ms);
    EXPECT_TRUE(hub(1).receive_packet(publisher(1), header(2), now));
}

TEST_F(HubPeeringTest, OfTwoHubsThatClaimANameTheNewerSessionHoldsAndTheLoserIsTold) {
    for (const auto i : {0, 1, 2}) start(i);
    connect(1, false);
    const auto older = publisher(0);
    publish(0, older, {header(1), intra(0)});
    pass(500ms);
    const auto newer = publisher(1);
    publish(1, newer, {header(2), intra(7)});
    const auto watching = viewer(0), third = viewer(2);
    deliver();
    connect(1, true);
    pass(100ms);
    EXPECT_EQ(closed(0, older), CloseCode::taken_over);
    EXPECT_EQ(closed(1, newer), std::nullopt);
    publish(1, newer, {intra(8)});
    EXPECT_EQ(frames(0, watching), (Frames{0, 7, 8}));
    EXPECT_EQ(frames(2, third), (Frames{0, 7, 8}));
    EXPECT_EQ(machines[0]->peering->counters().lost_claims, 1u);
}

TEST_F(HubPeeringTest, WhileTheNetworkIsAwayWhatIsLocalGoesOnAndTheRestComesBackWithIt) {
    for (const auto i : {0, 1}) start(i);
    const auto anna = publisher(0);
    publish(0, anna, {header(1), intra(0)});
    pass(100ms);
    const auto near = viewer(0), far = viewer(1);
    deliver();
    for (const auto i : {0, 1}) connect(i, false);
    std::uint32_t frame = 1;
    for (; frame <= 30; ++frame) {  // for longer than streams without publishers are remembered
        publish(0, anna, {tracked(frame)});
        pass(500ms);
        EXPECT_EQ(frames(0, near).back(), frame);
    }
    EXPECT_EQ(frames(1, far), Frames{0});
    ASSERT_TRUE(stream(1));
    EXPECT_FALSE(stream(1)->published);
    for (const auto i : {0, 1}) connect(i, true);
    pass(200ms);
    EXPECT_TRUE(stream(1)->published);
    publish(0, anna, {tracked(frame)});
    const auto came = frames(1, far);
    ASSERT_EQ(came.size(), 31u);
    EXPECT_EQ(came.front(), 1u);
    EXPECT_EQ(came.back(), 31u);
}

TEST_F(HubPeeringTest, AStreamWhosePublisherEndedItEndsEverywhere) {
    for (const auto i : {0, 1}) start(i);
    const auto anna = publisher(0);
    publish(0, anna, {header(1), intra(0)});
    pass(100ms);
    const auto watching = viewer(1);
    deliver();
    hub(0).leave(anna, true, now);
    pass(2s);
    EXPECT_FALSE(stream(1));
    EXPECT_EQ(frames(1, watching), Frames{0});
    const auto end = hub(1).next(watching, now);
    ASSERT_TRUE(std::holds_alternative<Closing>(end));
    EXPECT_EQ(std::get<Closing>(end).code, CloseCode::ended);
}

TEST_F(HubPeeringTest, TheStreamsOfAHubThatDiedWaitForTheirPublisherElsewhere) {
    for (const auto i : {0, 1, 2}) start(i);
    publish(0, publisher(0), {header(1), intra(0)});
    pass(100ms);
    const auto watching = viewer(2);
    deliver();
    EXPECT_EQ(frames(2, watching), Frames{0});
    machines[0].reset();
    pass(5s);
    ASSERT_TRUE(stream(2));
    EXPECT_FALSE(stream(2)->published);
    publish(1, publisher(1), {header(1), intra(0), intra(1)});
    pass(100ms);
    EXPECT_EQ(frames(2, watching), Frames{1});
    machines[1].reset();
    pass(20s);
    EXPECT_FALSE(stream(2));
}

TEST_F(HubPeeringTest, RequestsForAKeyFrameReachThePublisher) {
    for (const auto i : {0, 1}) start(i);
    const auto anna = publisher(0);
    publish(0, anna, {header(1), intra(0)});
    pass(100ms);
    const auto watching = viewer(1);
    deliver();
    EXPECT_TRUE(hub(1).receive_text(watching, write_text(KeyFrameRequest{}), now));
    pass(100ms);
    bool asked = false;
    for (int texts = 0; texts < 5; ++texts) asked = asked || std::holds_alternative<KeyFrameRequest>(hub(0).next(anna));
    EXPECT_TRUE(asked);
}

TEST_F(HubPeeringTest, HubsTellTheirPeopleOfEachOther) {
    for (const auto i : {0, 1, 2}) start(i);
    pass(100ms);
    auto connection = hub(1).publish(
        "ben", [] {}, now);
    ASSERT_TRUE(connection);
    const auto hello = hub(1).next(*connection);
    ASSERT_TRUE(std::holds_alternative<Hello>(hello));
    EXPECT_EQ(std::get<Hello>(hello).hubs, (std::vector<std::string>{"ws://hub0", "ws://hub2"}));
}

TEST_F(HubPeeringTest, NobodySpeaksForAnotherHubOrOfAnotherStreamThanTheSubjectSays) {
    for (const auto i : {0, 1}) start(i);
    const auto anna = publisher(0);
    publish(0, anna, {header(1), intra(0)});
    pass(100ms);
    const auto watching = viewer(1);
    deliver();
    EXPECT_EQ(frames(1, watching), Frames{0});
    const auto claim = Claim{1, now.time_since_epoch() / 1us};
    const auto say = [&](std::uint64_t hub, const std::string& subject, const HubMessage& message) {
        for (const auto& part : cut_into_parts(hub, 77, write_hub_message(message)))
            machines[1]->peering->receive(subject, part, now);
    };
    const auto damaged = machines[1]->peering->counters().damaged;
    say(9, packets_subject("anna"), PublishedPacket{"anna", claim, {2, intra(1)}});
    say(1, packets_subject("ben"), PublishedPacket{"anna", claim, {2, intra(1)}});
    say(9, announcements_subject(), StreamRequest{"anna", claim});
    machines[1]->peering->receive("htvm.v1.announcements", Bytes(100), now);
    EXPECT_EQ(machines[1]->peering->counters().damaged, damaged + 4);
    EXPECT_EQ(frames(1, watching), Frames{});
    // Names that are no segment of a path are not listed.
    say(9, announcements_subject(), Announcement{"", "", {{"../x", 1, 1, true, {}, 0}, {"", 1, 1, true, {}, 0}}});
    EXPECT_EQ(hub(1).streams(now).size(), 1u);
}

// A publisher who moves between hubs, and hubs and network that fail; on every hub a viewer.
TEST_F(HubPeeringTest, WhateverHappensAViewerIsSentThePublishersPacketsAndCanDecodeEveryFrame) {
    for (std::uint32_t seed = 0; seed < 12; ++seed) {
        random.seed(seed);
        machines.clear();
        network.clear();
        losing = random() % 2 * 30;
        doubling = random() % 2 * 50;
        reordering = random() % 2 * 50;
        for (const auto i : {0, 1, 2}) start(i);
        std::size_t at = 0;
        auto anna = publisher(at);
        std::vector<Bytes> published, group;  // group: what the newest frame needs
        std::vector<std::optional<Hub::Viewer>> viewers(3);
        std::vector<std::vector<SharedPacket>> came(3);
        const auto take = [&](std::size_t i) {
            if (viewers[i])
                for (const auto& packet : packets(i, *viewers[i])) came[i].push_back(packet);
        };
        const auto begin_again = [&](std::size_t i) {
            came[i].clear();
            viewers[i].reset();
        };
        const auto check = [&](std::size_t i) {
            std::vector<PacketHeader> headers;
            std::optional<std::uint32_t> last;
            for (const auto& packet : came[i]) headers.push_back(packet->header);
            for (std::size_t k = 0; k < headers.size(); ++k) {
                const auto& bytes = came[i][k]->bytes;
                ASSERT_NE(std::find(published.begin(), published.end(), bytes), published.end());
                if (headers[k].kind == PacketKind::sequence) continue;
                ASSERT_FALSE(closure(headers, k).empty()) << "seed " << seed << ", frame " << headers[k].frame;
                ASSERT_TRUE(!last || headers[k].frame > *last) << "seed " << seed << ", frame " << headers[k].frame;
                last = headers[k].frame;
            }
        };
        std::uint32_t frame = 0;
        const int steps = 1000;
        for (int step = 0; step < steps; ++step) {
            if (step == steps - 300) losing = 0;
            const bool calm = step >= steps - 300;
            const bool first = step == 0 || random() % 60 == 0;
            if (first) group = {header(1)};
            group.push_back(first ? intra(frame) : tracked(frame));
            ++frame;
            if (step == 0) published.push_back(group[0]);
            published.push_back(group.back());
            if (!calm && random() % 300 == 0) {  // it moves, and sends again what the newest frame needs
                at = random() % 3;
                anna = publisher(at);
                publish(at, anna, group);
            } else {
                publish(at, anna, step == 0 ? group : std::vector<Bytes>{group.back()});
            }
            if (!calm && random() % 400 == 0) {  // a hub that dies and starts again, with another viewer
                const std::size_t dies = random() % 3;
                take(dies);
                check(dies);
                begin_again(dies);
                start(dies);
                if (dies == at) {
                    anna = publisher(at);
                    publish(at, anna, group);
                }
            }
            const std::size_t cut_off = random() % 3;
            if (!calm && random() % 100 == 0) connect(cut_off, !machines[cut_off]->connected);
            if (step == steps - 300)
                for (const auto i : {0u, 1u, 2u}) connect(i, true);
            pass(30ms);
            for (std::size_t i = 0; i < 3; ++i) {
                if (!viewers[i] && stream(i)) viewers[i] = viewer(i);
                take(i);
                if (!viewers[i] || !std::holds_alternative<Closing>(hub(i).next(*viewers[i], now))) continue;
                check(i);  // it was cut off until the stream ended there
                begin_again(i);
            }
        }
        for (std::size_t i = 0; i < 3; ++i) {
            check(i);
            if (HasFatalFailure()) return;
            ASSERT_FALSE(came[i].empty());
            EXPECT_EQ(came[i].back()->header.frame + 1, frame) << "seed " << seed << ", hub " << i;
        }
    }
}

}  // namespace
}  // namespace htvm::live
