#include "live/client/hub_list.h"

#include <gtest/gtest.h>

#include "live/client/repeated_packets.h"
#include "live_packets.h"

namespace htvm::live {
namespace {

HubAddress hub(const std::string& host, bool secure = false) { return {secure, host, 80, "/publish/anna"}; }

TEST(HubList, GoesRoundAllAddresses) {
    HubList list({hub("a"), hub("b")}, 1);
    EXPECT_EQ(list.current().host, "a");
    list.next();
    EXPECT_EQ(list.current().host, "b");
    list.next();
    EXPECT_EQ(list.current().host, "a");
}

TEST(HubList, PausesAreRandomAndDoubleUpToThreeSeconds) {
    bool differ = false;
    std::vector<std::chrono::milliseconds> first;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        HubList list({hub("a")}, seed);
        std::int64_t most = 100;
        for (int k = 0; k < 10; ++k) {
            const auto pause = list.next().count();
            EXPECT_GE(pause, most / 2);
            EXPECT_LE(pause, most);
            if (k == 5) first.emplace_back(pause);
            most = std::min<std::int64_t>(2 * most, 3000);
        }
        differ = differ || first.back() != first.front();
        list.held();
        EXPECT_LE(list.next().count(), 100);
    }
    EXPECT_TRUE(differ);
}

TEST(HubList, LearnsOfOthersButNotOfThoseWithoutTlsWhereItHadTls) {
    HubList list({hub("a", true)}, 1);
    list.learn({"wss://b:8080", "ws://c", "wss://b:8080", "garbage", "wss://d/other"});
    ASSERT_EQ(list.size(), 3u);
    list.next();
    EXPECT_EQ(list.current(), (HubAddress{true, "b", 8080, "/publish/anna"}));
    list.next();
    EXPECT_EQ(list.current().target, "/other");
}

TEST(HubList, AHubCannotMakeItEndless) {
    HubList list({hub("a")}, 1);
    for (int k = 0; k < 1000; ++k) list.learn({"ws://host" + std::to_string(k)});
    EXPECT_EQ(list.size(), 16u);
}

// ---- What came before -----------------------------------------------------------------------------------------------

TEST(RepeatedPackets, AreThoseOfFramesThatCame) {
    RepeatedPackets repeated;
    for (const auto& packet : {live_header(1), live_intra(0), live_tracked(1), live_tracked(2)})
        EXPECT_FALSE(repeated.is_repeat(packet));
    for (const auto& packet : {live_header(1), live_intra(0), live_tracked(1), live_tracked(2)})
        EXPECT_TRUE(repeated.is_repeat(packet));
    EXPECT_FALSE(repeated.is_repeat(live_tracked(3)));
}

TEST(RepeatedPackets, AnotherSessionBeginsAgain) {
    RepeatedPackets repeated;
    for (const auto& packet : {live_header(1), live_intra(0), live_header(2), live_intra(0)})
        EXPECT_FALSE(repeated.is_repeat(packet));
}

TEST(RepeatedPackets, WithoutASessionThereAreNone) {
    auto header = live_header(1);
    header.flags = packet_flag::flags_valid;
    RepeatedPackets repeated;
    for (const auto& packet : {header, live_intra(0), live_tracked(1), header, live_intra(0)})
        EXPECT_FALSE(repeated.is_repeat(packet));
}

TEST(RepeatedPackets, SoundGoesByItsTime) {
    RepeatedPackets repeated;
    const auto sound = [](std::uint32_t frame) {
        return live_packet(PacketKind::audio, frame, frame, packet_flag::droppable, 10);
    };
    EXPECT_FALSE(repeated.is_repeat(live_header(1)));
    EXPECT_FALSE(repeated.is_repeat(live_intra(0)));
    EXPECT_FALSE(repeated.is_repeat(sound(0)));
    EXPECT_TRUE(repeated.is_repeat(sound(0)));
    EXPECT_FALSE(repeated.is_repeat(sound(1)));
}

}  // namespace
}  // namespace htvm::live
