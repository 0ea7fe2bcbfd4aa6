#include "live_rounds.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <utility>
#include <vector>

#include "codec/format/sequence.h"
#include "htvm/decoder.hpp"
#include "pacing.h"

namespace htvm::app {
namespace {

using std::chrono::milliseconds;

std::vector<Packet> packets_of(const std::string& name) {
    std::ifstream file(HTVM_TEST_DATA "/conformance/" + name, std::ios::binary);
    const std::vector<char> bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    PacketReader reader;
    reader.push({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    std::vector<Packet> out;
    while (auto packet = reader.pull()) out.push_back(std::move(*packet));
    return out;
}

std::vector<Packet> rounds_of(const std::string& name, int rounds, double speed = 1) {
    std::uint64_t session = 100;
    LiveRounds live([&session] { return session++; }, speed);
    std::vector<Packet> out;
    for (int i = 0; i < rounds; ++i) {
        live.begin_round();
        for (auto& packet : packets_of(name)) {
            auto taken = live.take(std::move(packet));
            EXPECT_TRUE(taken) << taken.error().message;
            if (!taken) return out;
            for (auto& next : *taken) out.push_back(std::move(next));
        }
    }
    return out;
}

TEST(LiveRounds, EachSequenceOfEachRoundHasASessionOfItsOwn) {
    std::vector<std::uint64_t> sessions;
    for (const auto& packet : rounds_of("sequences_2.htvm", 2)) {
        if (packet.kind != PacketKind::sequence) continue;
        const auto header = internal::read_sequence_header(packet.payload);
        ASSERT_TRUE(header);
        EXPECT_EQ(packet.reference, internal::sequence_packet(*header).reference);
        EXPECT_TRUE(packet.has(packet_flag::session) && packet.has(packet_flag::flags_valid));
        if (sessions.empty() || sessions.back() != header->session) sessions.push_back(header->session);
    }
    ASSERT_GE(sessions.size(), 4u);
    for (std::size_t k = 0; k < sessions.size(); ++k) EXPECT_EQ(sessions[k], 100 + k);
}

// A digest of each decoded frame's positions.
std::vector<std::uint64_t> digests_of(const std::vector<Packet>& packets) {
    Decoder decoder;
    std::vector<std::uint64_t> out;
    for (const auto& packet : packets) {
        auto frame = decoder.decode_copy(packet);
        EXPECT_TRUE(frame) << frame.error().message;
        if (!frame || !*frame) continue;
        auto& digest = out.emplace_back(1);
        for (const auto& p : (**frame).mesh.positions)
            for (const auto c : p) digest = 31 * digest + std::hash<float>()(c);
    }
    return out;
}

TEST(LiveRounds, EachDecodesToTheMeshesOfTheFile) {
    for (const auto* name : {"tracked_2.htvm", "tracked_3.htvm"}) {
        auto twice = digests_of(packets_of(name));
        ASSERT_GT(twice.size(), 1u) << name;
        const auto once = twice;
        twice.insert(twice.end(), once.begin(), once.end());
        EXPECT_EQ(digests_of(rounds_of(name, 2)), twice) << name;
    }
}

TEST(LiveRounds, TimeGoesOnFromRoundToRound) {
    std::vector<std::int64_t> times;
    for (const auto& packet : rounds_of("tracked_2.htvm", 3))
        if (frame_type(packet.kind)) times.push_back(packet.timestamp_us);
    for (std::size_t k = 1; k < times.size(); ++k) {
        EXPECT_GT(times[k], times[k - 1]);
        EXPECT_LT(times[k] - times[k - 1], 50000);
    }
}

TEST(LiveRounds, TwiceAsFastTimeTakesHalf) {
    const auto once = rounds_of("tracked_2.htvm", 1), fast = rounds_of("tracked_2.htvm", 1, 2);
    ASSERT_EQ(once.size(), fast.size());
    EXPECT_NEAR(static_cast<double>(fast.back().timestamp_us), static_cast<double>(once.back().timestamp_us) / 2, 1);
}

TEST(LiveRounds, WhatIsPutOffIsSoMuchLaterAndSoIsTheEnd) {
    std::uint64_t session = 1;
    LiveRounds live([&session] { return session++; });
    std::vector<std::int64_t> times;
    std::vector<std::uint64_t> ends;
    for (int round = 0; round < 2; ++round) {
        live.begin_round();
        if (round == 1) live.put_off(70000);
        bool first = true;
        for (auto& packet : packets_of("sequences_2.htvm")) {
            const auto taken = live.take(std::move(packet));
            ASSERT_TRUE(taken);
            for (const auto& next : *taken)
                if (frame_type(next.kind) && std::exchange(first, false)) times.push_back(next.timestamp_us);
        }
        ends.push_back(live.end_us());
    }
    EXPECT_EQ(times[0], 0);
    EXPECT_EQ(times[1], static_cast<std::int64_t>(ends[0]) + 70000);
    EXPECT_EQ(ends[1], 2 * ends[0] + 70000);
}

TEST(LiveRounds, IndicesAreLeftOut) {
    for (const auto& packet : rounds_of("person_2.htvm", 1))
        EXPECT_TRUE(packet.kind != PacketKind::index && packet.kind != PacketKind::front_index);
}

TEST(LiveRounds, StreamsOfVersionOneAreRefused) {
    LiveRounds live([] { return std::uint64_t{1}; });
    std::optional<Error> error;
    for (auto& packet : packets_of("person.htvm"))
        if (auto taken = live.take(std::move(packet)); !taken) error = taken.error();
    ASSERT_TRUE(error);
    EXPECT_EQ(error->kind, ErrorKind::unsupported);
}

// ---- Pacing ---------------------------------------------------------------------------------------------------------

const Pacing::Clock::time_point start{std::chrono::hours(1)};

TEST(Pacing, FramesAreDueByTheirTimestampsWithoutDrift) {
    Pacing pacing;
    EXPECT_EQ(pacing.due(5000000, start), start);
    // Three hours at 30 frames a second, each asked for a little late.
    for (std::int64_t k = 1; k < 3 * 3600 * 30; ++k) {
        const auto us = std::chrono::microseconds(k * 1000000 / 30);
        ASSERT_LE(abs(pacing.due(5000000 + us.count(), start + us + milliseconds(20)) - (start + us)),
                  std::chrono::microseconds(1));
    }
}

TEST(Pacing, WhatIsLateIsNotMadeUpForByABurst) {
    Pacing pacing;
    pacing.due(0, start);
    const auto late = start + milliseconds(5000);
    EXPECT_EQ(pacing.due(33000, late), late);
    EXPECT_EQ(pacing.due(66000, late), late + milliseconds(33));
}

TEST(Pacing, ALittleLateIsMadeUpFor) {
    Pacing pacing;
    pacing.due(0, start);
    EXPECT_EQ(pacing.due(33000, start + milliseconds(80)), start + milliseconds(33));
    EXPECT_EQ(pacing.due(66000, start + milliseconds(80)), start + milliseconds(66));
}

TEST(Pacing, OddTimestampsOverflowNothing) {
    Pacing pacing;
    pacing.due(std::numeric_limits<std::int64_t>::min(), start);
    EXPECT_GT(pacing.due(std::numeric_limits<std::int64_t>::max(), start), start);
    EXPECT_EQ(pacing.due(std::numeric_limits<std::int64_t>::min(), start), start);
}

}  // namespace
}  // namespace htvm::app
