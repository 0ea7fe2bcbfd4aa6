// The text messages of docs/live.md, section 2, as they are written, and what is made of any others.
#include "live/client/control.h"

#include <gtest/gtest.h>

namespace htvm::live {
namespace {

constexpr std::int64_t most = std::int64_t{1} << 53;

template <class Message, class Read>
Message read_as(const Read& read, const std::string& text) {
    const auto message = read(text);
    EXPECT_TRUE(message) << message.error().message;
    if (!message) return {};
    EXPECT_TRUE(std::holds_alternative<Message>(*message)) << text;
    return std::holds_alternative<Message>(*message) ? std::get<Message>(*message) : Message{};
}

template <class Read>
std::string complaint(const Read& read, const std::string& text) {
    const auto message = read(text);
    return message ? "none" : message.error().message;
}

TEST(ControlTest, HelloNamesTheStreamItsSessionAndOtherHubs) {
    const Hello hello{1, "anna", 0x12ab, {"wss://b.example:8080"}};
    const auto text = write_text(hello);
    EXPECT_EQ(
        text,
        R"({"hubs":["wss://b.example:8080"],"session":"00000000000012ab","stream":"anna","type":"hello","version":1})");
    for (const auto& read : {read_as<Hello>(read_to_viewer, text), read_as<Hello>(read_to_publisher, text)}) {
        EXPECT_EQ(read.version, 1u);
        EXPECT_EQ(read.stream, "anna");
        EXPECT_EQ(read.session, 0x12abu);
        EXPECT_EQ(read.hubs, hello.hubs);
    }
    const auto before = write_text(Hello{.stream = "anna"});
    EXPECT_EQ(before, R"({"hubs":[],"stream":"anna","type":"hello","version":1})");
    EXPECT_EQ(read_as<Hello>(read_to_viewer, before).session, std::nullopt);
}

TEST(ControlTest, AHelloLeavesOutTheHubsThatDoNotFit) {
    Hello hello{.stream = std::string(1000, '"')};
    for (int i = 0; i < 100; ++i) hello.hubs.push_back("wss://" + std::string(90, 'a') + std::to_string(i));
    const auto text = write_text(hello);
    EXPECT_LE(text.size(), most_text_bytes);
    EXPECT_EQ(read_as<Hello>(read_to_viewer, text).hubs.size(), 20u);
    EXPECT_EQ(read_as<Hello>(read_to_viewer, write_text(Hello{.stream = "caf\xe9"})).stream, "caf\xef\xbf\xbd");
}

TEST(ControlTest, HeartbeatsOfEachDirection) {
    EXPECT_EQ(write_text(HeartbeatFromPublisher{}), R"({"type":"heartbeat"})");
    const auto publisher = write_text(HeartbeatFromPublisher{-5});
    EXPECT_EQ(publisher, R"({"clock":-5,"type":"heartbeat"})");
    EXPECT_EQ(read_as<HeartbeatFromPublisher>(read_from_publisher, publisher).clock, -5);
    const auto to_publisher = write_text(HeartbeatToPublisher{1, 2, 3, 4});
    EXPECT_EQ(to_publisher, R"({"bytes":3,"damaged":4,"packets":2,"type":"heartbeat","viewers":1})");
    const auto told = read_as<HeartbeatToPublisher>(read_to_publisher, to_publisher);
    EXPECT_EQ((std::vector{told.viewers, told.packets, told.bytes, told.damaged}),
              (std::vector<std::uint64_t>{1, 2, 3, 4}));
    const auto to_viewer = write_text(HeartbeatToViewer{true, 6, 7, 8, 9});
    EXPECT_EQ(
        to_viewer,
        R"({"clock":6,"dropped":9,"published":true,"session":"0000000000000007","type":"heartbeat","viewers":8})");
    const auto seen = read_as<HeartbeatToViewer>(read_to_viewer, to_viewer);
    EXPECT_TRUE(seen.published);
    EXPECT_EQ(seen.clock, 6);
    EXPECT_EQ(seen.session, 7u);
    EXPECT_EQ(seen.viewers, 8u);
    EXPECT_EQ(seen.dropped, 9u);
    EXPECT_EQ(write_text(HeartbeatToViewer{}), R"({"dropped":0,"published":false,"type":"heartbeat","viewers":0})");
}

TEST(ControlTest, KeyFrameGoneAndStamp) {
    const auto key_frame = write_text(KeyFrameRequest{});
    EXPECT_EQ(key_frame, R"({"type":"key_frame"})");
    read_as<KeyFrameRequest>(read_from_viewer, key_frame);
    read_as<KeyFrameRequest>(read_to_publisher, key_frame);
    const auto gone = write_text(Gone{"it left"});
    EXPECT_EQ(gone, R"({"reason":"it left","type":"gone"})");
    EXPECT_EQ(read_as<Gone>(read_to_viewer, gone).reason, "it left");
    EXPECT_LE(write_text(Gone{std::string(5000, '\x01')}).size(), most_text_bytes);
    const auto stamp = write_text(Stamp{7, 1700000000000000, 1700000000000900});
    EXPECT_EQ(stamp, R"({"frame":7,"hub":1700000000000900,"sent":1700000000000000,"type":"stamp"})");
    EXPECT_EQ(read_as<Stamp>(read_from_publisher, stamp).frame, 7u);
    EXPECT_EQ(read_as<Stamp>(read_to_viewer, stamp).hub, 1700000000000900);
    EXPECT_EQ(write_text(Stamp{7, 1}), R"({"frame":7,"sent":1,"type":"stamp"})");
}

TEST(ControlTest, TypesAndMembersThatAreNotKnownArePassedOver) {
    read_as<std::monostate>(read_from_viewer, R"({"type":"applause","loud":[1e9,{}]})");
    read_as<std::monostate>(read_from_viewer, R"({"type":"heartbeat"})");  // viewers send none
    const auto beat = R"({"type":"heartbeat","clock":3,"mood":{"calm":true}})";
    EXPECT_EQ(read_as<HeartbeatFromPublisher>(read_from_publisher, beat).clock, 3);
}

TEST(ControlTest, NumbersBeyondWhatEveryReaderHoldsAreNotWrittenAndNotRead) {
    EXPECT_EQ(read_as<HeartbeatFromPublisher>(read_from_publisher, write_text(HeartbeatFromPublisher{INT64_MIN})).clock,
              -most);
    EXPECT_EQ(read_as<HeartbeatToPublisher>(read_to_publisher, write_text(HeartbeatToPublisher{UINT64_MAX})).viewers,
              static_cast<std::uint64_t>(most));
    for (const char* clock : {"9007199254740993", "-9007199254740993", "18446744073709551615", "1e5", "0.5", "\"1\"",
                              "true", "1e30", "123456789012345678901234567890"})
        EXPECT_EQ(complaint(read_from_publisher, "{\"type\":\"heartbeat\",\"clock\":" + std::string(clock) + "}"),
                  "\"clock\" of the text message \"heartbeat\" must be a whole number from -9007199254740992 to "
                  "9007199254740992")
            << clock;
    EXPECT_EQ(complaint(read_from_publisher, R"({"type":"stamp","frame":4294967296,"sent":1})"),
              "\"frame\" of the text message \"stamp\" must be a whole number from 0 to 4294967295");
}

TEST(ControlTest, WhatIsNoMessageIsRefusedWithASentence) {
    for (const char* text : {"", "[]", "3", "null", "{", "{\"type\":\"heartbeat\"} {}", "{\"clock\":1e999}", "\xff"})
        EXPECT_EQ(complaint(read_from_viewer, text), "the text message is not a JSON object") << text;
    EXPECT_EQ(complaint(read_from_viewer, "{}"), "the text message has no \"type\"");
    EXPECT_EQ(complaint(read_from_viewer, R"({"type":3})"), "\"type\" of the text message must be a text");
    EXPECT_EQ(complaint(read_from_viewer, "{\"type\":\"" + std::string(4096, 'a') + "\"}"),
              "the text message is longer than 4096 bytes");
    EXPECT_EQ(complaint(read_from_viewer, std::string(4096, '[')), "the text message is not a JSON object");
    EXPECT_EQ(complaint(read_from_publisher, R"({"type":"stamp","frame":1})"),
              "\"sent\" of the text message \"stamp\" is missing");
    EXPECT_EQ(complaint(read_to_viewer, R"({"type":"heartbeat","viewers":0,"dropped":0,"published":1})"),
              "\"published\" of the text message \"heartbeat\" must be true or false");
    for (const char* session : {"12ab", "000000000000000g", "-000000000000001", "00000000000000001", ""})
        EXPECT_EQ(complaint(read_to_viewer,
                            R"({"type":"hello","version":1,"stream":"a","session":")" + std::string(session) + "\"}"),
                  "\"session\" of the text message \"hello\" must be 16 hexadecimal digits")
            << session;
    EXPECT_EQ(complaint(read_to_viewer, R"({"type":"hello","version":1,"stream":"a","hubs":["b",1]})"),
              "\"hubs\" of the text message \"hello\" must be a list of texts");
}

}  // namespace
}  // namespace htvm::live
