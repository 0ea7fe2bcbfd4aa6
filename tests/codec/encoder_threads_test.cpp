// The same input and options give the same bytes for any number of threads: every kind of frame, every way to choose
// them, rate control in one pass and two, with and without a skeleton.
#include <gtest/gtest.h>

#include <functional>
#include <thread>
#include <vector>

#include "codec/enhanced_options.h"
#include "codec/moving_sequences.h"
#include "codec/test_sequences.h"

namespace htvm::internal {
namespace {

using namespace test;

// Large enough that every parallel loop cuts its range into pieces.
const TestSequence& person() {
    static const auto sequence = walking(5, 6000);
    return sequence;
}

const TestSequence& without_skeleton() {
    static const auto sequence = synthetic(false, 3, 6000);
    return sequence;
}

CodedSequence expect_same_bytes(const TestSequence& sequence, EncoderOptions options) {
    options.threads = 1;
    auto one = encode(sequence, options);
    EXPECT_TRUE(one.errors.empty()) << one.errors[0];
    for (const unsigned threads : {2u, 3u, 7u, 0u}) {
        options.threads = threads;
        EXPECT_EQ(encode(sequence, options).bytes, one.bytes) << threads << " threads";
    }
    return one;
}

TEST(EncoderThreads, IntraAndEnhancedFrames) {
    EncoderOptions options = test::enhanced_options();
    options.key_interval = 3;
    expect_same_bytes(person(), options);
    expect_same_bytes(without_skeleton(), options);
}

TEST(EncoderThreads, ThePapersChoices) {
    EncoderOptions options = default_options(Profile::paper);
    options.topology.merge_duplicates = false;
    expect_same_bytes(person(), options);
}

TEST(EncoderThreads, PredictedFramesAndThoseCodedInPart) {
    auto options = motion_based(40, 5);
    options.topology.frame_choice = FrameChoice::motion;
    options.topology.predicted_below = 400;
    options.topology.animation_error = 8;
    const auto coded = expect_same_bytes(person(), options);
    EXPECT_GE(frames_of(coded, FrameType::predicted) + frames_in_part(coded), 1u);
}

TEST(EncoderThreads, TrackedFrames) {
    EncoderOptions options;
    auto sequence = walking(4, 6000, 20);
    EXPECT_GE(frames_of(expect_same_bytes(sequence, options), FrameType::tracked), 2u);
    options.tracked.references = TrackedReferences::intra;
    sequence.skeleton = {};
    for (auto& frame : sequence.frames) frame.pose.reset();
    EXPECT_GE(frames_of(expect_same_bytes(sequence, options), FrameType::tracked), 2u);
}

TEST(EncoderThreads, FramesChosenByRateAndDistortion) {
    const auto sequence = walking(4, 6000, 20);
    EncoderOptions options = test::enhanced_options();
    const auto unchosen = encode(sequence, options);
    options.topology.frame_choice = FrameChoice::rate_distortion;
    options.topology.still_below = 40;
    const auto coded = expect_same_bytes(sequence, options);
    EXPECT_NE(frames_of(coded, FrameType::enhanced), frames_of(unchosen, FrameType::enhanced));
}

// Runs the tasks one after another, the last first.
void in_reverse(std::size_t tasks, const std::function<void(std::size_t)>& task) {
    for (std::size_t t = tasks; t-- > 0;) task(t);
}

TEST(EncoderThreads, ThoseOfTheCallersRunnerGiveTheSameBytesAndMeshes) {
    for (const auto profile : {Profile::topology, Profile::tracked}) {
        auto options = default_options(profile);
        options.threads = 1;
        const auto one = encode(person(), options);
        options.threads = 3;
        for (const auto& runner : {TaskRunner(in_reverse), thread_pool(2)}) {
            options.runner = runner;
            EXPECT_EQ(encode(person(), options).bytes, one.bytes);
            DecoderOptions decoder;
            decoder.threads = 3;
            decoder.runner = runner;
            const auto decoded = decode_packets(one.packets, decoder);
            ASSERT_EQ(decoded.frames.size(), one.reconstructions.size());
            for (std::size_t t = 0; t < decoded.frames.size(); ++t)
                expect_same_mesh(decoded.frames[t].mesh, one.reconstructions[t]);
        }
    }
}

TEST(EncoderThreads, EncodersThatShareAPoolMayRunAtOnce) {
    auto options = default_options(Profile::tracked);
    const auto one = encode(person(), options);
    options.runner = thread_pool(3);
    options.threads = 3;
    std::vector<std::thread> callers;
    for (int i = 0; i < 2; ++i) callers.emplace_back([&] { EXPECT_EQ(encode(person(), options).bytes, one.bytes); });
    for (auto& caller : callers) caller.join();
}

TEST(EncoderThreads, RateControlInOnePassAndTwo) {
    EncoderOptions options = test::enhanced_options();
    options.key_interval = 4;
    options.rate.bits_per_second = 8e6;
    const auto in_one_pass = expect_same_bytes(person(), options);

    options.threads = 1;
    options.skeleton = person().skeleton;
    auto first = Encoder::create(options);
    ASSERT_TRUE(first.has_value());
    std::int64_t time = 0;
    for (const auto& frame : person().frames) {
        ASSERT_TRUE(first->push(frame.mesh, &*frame.pose, time += 33333).has_value());
        options.rate.first_pass.push_back(first->last_cost());
    }
    EXPECT_NE(expect_same_bytes(person(), options).bytes, in_one_pass.bytes);
}

TEST(EncoderThreads, AGivenError) {
    EncoderOptions options = test::enhanced_options();
    options.rate.target_error = 1.5;
    expect_same_bytes(person(), options);
}

}  // namespace
}  // namespace htvm::internal
