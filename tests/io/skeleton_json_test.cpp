#include "io/skeleton_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace htvm {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const std::string leg =
    R"({"units": "cm", "fps": 25, "joints": ["hip", "knee", "foot"], "bones": [[0, 1], ["knee", "foot"]],
 "frames": [[[0, 90, 0], [0, 48, 2], null], null, [[1, 90, 0], [1, 48, 2], [1, 8.5, 0]]],
 "orientations": [[[[1,0,0],[0,1,0],[0,0,1]], null], null, [[0,-1,0, 1,0,0, 0,0,1], null]],
 "radii": [80, 60.5]})";

std::string with(std::string text, const std::string& from, const std::string& to) {
    const auto found = text.find(from);
    EXPECT_NE(found, std::string::npos) << from;
    return text.replace(found, from.size(), to);
}

std::string error_of(const std::string& text) {
    const auto track = parse_skeleton_json(text);
    return track ? "no error" : track.error().message;
}

TEST(SkeletonJson, EveryMemberIsReadAndPositionsBecomeMillimetres) {
    const auto track = parse_skeleton_json(leg);
    ASSERT_TRUE(track) << track.error().message;
    EXPECT_THAT(track->skeleton.joint_names, ElementsAre("hip", "knee", "foot"));
    ASSERT_EQ(track->skeleton.bones.size(), 2u);
    EXPECT_EQ(track->skeleton.bones[1].first, 1);
    EXPECT_EQ(track->skeleton.bones[1].second, 2);
    EXPECT_EQ(track->fps, 25);
    EXPECT_THAT(track->timestamps, ElementsAre(0, 1 / 25.0, 2 / 25.0));
    EXPECT_THAT(track->radii, ElementsAre(80, 60.5));
    ASSERT_EQ(track->poses.size(), 3u);
    EXPECT_EQ(track->poses[0].joints[1], (Vector3d{0, 480, 20}));
    EXPECT_THAT(track->poses[0].found, ElementsAre(true, true, false));
    EXPECT_TRUE(track->poses[1].joints.empty());
    EXPECT_EQ(track->poses[2].joints[2], (Vector3d{10, 85, 0}));
    EXPECT_EQ(track->poses[2].orientations[0], (Rotation{0, -1, 0, 1, 0, 0, 0, 0, 1}));
    EXPECT_EQ(track->poses[2].orientations[1], unknown_orientation);
    EXPECT_TRUE(track->notes.empty());
}

TEST(SkeletonJson, UnitsAreMillimetresCentimetresOrMetres) {
    const auto x = [](const std::string& text) { return parse_skeleton_json(text)->poses[2].joints[0][0]; };
    EXPECT_EQ(x(with(leg, "\"cm\"", "\"mm\"")), 1);
    EXPECT_EQ(x(leg), 10);
    EXPECT_EQ(x(with(leg, "\"cm\"", "\"m\"")), 1000);
    EXPECT_THAT(error_of(with(leg, "\"cm\"", "\"inch\"")), HasSubstr("units"));
    const auto silent = parse_skeleton_json(with(leg, "\"units\": \"cm\", ", ""));
    ASSERT_TRUE(silent);
    EXPECT_EQ(silent->poses[2].joints[0][0], 1);
    EXPECT_THAT(silent->notes, ElementsAre(HasSubstr("mm")));
}

TEST(SkeletonJson, TimestampsTellTheRateAndMustIncrease) {
    const auto timed = parse_skeleton_json(with(leg, "\"fps\": 25", "\"timestamps\": [1, 1.5, 2]"));
    ASSERT_TRUE(timed) << timed.error().message;
    EXPECT_THAT(timed->timestamps, ElementsAre(1, 1.5, 2));
    EXPECT_EQ(timed->fps, 2);
    EXPECT_THAT(error_of(with(leg, "\"fps\": 25", "\"timestamps\": [1, 2]")), HasSubstr("3 frames"));
    EXPECT_THAT(error_of(with(leg, "\"fps\": 25", "\"timestamps\": [1, 2, 2]")), HasSubstr("frame 2"));
    EXPECT_THAT(error_of(with(leg, "\"fps\": 25", "\"timestamps\": [1, \"x\", 2]")), HasSubstr("frame 1"));
    EXPECT_THAT(error_of(with(leg, "\"fps\": 25", "\"fps\": 0")), HasSubstr("fps"));
    const auto untimed = parse_skeleton_json(with(leg, "\"fps\": 25, ", ""));
    ASSERT_TRUE(untimed);
    EXPECT_EQ(untimed->fps, 30);
    EXPECT_EQ(untimed->notes.size(), 1u);
}

