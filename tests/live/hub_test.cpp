// Who may publish a stream, and what of a publisher's messages goes on.
#include "live/hub.h"

#include <gtest/gtest.h>

namespace htvm::live {
namespace {

using namespace std::chrono_literals;
using namespace packet_flag;

constexpr Hub::Clock::time_point start{};

std::vector<std::uint8_t> message(PacketKind kind, std::uint32_t frame, std::uint32_t reference, std::uint8_t flags,
                                  std::size_t bytes = 50) {
    Packet out;
    out.kind = kind;
    out.frame = frame;
    out.reference = reference;
    out.flags = static_cast<std::uint8_t>(told | flags);
    out.payload.resize(bytes, 1);
    return write_packet(out);
}

std::vector<std::uint8_t> header(std::uint32_t session_number) {
    return message(PacketKind::sequence, 0, session_number, session);
}
std::vector<std::uint8_t> intra(std::uint32_t frame) {
    return message(PacketKind::intra, frame, frame, referred | access);
}

struct Fixture : testing::Test {
    Hub hub{HubLimits{.streams = 2, .viewers = 2}};
    std::vector<std::string> told;

    Hub::Publisher publisher(const std::string& name = "anna") {
        auto out = hub.publish(name, [this](const std::string& reason) { told.push_back(reason); });
        EXPECT_TRUE(out);
        return *out;
    }
    Hub::Viewer viewer(int* gone = nullptr) {
        auto out = hub.watch(
            "anna", [] {},
            [gone] {
                if (gone) ++*gone;
            },
            start);
        EXPECT_TRUE(out);
        return *out;
    }
    std::vector<std::uint32_t> frames(const Hub::Viewer& viewer) {
        std::vector<std::uint32_t> out;
        while (const auto packet = hub.next(viewer))
            if (packet->header.kind != PacketKind::sequence) out.push_back(packet->header.frame);
        return out;
    }
};
using HubTest = Fixture;
using Frames = std::vector<std::uint32_t>;

TEST_F(HubTest, WhatIsPublishedIsWatched) {
    const auto anna = publisher();
    ASSERT_TRUE(hub.take(anna, header(1), start));
    ASSERT_TRUE(hub.take(anna, intra(0), start));
    const auto late = viewer();
    ASSERT_TRUE(hub.take(anna, intra(1), start));
    EXPECT_EQ(frames(late), (Frames{0, 1}));
}

TEST_F(HubTest, AStreamBeginsWithASequenceHeader) {
    EXPECT_FALSE(hub.take(publisher(), intra(0), start));
    EXPECT_FALSE(hub.take(publisher(), {1, 2, 3}, start));
    EXPECT_FALSE(hub.watch(
        "anna", [] {}, [] {}, start));
}

TEST_F(HubTest, DamagedMessagesAreCountedAndGoNoFurther) {
    const auto anna = publisher();
    ASSERT_TRUE(hub.take(anna, header(1), start));
    const auto watching = viewer();
    auto damaged = intra(0);
    damaged[40] ^= 1;
    auto longer = intra(0);
    longer.push_back(0);
    auto shorter = intra(0);
    shorter.pop_back();
    for (const auto& wrong : {damaged, longer, shorter, std::vector<std::uint8_t>{}})
        EXPECT_TRUE(hub.take(anna, wrong, start));
    EXPECT_EQ(frames(watching), Frames{});
    EXPECT_EQ(hub.streams()[0].publisher.damaged, 4u);
    EXPECT_EQ(hub.streams()[0].publisher.packets, 1u);
}

TEST_F(HubTest, TheSameSessionGoesOnOverAnotherConnection) {
    const auto before = publisher();
    ASSERT_TRUE(hub.take(before, header(1), start));
    ASSERT_TRUE(hub.take(before, intra(0), start));
    const auto watching = viewer();
    const auto again = publisher();
    ASSERT_TRUE(hub.take(again, header(1), start + 10ms));
    EXPECT_EQ(told, std::vector<std::string>{"this session was continued by another connection"});
    EXPECT_FALSE(hub.take(before, intra(1), start + 10ms));
    ASSERT_TRUE(hub.take(again, intra(2), start + 20ms));
    hub.leave(before, start + 30ms);  // the connection that was replaced ends nothing
    EXPECT_TRUE(hub.streams()[0].published);
    EXPECT_EQ(frames(watching), (Frames{0, 2}));
}

TEST_F(HubTest, AnotherSessionTakesOverOnlyOnceTheOldOneIsSilent) {
    const auto first = publisher();
    ASSERT_TRUE(hub.take(first, header(1), start));
    const auto second = publisher();
    const auto refused = hub.take(second, header(2), start + 1999ms);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().message, "'anna' is being published by another session; end that one, or wait");
    ASSERT_TRUE(hub.take(publisher(), header(2), start + 2000ms));
    EXPECT_EQ(told, std::vector<std::string>{"another session took the stream over"});
    EXPECT_FALSE(hub.take(first, intra(0), start + 2001ms));
}

TEST_F(HubTest, AfterThePublisherLeftAnotherSessionWaitsAMomentToo) {
    const auto first = publisher();
    ASSERT_TRUE(hub.take(first, header(1), start));
    hub.leave(first, start + 1s);
    EXPECT_FALSE(hub.take(publisher(), header(2), start + 2s));
    EXPECT_TRUE(hub.take(publisher(), header(2), start + 3s));
}

TEST_F(HubTest, AStreamWithoutAPublisherIsForgottenAndItsViewersAreTold) {
    const auto anna = publisher();
    ASSERT_TRUE(hub.take(anna, header(1), start));
    int gone = 0;
    const auto watching = viewer(&gone);
    hub.leave(anna, start);
    hub.tidy(start + 10s);
    EXPECT_EQ(gone, 0);
    hub.tidy(start + 10001ms);
    EXPECT_EQ(gone, 1);
    EXPECT_TRUE(hub.streams().empty());
    // Another stream of the same name is none of theirs.
    const auto again = publisher();
    ASSERT_TRUE(hub.take(again, header(2), start + 11s));
    const auto other = viewer();
    ASSERT_TRUE(hub.take(again, intra(0), start + 11s));
    EXPECT_EQ(hub.next(watching), nullptr);
    hub.leave(watching);
    EXPECT_EQ(frames(other), Frames{0});
}

TEST_F(HubTest, StreamsAndViewersAreLimited) {
    ASSERT_TRUE(hub.take(publisher("anna"), header(1), start));
    const auto viewers = {viewer(), viewer()};
    EXPECT_EQ(viewers.size(), 2u);
    EXPECT_FALSE(hub.watch(
        "anna", [] {}, [] {}, start));
    hub.leave(*viewers.begin());
    viewer();
    ASSERT_TRUE(hub.take(publisher("ben"), header(1), start));
    const auto third = hub.publish("carl", [](const std::string&) {});
    ASSERT_FALSE(third);
    EXPECT_EQ(third.error().kind, ErrorKind::limit);
    EXPECT_TRUE(hub.publish("ben", [](const std::string&) {}));
}

}  // namespace
}  // namespace htvm::live
