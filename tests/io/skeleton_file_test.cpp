#include "io/skeleton_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>

namespace htvm {
namespace {

using testing::HasSubstr;

const char* const ours = R"({"units":"m","fps":30,"joints":["a","b"],"bones":[[0,1]],"frames":[[[0,0,0],[0,1,0]]]})";
const char* const azure = R"({"joint_names":["a","b"],"bone_list":[["a","b"]],"frames":[{"timestamp_usec":7,"bodies":
    [{"body_id":1,"joint_positions":[[0,0,0],[0,1000,0]]}]}]})";
const char* const bvh = R"(HIERARCHY
ROOT a
{
  OFFSET 0 0 0
  CHANNELS 3 Xrotation Yrotation Zrotation
  End Site { OFFSET 0 100 0 }
}
MOTION
Frames: 1
Frame Time: 0.03333
0 0 0
)";

TEST(SkeletonFile, TheFormatIsToldByTheContent) {
    for (const char* text : {ours, azure, bvh})
        for (const std::string start : {"", "\xEF\xBB\xBF", " \n"}) {
            const auto track = parse_skeleton(start + text);
            ASSERT_TRUE(track) << track.error().message << "\n" << text;
            ASSERT_EQ(track->poses.size(), 1u);
            EXPECT_EQ(track->poses[0].joints[1], (Vector3d{0, 1000, 0}));
        }
    std::string commented = "# recorded\r\n// today\n";
    commented += bvh;
    EXPECT_TRUE(parse_skeleton(commented));
    EXPECT_FALSE(parse_skeleton(""));
    EXPECT_FALSE(parse_skeleton(" \n\t "));
    EXPECT_FALSE(parse_skeleton("\x89PNG"));
    EXPECT_FALSE(parse_skeleton("{}"));
    EXPECT_FALSE(parse_skeleton("hello"));
}

TEST(SkeletonFile, WhatIsWrittenReadsBack) {
    const std::string path = testing::TempDir() + "htvm_skeleton_file_test.json";
    const auto track = parse_skeleton(bvh);
    ASSERT_TRUE(write_skeleton(path, *track));
    const auto back = read_skeleton(path);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->poses[0].joints, track->poses[0].joints);
    EXPECT_EQ(back->poses[0].orientations, track->poses[0].orientations);
    EXPECT_EQ(back->skeleton.joint_names, track->skeleton.joint_names);
    SkeletonReadOptions small;
    small.max_bytes = 10;
    ASSERT_FALSE(read_skeleton(path, small));
    EXPECT_EQ(read_skeleton(path, small).error().kind, ErrorKind::limit);
    std::remove(path.c_str());
}

TEST(SkeletonFile, ErrorsStartWithThePath) {
    const auto absent = read_skeleton("/no/such/skeleton.bvh");
    ASSERT_FALSE(absent);
    EXPECT_THAT(absent.error().message, HasSubstr("/no/such/skeleton.bvh: cannot be opened"));
    EXPECT_FALSE(read_skeleton(testing::TempDir()));
    EXPECT_FALSE(write_skeleton("/no/such/folder/skeleton.json", *parse_skeleton(ours)));
}

}  // namespace
}  // namespace htvm