TEST(SkeletonJson, ErrorsNameTheFrameAndTheJoint) {
    EXPECT_THAT(error_of(with(leg, "[1, 8.5, 0]", "[1, 8.5]")),
                HasSubstr("frame 2 (the first is 0), joint 2 \"foot\""));
    EXPECT_THAT(error_of(with(leg, "[1, 8.5, 0]", "[1, \"a\", 0]")), HasSubstr("joint 2 \"foot\""));
    EXPECT_THAT(error_of(with(leg, "[1, 8.5, 0]", "[1, 1e300, 0]")), HasSubstr("1000 km"));
    EXPECT_THAT(error_of(with(leg, ", [1, 8.5, 0]", "")),
                HasSubstr("frame 2 (the first is 0): must be null or a list of 3"));
    EXPECT_THAT(error_of(with(leg, "null, [[1, 90", "7, [[1, 90")), HasSubstr("frame 1"));
    EXPECT_THAT(error_of(with(leg, "[0,-1,0, 1,0,0, 0,0,1]", "[0,-1,0, 1,0,0, 0,0,-1]")),
                HasSubstr("orientations, frame 2 (the first is 0), bone 0: is not a rotation"));
    EXPECT_THAT(error_of(with(leg, "[0,-1,0, 1,0,0, 0,0,1]", "[0,-1,0]")), HasSubstr("3x3"));
}

TEST(SkeletonJson, CountsAndIndicesAreChecked) {
    EXPECT_THAT(error_of(with(leg, "[0, 1]", "[0, 3]")), HasSubstr("bone 0: joint 3"));
    EXPECT_THAT(error_of(with(leg, "[0, 1]", "[0, -1]")), HasSubstr("bone 0: joint -1"));
    EXPECT_THAT(error_of(with(leg, "[0, 1]", "[0, 1.5]")), HasSubstr("index or a name"));
    EXPECT_THAT(error_of(with(leg, "[0, 1]", "[1, 1]")), HasSubstr("to itself"));
    EXPECT_THAT(error_of(with(leg, "\"knee\", \"foot\"]]", "\"knee\", \"toe\"]]")), HasSubstr("\"toe\""));
    EXPECT_THAT(error_of(with(leg, "[80, 60.5]", "[80]")), HasSubstr("radii"));
    EXPECT_THAT(error_of(with(leg, "[80, 60.5]", "[80, -1]")), HasSubstr("bone 1"));
    EXPECT_THAT(error_of(with(leg, "\"bones\"", "\"limbs\"")), HasSubstr("no \"bones\""));
    EXPECT_THAT(error_of(with(leg, "[\"hip\", \"knee\", \"foot\"]", "[]")), HasSubstr("joints"));
    EXPECT_THAT(error_of("[]"), HasSubstr("no \"joints\""));
    EXPECT_THAT(error_of("7"), HasSubstr("no \"joints\""));
    std::string many = "[\"a\"";
    for (std::size_t j = 0; j < max_skeleton_joints; ++j) many += ",\"a\"";
    const auto track = parse_skeleton_json(with(leg, "[\"hip\", \"knee\", \"foot\"]", many + "]"));
    ASSERT_FALSE(track);
    EXPECT_EQ(track.error().kind, ErrorKind::limit);
}

TEST(SkeletonJson, ARotationThatIsRoundedIsMadeExact) {
    const auto track = parse_skeleton_json(with(leg, "[0,-1,0, 1,0,0, 0,0,1]", "[0.866,-0.5,0, 0.5,0.866,0, 0,0,1]"));
    ASSERT_TRUE(track);
    const Rotation& r = track->poses[2].orientations[0];
    EXPECT_NEAR(r[0] * r[0] + r[1] * r[1], 1, 1e-15);
}

