// What hubs say to each other survives the way; what is damaged is refused, whatever counts it claims.
#include "live/hub/hub_message.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace htvm::live {
namespace {

Bytes written_again(const HubMessage& message) {
    const auto bytes = write_hub_message(message);
    const auto read = read_hub_message(bytes);
    EXPECT_TRUE(read);
    return read ? write_hub_message(*read) : Bytes{};
}

std::vector<HubMessage> one_of_each() {
    return {Announcement{"north", "wss://north:8080", {{"anna", 5, 77, true, -3, 9}, {"", 6, 0, false, {}, 0}}},
            PublishedPacket{"anna", {1, 2}, {7, {1, 2, 3}}}, StreamRequest{"anna", {1, 2}, 12, true, false},
            ClosureAnswer{"anna", {1, 2}, 8, {{0, {9}}, {7, {}}}}};
}

TEST(HubMessage, WhatIsWrittenIsRead) {
    for (const auto& message : one_of_each()) EXPECT_EQ(written_again(message), write_hub_message(message));
    const auto read = read_hub_message(write_hub_message(one_of_each()[0]));
    const auto& announcement = std::get<Announcement>(*read);
    EXPECT_EQ(announcement.url, "wss://north:8080");
    EXPECT_EQ(announcement.streams[0].clock, -3);
    EXPECT_FALSE(announcement.streams[1].clock);
}

TEST(HubMessage, ShorterOrLongerMessagesAreRefused) {
    for (const auto& message : one_of_each()) {
        auto bytes = write_hub_message(message);
        const bool packet = std::holds_alternative<PublishedPacket>(message);  // it goes on to the end
        for (std::size_t n = 0; n + (packet ? 3 : 0) < bytes.size(); ++n)
            EXPECT_FALSE(read_hub_message(std::span(bytes).first(n)));
        bytes.push_back(0);
        EXPECT_EQ(read_hub_message(bytes).has_value(), packet);
    }
    EXPECT_FALSE(read_hub_message(Bytes{4}));
}

TEST(HubMessage, CountsAreCheckedBeforeThereIsRoomMadeForThem) {
    auto announcement = write_hub_message(Announcement{});
    std::fill(announcement.end() - 4, announcement.end(), std::uint8_t{0xff});
    EXPECT_FALSE(read_hub_message(announcement));
    auto closure = write_hub_message(ClosureAnswer{});
    std::fill(closure.end() - 4, closure.end(), std::uint8_t{0xff});
    EXPECT_FALSE(read_hub_message(closure));
    // A packet from after the closure's end.
    EXPECT_FALSE(read_hub_message(write_hub_message(ClosureAnswer{"a", {}, 3, {{3, {}}}})));
}

Bytes long_message() {
    Bytes out(1000);
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<std::uint8_t>(i * 7);
    return out;
}

TEST(PartReader, PartsInAnyOrderAndDoubledMakeTheMessage) {
    const auto message = long_message();
    auto parts = cut_into_parts(5, 1, message, 300);
    ASSERT_EQ(parts.size(), 4u);
    PartReader reader;
    for (const auto i : {2, 0, 0, 3, 2}) EXPECT_FALSE(reader.add(parts[i]));
    const auto whole = reader.add(parts[1]);
    ASSERT_TRUE(whole);
    EXPECT_EQ(whole->hub, 5u);
    EXPECT_EQ(whole->message, message);
    EXPECT_EQ(reader.waiting_bytes(), 0u);
}

TEST(PartReader, MessagesOfDifferentHubsDoNotMix) {
    const auto message = long_message();
    PartReader reader;
    EXPECT_FALSE(reader.add(cut_into_parts(1, 1, message, 500)[0]));
    EXPECT_FALSE(reader.add(cut_into_parts(2, 1, message, 500)[1]));
    EXPECT_TRUE(reader.add(cut_into_parts(1, 1, message, 500)[1]));
}

TEST(PartReader, OfIncompleteMessagesTheOldestAreGivenUp) {
    PartReader reader(2000);
    for (std::uint64_t number = 0; number < 10; ++number) {
        EXPECT_FALSE(reader.add(cut_into_parts(1, number, long_message(), 500)[0]));
        EXPECT_LE(reader.waiting_bytes(), 2000u);
    }
    EXPECT_EQ(reader.incomplete(), 6u);
    EXPECT_TRUE(reader.add(cut_into_parts(1, 9, long_message(), 500)[1]));
}

TEST(PartReader, WhatIsNoPartIsCounted) {
    PartReader reader;
    auto part = cut_into_parts(1, 1, long_message())[0];
    EXPECT_FALSE(reader.add({}));
    EXPECT_FALSE(reader.add(std::span(part).first(23)));
    part[20] = 9;  // part 9 of 1
    EXPECT_FALSE(reader.add(part));
    EXPECT_FALSE(reader.add(Bytes(most_part_bytes + 100)));
    EXPECT_EQ(reader.damaged(), 4u);
    EXPECT_TRUE(cut_into_parts(1, 1, long_message(), 10).empty());  // too many
}

TEST(Subjects, NoNameOfAStreamIsAPatternOrAnothersSubject) {
    EXPECT_EQ(packets_subject("anna-2"), "htvm.v1.packets.anna-2");
    EXPECT_EQ(packets_subject("a.b"), "htvm.v1.packets.a=2Eb");
    EXPECT_EQ(packets_subject("a=2Eb"), "htvm.v1.packets.a=3D2Eb");
    EXPECT_EQ(packets_subject(">"), "htvm.v1.packets.=3E");
    EXPECT_EQ(packets_subject("* \r\n"), "htvm.v1.packets.=2A=20=0D=0A");
    EXPECT_EQ(hub_subject(0x1f), "htvm.v1.hub.000000000000001f");
}

}  // namespace
}  // namespace htvm::live
