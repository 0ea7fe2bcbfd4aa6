// A frame that waits for the next one, so that work of both goes side by side: the stream is the same.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string_view>

#include "codec/moving_sequences.h"
#include "codec/patched_sequences.h"
#include "codec/test_sequences.h"
#include "htvm/encoder.hpp"

namespace htvm::internal {
namespace {

using namespace test;

TestSequence walking(int frames) {
    TestSequence out{"walking", {}, {}};
    SynthOptions options;
    options.vertices = 900;
    for (int t = 0; t < frames; ++t) out.frames.push_back({synth_frame(options, 2 * t).mesh, {}});
    return out;
}

using Change = std::function<void(EncoderOptions&)>;

std::vector<std::vector<std::uint8_t>> stream(const TestSequence& sequence, EncoderOptions options, int latency,
                                              unsigned threads) {
    options.latency_frames = latency;
    options.threads = threads;
    auto encoder = *Encoder::create(options);
    std::vector<std::vector<std::uint8_t>> out;
    const auto take = [&] {
        while (auto packet = encoder.pull()) out.push_back(write_packet(*packet));
    };
    std::int64_t time = 0;
    for (const auto& frame : sequence.frames) {
        const bool pushed = encoder.push(frame.mesh, frame.pose ? &*frame.pose : nullptr, time += 33333).has_value();
        EXPECT_TRUE(pushed);
        take();
    }
    EXPECT_TRUE(encoder.finish());
    take();
    return out;
}

void expect_the_same_stream(const TestSequence& sequence, const Change& change = {}) {
    auto options = default_options(Profile::tracked);
    if (change) change(options);
    const auto plain = stream(sequence, options, 0, 1);
    EXPECT_EQ(stream(sequence, options, 1, 1), plain);
    EXPECT_EQ(stream(sequence, options, 1, 3), plain);
    EXPECT_EQ(stream(sequence, options, 2, 3), plain);
}

TEST(Latency, LeavesTrackedFramesAsTheyAre) { expect_the_same_stream(walking(8)); }

TEST(Latency, LeavesIntraFramesAndThoseBehindThemAsTheyAre) {
    expect_the_same_stream(walking(7), [](auto& o) { o.key_interval = 3; });
}

TEST(Latency, LeavesPatchesAndWhatFollowsThemAsTheyAre) {
    auto options = patched_options();
    const auto plain = stream(horned_ball(6), options, 0, 1);
    EXPECT_EQ(stream(horned_ball(6), options, 1, 2), plain);
    EXPECT_EQ(stream(horned_ball(6), options, 2, 2), plain);
    const auto is_patched = [](const std::vector<std::uint8_t>& packet) { return packet[4] == 11; };
    EXPECT_TRUE(std::any_of(plain.begin(), plain.end(), is_patched));
}

TEST(Latency, LeavesGroupsAsTheyAre) {
    expect_the_same_stream(walking(8), [](auto& o) { o.tracked.group = 3; });
}

TEST(Latency, LeavesARateAsItIs) {
    expect_the_same_stream(walking(8), [](auto& o) { o.rate.bits_per_second = 300e3; });
}

TEST(Latency, LeavesOtherProfilesAsTheyAre) {
    for (const auto profile : {Profile::topology, Profile::paper})
        for (const auto choice : {FrameChoice::fixed, FrameChoice::cheaper, FrameChoice::rate_distortion}) {
            auto options = default_options(profile);
            options.topology.frame_choice = choice;
            options.key_interval = 5;
            const auto plain = stream(walking(8), options, 0, 1);
            EXPECT_EQ(stream(walking(8), options, 1, 1), plain);
            EXPECT_EQ(stream(walking(8), options, 1, 2), plain);
            EXPECT_EQ(stream(walking(8), options, 2, 1), plain);
            EXPECT_EQ(stream(walking(8), options, 2, 3), plain);
        }
}

// How often each push goes through a stage.
std::vector<std::size_t> times_of(std::string_view stage, const TestSequence& sequence, const EncoderOptions& options) {
    auto encoder = *Encoder::create(options);
    std::vector<std::size_t> out;
    for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
        EXPECT_TRUE(encoder.push(sequence.frames[i].mesh, nullptr, static_cast<std::int64_t>(33333 * i)));
        out.push_back(static_cast<std::size_t>(std::ranges::count_if(
            encoder.stage_times(), [&](const auto& time) { return std::string_view(time.stage) == stage; })));
    }
    return out;
}

using Times = std::vector<std::size_t>;

TEST(Latency, BringsTheFirstHalfOfTheNextEnhancedFrameForward) {
    auto options = default_options(Profile::paper);
    options.topology.frame_choice = FrameChoice::fixed;
    options.latency_frames = 1;
    // The second push codes the I-frame; the third its first EP-frame, and half of the frame behind that one, too; the
    // fourth the other half, and the first half of the next.
    EXPECT_EQ(times_of("registration", walking(4), options), (Times{0, 0, 2, 1}));
    EXPECT_EQ(times_of("quantisation", walking(4), options), (Times{0, 0, 2, 1}));
    EXPECT_EQ(times_of("connectivity and entropy coding", walking(4), options), (Times{0, 0, 1, 1}));
}

TEST(Latency, OfTwoFramesFindsTheMotionOfOneBesideTheVerticesOfTheOther) {
    auto options = default_options(Profile::paper);
    options.topology.frame_choice = FrameChoice::fixed;
    options.latency_frames = 2;
    // The fourth push codes the first EP-frame and half of the second, and finds the motion of the third.
    EXPECT_EQ(times_of("registration", walking(6), options), (Times{0, 0, 0, 3, 1, 1}));
    EXPECT_EQ(times_of("quantisation", walking(6), options), (Times{0, 0, 0, 2, 1, 1}));
}

TEST(Latency, OfTwoFramesBuildsSearchStructuresTwoFramesAhead) {
    auto options = default_options(Profile::tracked);
    options.latency_frames = 2;
    EXPECT_EQ(times_of("search structures", walking(5), options), (Times{0, 0, 3, 1, 1}));
    EXPECT_EQ(times_of("registration", walking(5), options), (Times{0, 0, 0, 2, 1}));
}

TEST(Latency, LetsTwoFramesWait) {
    const auto sequence = walking(4);
    auto options = default_options(Profile::tracked);
    options.latency_frames = 2;
    auto encoder = *Encoder::create(options);
    std::vector<std::size_t> coded, held;
    for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
        ASSERT_TRUE(encoder.push(sequence.frames[i].mesh, nullptr, static_cast<std::int64_t>(33333 * i)));
        coded.push_back(encoder.coded_frames().size());
        held.push_back(encoder.held_frames());
    }
    EXPECT_EQ(coded, (Times{0, 0, 1, 1}));
    EXPECT_EQ(held, (Times{1, 2, 2, 2}));
    ASSERT_TRUE(encoder.finish());
    EXPECT_EQ(encoder.coded_frames().size(), 2u);
    EXPECT_EQ(encoder.held_frames(), 0u);
}

