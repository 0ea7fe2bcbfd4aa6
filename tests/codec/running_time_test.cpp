#include "htvm/running_time.hpp"

#include <gtest/gtest.h>

#include "codec/format/sequence.h"

namespace htvm::internal {
namespace {

Packet frame_at(std::int64_t timestamp_us) {
    Packet packet;
    packet.kind = PacketKind::intra;
    packet.timestamp_us = timestamp_us;
    return packet;
}

Packet header_of(std::uint32_t frames_per_second) {
    SequenceHeader header;
    header.fps_numerator = frames_per_second;
    header.skeleton.joint_names = {"a", "b"};
    header.skeleton.bones = {{0, 1}};
    header.radii = {1};
    return sequence_packet(header);
}

TEST(RunningTime, FramesLastAMeanFrameLongerThanFromTheFirstToTheLast) {
    EXPECT_DOUBLE_EQ(seconds_of_frames(1000000, 1200000, 3, 9), 0.3);
    EXPECT_DOUBLE_EQ(seconds_of_frames(1000000, 1000000, 1, 0.04), 0.04);
    EXPECT_DOUBLE_EQ(seconds_of_frames(0, 0, 0, 0.04), 0);
}

TEST(RunningTime, MissingFramesDoNotLengthenTheLastOne) {
    EXPECT_NEAR(seconds_of_frames(0, 166667, 5, 1.0 / 30), 0.2, 1e-6);  // one of six is missing
    EXPECT_DOUBLE_EQ(seconds_of_frames(0, 160000, 3, 0.04), 0.24);      // at half the rate none is
    EXPECT_DOUBLE_EQ(seconds_of_frames(0, 170000, 5, 0.04), 0.2125);    // not at the rate at all
}

TEST(RunningTime, ASequenceBeginsWhereTheOneBeforeEnds) {
    RunningTime time;
    time.push(header_of(25), false);
    EXPECT_EQ(time.one_frame_us(), 40000u);
    time.push(frame_at(500000), true);
    EXPECT_EQ(time.microseconds(), 0u);
    EXPECT_EQ(time.total_us(), 40000u);
    time.push(frame_at(600000), false);
    EXPECT_EQ(time.microseconds(), 100000u);
    EXPECT_EQ(time.total_us(), 200000u);
    // The header of the next sequence says nothing of the frames before.
    time.push(header_of(10), false);
    EXPECT_EQ(time.total_us(), 200000u);
    time.push(frame_at(0), true);
    EXPECT_EQ(time.microseconds(), 200000u);
    EXPECT_EQ(time.total_us(), 300000u);
}

TEST(RunningTime, CanBeginInTheMiddle) {
    RunningTime time;
    time.begin(500000);
    time.push(frame_at(900000), true);
    EXPECT_EQ(time.microseconds(), 400000u);
    time.push(frame_at(950000), false);
    EXPECT_EQ(time.microseconds(), 450000u);
}

}  // namespace
}  // namespace htvm::internal