TEST(SkeletonJson, WhatIsWrittenReadsBackBitForBit) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> uniform(-2000, 2000);
    for (int round = 0; round < 50; ++round) {
        SkeletonTrack track;
        track.skeleton.joint_names = {"a", "b \"quoted\"", "c\n", "ä"};
        track.skeleton.bones = {{0, 1}, {3, 2}};
        track.fps = round % 2 ? 29.97 : 30;
        if (round % 3 == 0) track.radii = {uniform(random) + 2000, 0};
        for (std::size_t t = 0; t < random() % 6; ++t) {
            Pose pose;
            for (int j = 0; j < 4 && (round < 10 || random() % 4); ++j) {
                pose.found.push_back(random() % 3 > 0);
                pose.joints.push_back({uniform(random), uniform(random), uniform(random)});
                if (!pose.found.back()) pose.joints.back() = {};
            }
            if (pose.joints.size() < 4) pose = Pose{};
            if (!pose.joints.empty() && round % 2)
                pose.orientations = {{0, -1, 0, 1, 0, 0, 0, 0, 1}, unknown_orientation};
            track.poses.push_back(pose);
            track.timestamps.push_back(static_cast<double>(t) / track.fps + (round % 5 == 0 ? 0.01 : 0));
        }
        const auto text = format_skeleton_json(track);
        ASSERT_TRUE(text) << text.error().message;
        const auto back = parse_skeleton_json(*text);
        ASSERT_TRUE(back) << back.error().message << "\n" << *text;
        EXPECT_EQ(back->skeleton.joint_names, track.skeleton.joint_names);
        EXPECT_EQ(back->timestamps, track.timestamps);
        EXPECT_EQ(back->fps, track.fps);
        EXPECT_EQ(back->radii, track.radii);
        ASSERT_EQ(back->poses.size(), track.poses.size());
        for (std::size_t t = 0; t < track.poses.size(); ++t) {
            EXPECT_EQ(back->poses[t].joints, track.poses[t].joints);
            EXPECT_EQ(back->poses[t].found, track.poses[t].found);
            EXPECT_EQ(back->poses[t].orientations, track.poses[t].orientations);
        }
    }
}

TEST(SkeletonJson, WhatCannotBeReadBackIsNotWritten) {
    auto track = *parse_skeleton_json(leg);
    EXPECT_TRUE(format_skeleton_json(track));
    auto broken = track;
    broken.timestamps.pop_back();
    EXPECT_FALSE(format_skeleton_json(broken));
    broken = track;
    broken.timestamps[2] = 0;
    EXPECT_FALSE(format_skeleton_json(broken));
    broken = track;
    broken.poses[0].joints.pop_back();
    EXPECT_FALSE(format_skeleton_json(broken));
    broken = track;
    broken.poses[0].joints[0][0] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THAT(format_skeleton_json(broken).error().message, HasSubstr("\"hip\""));
    broken = track;
    broken.radii.push_back(1);
    EXPECT_FALSE(format_skeleton_json(broken));
}

TEST(SkeletonJson, ATextThatIsCutAnywhereIsAnError) {
    const auto last = leg.find_last_of('}');
    for (std::size_t size = 0; size <= last; ++size) EXPECT_FALSE(parse_skeleton_json(leg.substr(0, size))) << size;
    EXPECT_THAT(error_of(leg.substr(0, 40)), HasSubstr("byte"));
}

TEST(SkeletonJson, AnyByteChangedGivesATrackOrAnError) {
    for (std::size_t i = 0; i < leg.size(); ++i)
        for (const char byte : {'\0', '0', '9', '-', 'e', '"', '[', ']', '{', ',', 'n', '\xff'}) {
            std::string text = leg;
            text[i] = byte;
            const auto track = parse_skeleton_json(text);
            if (track) {
                EXPECT_EQ(track->timestamps.size(), track->poses.size());
            } else {
                EXPECT_FALSE(track.error().message.empty());
            }
        }
}

TEST(SkeletonJson, DeepNestingAndHugeNumbersAreErrors) {
    EXPECT_FALSE(parse_skeleton_json(std::string(200000, '[')));
    EXPECT_FALSE(parse_skeleton_json(
        with(leg, "null, [[1, 90", std::string(100000, '[') + std::string(100000, ']') + ", [[1, 90")));
    EXPECT_THAT(error_of(with(leg, "8.5", "1e999")), HasSubstr("number"));
    EXPECT_FALSE(parse_skeleton_json(with(leg, "[0, 1]", "[0, 99999999999999999999999]")));
    EXPECT_FALSE(parse_skeleton_json(with(leg, "[0, 1]", "[0, 18446744073709551615]")));
}

}  // namespace
}  // namespace htvm