TEST(Latency, LetsOneFrameWait) {
    const auto sequence = walking(3);
    auto options = default_options(Profile::tracked);
    options.latency_frames = 1;
    auto encoder = *Encoder::create(options);
    ASSERT_TRUE(encoder.push(sequence.frames[0].mesh, nullptr, 0));
    EXPECT_EQ(encoder.held_frames(), 1u);
    EXPECT_TRUE(encoder.coded_frames().empty());
    EXPECT_FALSE(encoder.pull());
    ASSERT_TRUE(encoder.push(sequence.frames[1].mesh, nullptr, 33333));
    EXPECT_EQ(encoder.held_frames(), 1u);
    ASSERT_EQ(encoder.coded_frames().size(), 1u);
    EXPECT_EQ(encoder.coded_frames()[0].info.type, FrameType::intra);
    // A mesh that cannot be coded leaves the one that waits as it is.
    Mesh bad = sequence.frames[2].mesh;
    bad.triangles[0][0] = 1u << 30;
    EXPECT_FALSE(encoder.push(bad, nullptr, 66666));
    EXPECT_FALSE(encoder.push(sequence.frames[2].mesh, nullptr, 33333));
    EXPECT_EQ(encoder.held_frames(), 1u);
    ASSERT_TRUE(encoder.finish());
    EXPECT_EQ(encoder.held_frames(), 0u);
    ASSERT_EQ(encoder.coded_frames().size(), 1u);
    EXPECT_EQ(encoder.coded_frames()[0].info.type, FrameType::tracked);
}

TEST(Latency, WithoutAnyFrameFinishesAnEmptyStream) {
    auto options = default_options(Profile::tracked);
    options.latency_frames = 1;
    auto encoder = *Encoder::create(options);
    EXPECT_TRUE(encoder.finish());
    EXPECT_FALSE(encoder.pull());
}

}  // namespace
}  // namespace htvm::internal
