#include "io/skeleton_azure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace htvm {
namespace {

using nlohmann::json;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

// A body whose joint j is at (x, j, 1000), turned by 90 degrees about z.
json body(int id, double x) {
    json positions = json::array(), orientations = json::array();
    for (int j = 0; j < 32; ++j) {
        positions.push_back({x, j, 1000});
        orientations.push_back({0.70710678118654752, 0, 0, 0.70710678118654752});
    }
    return {{"body_id", id}, {"joint_positions", positions}, {"joint_orientations", orientations}};
}

json frame(int index, const std::vector<json>& bodies) {
    return {{"frame_id", index},
            {"num_bodies", bodies.size()},
            {"timestamp_usec", 500000 + 33333 * index},
            {"bodies", bodies}};
}

json capture(const std::vector<json>& frames) { return {{"k4abt_sdk_version", "1.1.0"}, {"frames", frames}}; }

TEST(SkeletonAzure, TheSensorHas32JointsAnd31BonesAwayFromThePelvis) {
    const auto track = skeleton_from_azure(capture({frame(0, {body(1, 5)}), frame(1, {body(1, 6)})}));
    ASSERT_TRUE(track) << track.error().message;
    EXPECT_EQ(track->skeleton.joint_names.size(), 32u);
    EXPECT_EQ(track->skeleton.bones.size(), 31u);
    EXPECT_EQ(track->skeleton.joint_names[26], "HEAD");
    std::vector<int> reached(32, 0);
    for (const Bone& bone : track->skeleton.bones) ++reached[bone.second];
    EXPECT_EQ(reached[0], 0);
    for (std::size_t j = 1; j < 32; ++j) EXPECT_EQ(reached[j], 1) << track->skeleton.joint_names[j];
    EXPECT_EQ(track->poses[1].joints[7], (Vector3d{6, 7, 1000}));
    ASSERT_EQ(track->poses[1].orientations.size(), 31u);
    const Rotation quarter = {0, -1, 0, 1, 0, 0, 0, 0, 1};
    for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(track->poses[1].orientations[3][i], quarter[i], 1e-15);
    EXPECT_NEAR(track->timestamps[1], 0.033333, 1e-12);
    EXPECT_NEAR(track->fps, 30, 0.001);
}

TEST(SkeletonAzure, BonesComeFromTheListAsNamesOrIndicesAndRunAwayFromThePelvis) {
    json document = capture({frame(0, {body(1, 0)})});
    document["joint_names"] = json::array();
    for (int j = 0; j < 32; ++j) document["joint_names"].push_back(std::string("J").append(std::to_string(j)));
    document["joint_names"][0] = "PELVIS";
    document["joint_names"][1] = "SPINE_NAVEL";
    document["bone_list"] = {{"SPINE_NAVEL", "PELVIS"}, {"J5", "J6"}, {7, 8}};
    const auto track = skeleton_from_azure(document);
    ASSERT_TRUE(track) << track.error().message;
    ASSERT_EQ(track->skeleton.bones.size(), 3u);
    EXPECT_EQ(track->skeleton.bones[0].first, 0);
    EXPECT_EQ(track->skeleton.bones[0].second, 1);
    EXPECT_EQ(track->skeleton.bones[1].first, 5);
    EXPECT_EQ(track->skeleton.bones[2].second, 8);
    document["bone_list"] = json::array({json::array({"SPINE_NAVEL", "TAIL"})});
    EXPECT_THAT(skeleton_from_azure(document).error().message,
                HasSubstr("bone_list: bone 0: no joint is named \"TAIL\""));
}

TEST(SkeletonAzure, TheBodySeenInMostFramesIsTakenAndItsAbsenceIsAMissingFrame) {
    const auto track = skeleton_from_azure(capture({frame(0, {body(1, 10)}), frame(1, {body(1, 11), body(2, 21)}),
                                                    frame(2, {}), frame(3, {body(2, 23)}), frame(4, {body(2, 24)})}));
    ASSERT_TRUE(track) << track.error().message;
    ASSERT_EQ(track->poses.size(), 5u);
    EXPECT_TRUE(track->poses[0].joints.empty());
    EXPECT_EQ(track->poses[1].joints[0][0], 21);
    EXPECT_TRUE(track->poses[2].joints.empty());
    EXPECT_EQ(track->poses[4].joints[0][0], 24);
    EXPECT_THAT(track->notes, Contains(HasSubstr("2 bodies: body 2 is taken, seen in most frames (3 of 5)")));
}

TEST(SkeletonAzure, AmongBodiesSeenEquallyOftenTheFirstSeenIsTaken) {
    const auto track =
        skeleton_from_azure(capture({frame(0, {body(9, 1), body(3, 2)}), frame(1, {body(3, 3), body(9, 4)})}));
    ASSERT_TRUE(track);
    EXPECT_EQ(track->poses[0].joints[0][0], 1);
    EXPECT_EQ(track->poses[1].joints[0][0], 4);
}

TEST(SkeletonAzure, ErrorsNameTheFrameAndTheJoint) {
    const json good = capture({frame(0, {body(1, 0)}), frame(1, {body(1, 1)})});
    json bad = good;
    bad["frames"][1]["bodies"][0]["joint_positions"][26] = {1, 2};
    EXPECT_THAT(skeleton_from_azure(bad).error().message, HasSubstr("frame 1 (the first is 0), joint 26 \"HEAD\""));
    bad = good;
    bad["frames"][1]["bodies"][0]["joint_positions"].erase(31);
    EXPECT_THAT(skeleton_from_azure(bad).error().message, HasSubstr("frame 1 (the first is 0): joint_positions"));
    bad = good;
    bad["frames"][1]["bodies"][0]["joint_orientations"][2] = {3, 0, 0, 0};
    EXPECT_THAT(skeleton_from_azure(bad).error().message,
                HasSubstr("orientation of joint 2 \"SPINE_CHEST\": is not a unit"));
    bad = good;
    bad["frames"][1] = 7;
    EXPECT_THAT(skeleton_from_azure(bad).error().message, HasSubstr("frame 1"));
    bad = good;
    bad["frames"][1]["bodies"] = 7;
    EXPECT_FALSE(skeleton_from_azure(bad));
    bad = good;
    bad["frames"][0]["bodies"][0] = 7;
    EXPECT_THAT(skeleton_from_azure(bad).error().message, HasSubstr("frame 0"));
    bad = good;
    bad.erase("frames");
    EXPECT_FALSE(skeleton_from_azure(bad));
}

TEST(SkeletonAzure, NullJointsAndZeroQuaternionsAreNotTracked) {
    json document = capture({frame(0, {body(1, 0)})});
    document["frames"][0]["bodies"][0]["joint_positions"][4] = nullptr;
    document["frames"][0]["bodies"][0]["joint_orientations"][0] = {0, 0, 0, 0};
    const auto track = skeleton_from_azure(document);
    ASSERT_TRUE(track) << track.error().message;
    EXPECT_FALSE(track->poses[0].found[4]);
    EXPECT_TRUE(track->poses[0].found[5]);
    EXPECT_EQ(track->poses[0].orientations[0], unknown_orientation);  // pelvis to navel
}

TEST(SkeletonAzure, WithoutOrientationsOrTimestampsItStillReads) {
    json document = capture({frame(0, {body(1, 0)}), frame(1, {body(1, 0)})});
    for (auto& f : document["frames"]) {
        f.erase("timestamp_usec");
        f["bodies"][0].erase("joint_orientations");
        f["bodies"][0].erase("body_id");
    }
    const auto track = skeleton_from_azure(document);
    ASSERT_TRUE(track) << track.error().message;
    EXPECT_THAT(track->timestamps, ElementsAre(0, 1 / 30.0));
    EXPECT_TRUE(track->poses[0].orientations.empty());
    EXPECT_THAT(track->notes, Contains(HasSubstr("30 fps")));
}

TEST(SkeletonAzure, TimestampsThatAreMissingOrOutOfOrderAreInterpolated) {
    json document = capture({});
    for (int t = 0; t < 8; ++t) document["frames"].push_back(frame(t, {body(1, t)}));
    auto& frames = document["frames"];
    frames[0].erase("timestamp_usec");
    frames[2]["timestamp_usec"] = frames[1]["timestamp_usec"];
    frames[3]["timestamp_usec"] = nullptr;
    frames[5]["timestamp_usec"] = 1000000000000000;
    frames[7]["timestamp_usec"] = 3;
    const auto track = skeleton_from_azure(document);
    ASSERT_TRUE(track) << track.error().message;
    for (std::size_t t = 0; t < 8; ++t) EXPECT_NEAR(track->timestamps[t], 0.033333 * static_cast<double>(t), 1e-9) << t;
    EXPECT_TRUE(track->rate_is_known);
    EXPECT_THAT(track->notes, Contains(HasSubstr("In 5 of 8 frames")));
    for (auto& f : frames) f["timestamp_usec"] = 7;
    const auto equal = skeleton_from_azure(document);
    ASSERT_TRUE(equal);
    EXPECT_FALSE(equal->rate_is_known);
    EXPECT_THAT(equal->notes, Contains(HasSubstr("30 fps")));
}

TEST(SkeletonAzure, AFrameThatIsNullIsMissing) {
    json document = capture({frame(0, {body(1, 0)}), frame(1, {body(1, 1)}), frame(2, {body(1, 2)})});
    document["frames"][1] = nullptr;
    const auto track = skeleton_from_azure(document);
    ASSERT_TRUE(track) << track.error().message;
    EXPECT_TRUE(track->poses[1].joints.empty());
    EXPECT_NEAR(track->timestamps[1], 0.033333, 1e-9);
}

TEST(SkeletonAzure, ABodyThatTheTrackerTookForANewOneIsTheSame) {
    const auto track =
        skeleton_from_azure(capture({frame(0, {body(1, 10)}), frame(1, {body(1, 11)}), frame(2, {}),
                                     frame(3, {body(2, 13), body(7, 4000)}), frame(4, {body(7, 4001)})}));
    ASSERT_TRUE(track) << track.error().message;
    EXPECT_EQ(track->poses[3].joints[0][0], 13);
    EXPECT_TRUE(track->poses[4].joints.empty()) << "somebody else";
    EXPECT_THAT(track->notes, Contains(HasSubstr("a tracker that lost it: 2.")));
}

TEST(SkeletonAzure, MembersAndJointsMayBeWrittenOtherwise) {
    json document = capture({frame(0, {body(1, 5)}), frame(1, {body(1, 6)})});
    const auto expected = skeleton_from_azure(document);
    json other = {{"JointNames", json::array()}, {"Frames", json::array()}};
    for (const auto& name : expected->skeleton.joint_names) other["JointNames"].push_back("K4ABT_JOINT_" + name);
    for (const auto& f : document["frames"]) {
        json positions = json::array();
        for (const auto& p : f["bodies"][0]["joint_positions"])
            positions.push_back({{"X", p[0]}, {"Y", p[1]}, {"Z", p[2]}});
        const json person = {{"bodyId", 1}, {"JointPositions", positions}};
        other["Frames"].push_back({{"timestampUsec", f["timestamp_usec"]}, {"Bodies", json::array({person})}});
    }
    const auto track = parse_skeleton_azure("\xEF\xBB\xBF" + other.dump());
    ASSERT_TRUE(track) << track.error().message;
    EXPECT_TRUE(looks_like_azure(other));
    EXPECT_EQ(track->skeleton.bones.size(), 31u);
    EXPECT_EQ(track->poses[1].joints, expected->poses[1].joints);
    EXPECT_EQ(track->timestamps, expected->timestamps);
}

TEST(SkeletonAzure, BodiesMayHaveFewerJoints) {
    json document = capture({frame(0, {body(1, 5)})});
    auto& positions = document["frames"][0]["bodies"][0]["joint_positions"];
    document["frames"][0]["bodies"][0].erase("joint_orientations");
    for (int j = 0; j < 6; ++j) positions.erase(positions.size() - 1);
    const auto early = skeleton_from_azure(document);
    ASSERT_TRUE(early) << early.error().message;
    EXPECT_EQ(early->skeleton.joint_names.size(), 26u);
    EXPECT_EQ(early->skeleton.joint_names[8], "CLAVICLE_RIGHT");
    EXPECT_EQ(early->skeleton.joint_names[20], "HEAD");
    EXPECT_EQ(early->skeleton.bones.size(), 25u);
    document["joint_names"] = {"PELVIS", "SPINE_NAVEL", "SPINE_CHEST", "NECK", "HEAD"};
    document["bone_list"] = json::array();
    for (const std::size_t end : {1u, 2u, 4u}) document["bone_list"].push_back(json::array({end - 1, end}));
    while (positions.size() > 4) positions.erase(positions.size() - 1);
    const auto named = skeleton_from_azure(document);
    ASSERT_TRUE(named) << named.error().message;
    EXPECT_EQ(named->skeleton.joint_names.size(), 4u);
    EXPECT_EQ(named->skeleton.bones.size(), 2u);
}

TEST(SkeletonAzure, NaNIsNotTracked) {
    const auto track =
        parse_skeleton_azure(R"({"joint_names": ["PELVIS", "SPINE_NAVEL"], "frames": [{"timestamp_usec": 1,
        "bodies": [{"body_id": 1, "joint_positions": [[NaN, 1, -Infinity], [1, 2, 3]],
                    "joint_orientations": [[nan, 0, 0, 0], [1, 0, 0, 0]]}]}]})");
    ASSERT_TRUE(track) << track.error().message;
    EXPECT_THAT(track->poses[0].found, ElementsAre(false, true));
    EXPECT_EQ(track->poses[0].orientations[0], unknown_orientation);
    EXPECT_FALSE(parse_skeleton_azure(R"({"frames": [never]})"));
}

TEST(SkeletonAzure, ATextThatIsCutAnywhereIsAnError) {
    json small = body(1, 0);
    small["joint_positions"] = {{1, 2, 3}, {4, 5, 6}};
    small["joint_orientations"] = {{1, 0, 0, 0}, {1, 0, 0, 0}};
    json document = capture({frame(0, {small})});
    document["joint_names"] = {"PELVIS", "SPINE_NAVEL"};
    const std::string text = document.dump();
    ASSERT_TRUE(parse_skeleton_azure(text)) << parse_skeleton_azure(text).error().message;
    for (std::size_t size = 0; size < text.size(); ++size)
        EXPECT_FALSE(parse_skeleton_azure(text.substr(0, size))) << size;
    for (std::size_t i = 0; i < text.size(); ++i)
        for (const char byte : {'\0', '0', '-', 'e', '"', '[', ']', '{', ',', '\xff'}) {
            std::string changed = text;
            changed[i] = byte;
            const auto track = parse_skeleton_azure(changed);
            if (track) {
                EXPECT_EQ(track->timestamps.size(), track->poses.size());
            }
        }
}

}  // namespace
}  // namespace htvm
