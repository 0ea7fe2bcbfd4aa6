#include "io/ogg_opus.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "core/opus_packet.h"

namespace htvm {
namespace {

// tests/data/audio/clicks.opus: 3 s at 24 kbit/s, of opusenc, in packets of 20 ms, with clicks at 0.25 s, 0.75 s, ...
std::vector<std::uint8_t> clicks() {
    std::ifstream in(HTVM_TEST_DATA "/audio/clicks.opus", std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

TEST(OggOpus, PacketsComeWithWhatIsHeardOfThem) {
    const auto track = read_ogg_opus(clicks());
    ASSERT_TRUE(track) << track.error().message;
    EXPECT_EQ(track->channels, 1);
    EXPECT_EQ(track->pre_skip, 312u);
    EXPECT_EQ(track->samples, 3u * 48000);
    ASSERT_EQ(track->packets.size(), 151u);
    for (const auto& packet : track->packets) EXPECT_EQ(internal::opus_samples(packet), 960u);
}

TEST(OggOpus, AnythingElseIsRefusedWithAdvice) {
    for (const std::string text : {"RIFF....WAVEfmt ", "", "OggS"}) {
        const std::vector<std::uint8_t> bytes(text.begin(), text.end());
        const auto track = read_ogg_opus(bytes);
        ASSERT_FALSE(track);
        EXPECT_NE(track.error().message.find("ffmpeg"), std::string::npos) << track.error().message;
    }
}

TEST(OggOpus, DamageAndMissingPagesAreErrors) {
    const auto whole = clicks();
    auto changed = whole;
    changed[whole.size() / 2] ^= 1;
    EXPECT_FALSE(read_ogg_opus(changed));
    const std::string mark = "OggS";
    std::vector<std::size_t> pages;
    for (auto at = whole.begin(); at != whole.end(); ++at) {
        at = std::search(at, whole.end(), mark.begin(), mark.end());
        if (at == whole.end()) break;
        pages.push_back(static_cast<std::size_t>(at - whole.begin()));
    }
    ASSERT_GE(pages.size(), 4u);
    auto missing = whole;
    missing.erase(missing.begin() + static_cast<std::ptrdiff_t>(pages[2]),
                  missing.begin() + static_cast<std::ptrdiff_t>(pages[3]));
    const auto track = read_ogg_opus(missing);
    ASSERT_FALSE(track);
    EXPECT_NE(track.error().message.find("page is missing"), std::string::npos) << track.error().message;
    EXPECT_FALSE(read_ogg_opus(std::span(whole).first(whole.size() - 100)));
    EXPECT_FALSE(read_ogg_opus(std::span(whole).first(pages[2])));
}

TEST(OggOpus, WhatIsWrittenIsReadAgain) {
    auto track = *read_ogg_opus(clicks());
    track.channels = 2;
    track.gain = -300;
    track.packets[7].resize(255);     // whose lacing has a zero behind it
    track.packets[8].resize(200000);  // over several pages
    for (const std::uint32_t cut : {0u, 1u, 311u}) {
        auto cut_off = track;
        cut_off.samples -= cut;
        const auto again = read_ogg_opus(write_ogg_opus(cut_off));
        ASSERT_TRUE(again) << again.error().message;
        EXPECT_TRUE(again->packets == track.packets);
        EXPECT_EQ(again->samples, cut_off.samples);
        EXPECT_EQ(again->pre_skip, track.pre_skip);
        EXPECT_EQ(again->gain, track.gain);
        EXPECT_EQ(again->channels, track.channels);
    }
    track.samples = 48000;  // what is behind them is left out
    const auto part = read_ogg_opus(write_ogg_opus(track));
    ASSERT_TRUE(part) << part.error().message;
    EXPECT_EQ(part->packets.size(), 51u);
    EXPECT_EQ(part->samples, 48000u);
}

TEST(OpusPacket, ItsFirstBytesTellItsLength) {
    using Bytes = std::vector<std::uint8_t>;
    const auto samples = [](const Bytes& bytes) { return internal::opus_samples(bytes); };
    EXPECT_EQ(samples({0 << 3}), 480u);                  // speech, 10 ms
    EXPECT_EQ(samples({3 << 3}), 2880u);                 // speech, 60 ms
    EXPECT_EQ(samples({13 << 3 | 1}), 1920u);            // hybrid, twice 20 ms
    EXPECT_EQ(samples({16 << 3}), 120u);                 // music, 2.5 ms
    EXPECT_EQ(samples({31 << 3 | 3, 6}), 5760u);         // music, six times 20 ms
    EXPECT_EQ(samples({31 << 3 | 3, 7}), std::nullopt);  // more than 120 ms
    EXPECT_EQ(samples({31 << 3 | 3, 0}), std::nullopt);
    EXPECT_EQ(samples({31 << 3 | 3}), std::nullopt);
    EXPECT_EQ(samples({}), std::nullopt);
}

}  // namespace
}  // namespace htvm
