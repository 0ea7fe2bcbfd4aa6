// The same input and options give the same bytes for any number of threads: every kind of frame, every way to choose
// them, rate control in one pass and two, with and without skeleton.
#include <gtest/gtest.h>

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
    EncoderOptions options = default_options(Profile::topology);
    options.key_interval = 3;
    expect_same_bytes(person(), options);
    expect_same_bytes(without_skeleton(), options);
}

TEST(EncoderThreads, ThePapersChoices) {
    EncoderOptions options = default_options(Profile::topology);
    options.topology.weight_width = 0;
    options.topology.reference_vertices = ReferenceVertices::bone;
    options.topology.point_to_plane = false;
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
    EncoderOptions options = default_options(Profile::topology);
    options.profile = Profile::tracked;
    const auto coded = expect_same_bytes(walking(4, 6000, 20), options);
    EXPECT_GE(frames_of(coded, FrameType::tracked), 2u);
    options.tracked.references = TrackedReferences::intra;
    expect_same_bytes(without_skeleton(), options);
}

TEST(EncoderThreads, FramesChosenByRateAndDistortion) {
    EncoderOptions options = default_options(Profile::topology);
    options.topology.frame_choice = FrameChoice::rate_distortion;
    options.topology.still_below = 40;
    options.profile = Profile::tracked;
    expect_same_bytes(walking(4, 6000, 20), options);
}

TEST(EncoderThreads, RateControlInOnePassAndTwo) {
    EncoderOptions options = default_options(Profile::topology);
    options.key_interval = 4;
    options.rate.bits_per_second = 8e6;
    expect_same_bytes(person(), options);

    options.threads = 1;
    options.skeleton = person().skeleton;
    auto first = Encoder::create(options);
    ASSERT_TRUE(first.has_value());
    std::int64_t time = 0;
    for (const auto& frame : person().frames) {
        ASSERT_TRUE(first->push(frame.mesh, &*frame.pose, time += 33333).has_value());
        options.rate.first_pass.push_back(first->last_cost());
    }
    expect_same_bytes(person(), options);
}

TEST(EncoderThreads, AGivenError) {
    EncoderOptions options = default_options(Profile::topology);
    options.rate.target_error = 1.5;
    expect_same_bytes(person(), options);
}

}  // namespace
}  // namespace htvm::internal
