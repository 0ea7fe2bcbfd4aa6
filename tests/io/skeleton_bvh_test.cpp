#include "io/skeleton_bvh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace htvm {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

// An arm along +x in centimetres: shoulder, elbow at 30, hand at 55.
const std::string arm = R"(HIERARCHY
ROOT Shoulder
{
	OFFSET 0.0 0.0 0.0
	CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
	JOINT Elbow
	{
		OFFSET 30 0 0
		CHANNELS 3 Zrotation Xrotation Yrotation
		End Site
		{
			OFFSET 25 0 0
		}
	}
}
MOTION
Frames: 3
Frame Time: 0.025
0 140 0 0 0 0 0 0 0
0 140 0 90 0 0 0 0 0
1 140 +2 0 0 90 90 0 0
)";

std::string with(std::string text, const std::string& from, const std::string& to) {
    const auto found = text.find(from);
    EXPECT_NE(found, std::string::npos) << from;
    return text.replace(found, from.size(), to);
}

std::string error_of(const std::string& text) {
    const auto track = parse_skeleton_bvh(text);
    return track ? "no error" : track.error().message;
}

void expect_vector(const Vector3d& a, const Vector3d& b) {
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], 1e-9) << "component " << i;
}

void expect_same(const Rotation& a, const Rotation& b) {
    for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(a[i], b[i], 1e-12) << "element " << i;
}

TEST(SkeletonBvh, ForwardKinematicsGivesJointsInMillimetres) {
    const auto track = parse_skeleton_bvh(arm);
    ASSERT_TRUE(track) << track.error().message;
    EXPECT_THAT(track->skeleton.joint_names, ElementsAre("Shoulder", "Elbow", "Elbow end"));
    ASSERT_EQ(track->skeleton.bones.size(), 2u);
    EXPECT_EQ(track->skeleton.bones[0].first, 0);
    EXPECT_EQ(track->skeleton.bones[0].second, 1);
    EXPECT_EQ(track->skeleton.bones[1].first, 1);
    EXPECT_EQ(track->skeleton.bones[1].second, 2);
    EXPECT_DOUBLE_EQ(track->fps, 40);
    EXPECT_THAT(track->timestamps, ElementsAre(0, 0.025, 0.05));
    ASSERT_EQ(track->poses.size(), 3u);
    const auto& rest = track->poses[0].joints;
    expect_vector(rest[0], {0, 1400, 0});
    expect_vector(rest[1], {300, 1400, 0});
    expect_vector(rest[2], {550, 1400, 0});
    const auto& up = track->poses[1].joints;
    expect_vector(up[1], {0, 1700, 0});
    expect_vector(up[2], {0, 1950, 0});
    // Rotating by 90 degrees about y takes x to -z; the elbow then turns the forearm up.
    const auto& bent = track->poses[2].joints;
    expect_vector(bent[0], {10, 1400, 20});
    expect_vector(bent[1], {10, 1400, -280});
    expect_vector(bent[2], {10, 1650, -280});
    EXPECT_THAT(track->poses[2].found, ElementsAre(true, true, true));
}

TEST(SkeletonBvh, ABoneIsOrientedAsItsFirstJoint) {
    const auto track = parse_skeleton_bvh(arm);
    ASSERT_TRUE(track);
    expect_same(track->poses[0].orientations[0], {1, 0, 0, 0, 1, 0, 0, 0, 1});
    expect_same(track->poses[1].orientations[0], {0, -1, 0, 1, 0, 0, 0, 0, 1});
    expect_same(track->poses[1].orientations[1], {0, -1, 0, 1, 0, 0, 0, 0, 1});
    expect_same(track->poses[2].orientations[0], {0, 0, 1, 0, 1, 0, -1, 0, 0});
}

TEST(SkeletonBvh, RotationsApplyInTheOrderOfTheChannels) {
    const std::string turned = with(arm, "0 140 0 0 0 0 0 0 0", "0 140 0 90 0 90 0 0 0");
    // Z then Y: R = Rz Ry takes x to Rz(-z) = -z. Y then Z: R = Ry Rz takes x to Ry(y) = y.
    expect_vector(parse_skeleton_bvh(turned)->poses[0].joints[1], {0, 1400, -300});
    const auto other = with(turned, "Zrotation Xrotation Yrotation\n\tJOINT", "Yrotation Xrotation Zrotation\n\tJOINT");
    expect_vector(parse_skeleton_bvh(other)->poses[0].joints[1], {0, 1700, 0});
}

TEST(SkeletonBvh, ChannelsMayComeInAnyOrderAndCase) {
    auto text = with(arm, "Xposition Yposition Zposition Zrotation Xrotation Yrotation",
                     "zROTATION YPOSITION Xrotation xposition Yrotation Zposition");
    text = with(text, "0 140 0 90 0 0 0 0 0", "90 140 0 5 0 6 0 0 0");
    text = with(text, "0 140 0 0 0 0 0 0 0", "0 140 0 0 0 0 0 0 0");
    const auto track = parse_skeleton_bvh(text);
    ASSERT_TRUE(track) << track.error().message;
    expect_vector(track->poses[1].joints[0], {50, 1400, 60});
    expect_vector(track->poses[1].joints[1], {50, 1700, 60});
}

TEST(SkeletonBvh, OffsetAndChannelsMayComeInEitherOrder) {
    auto text = with(arm, "\t\tOFFSET 30 0 0\n\t\tCHANNELS 3 Zrotation Xrotation Yrotation\n",
                     "\t\tCHANNELS 3 Zrotation Xrotation Yrotation\n\t\tOFFSET 30 0 0\n");
    ASSERT_TRUE(parse_skeleton_bvh(text));
    expect_vector(parse_skeleton_bvh(text)->poses[1].joints[2], {0, 1950, 0});
}

TEST(SkeletonBvh, TheUnitIsGuessedFromTheHeightAndSaid) {
    const auto x = [](const Result<SkeletonTrack>& track) { return track->poses[0].joints[2][0]; };
    const auto centimetres = parse_skeleton_bvh(arm);
    EXPECT_DOUBLE_EQ(x(centimetres), 550);
    EXPECT_THAT(centimetres->notes, ElementsAre(HasSubstr("centimetres")));
    const auto metres = parse_skeleton_bvh(with(with(arm, "OFFSET 30", "OFFSET .30"), "OFFSET 25", "OFFSET 0.25"));
    EXPECT_DOUBLE_EQ(x(metres), 550);
    EXPECT_THAT(metres->notes, ElementsAre(HasSubstr("metres")));
    const auto millimetres =
        parse_skeleton_bvh(with(with(arm, "OFFSET 30", "OFFSET 400"), "OFFSET 25", "OFFSET 2.5e2"));
    EXPECT_DOUBLE_EQ(x(millimetres), 650);
    EXPECT_THAT(millimetres->notes, ElementsAre(HasSubstr("millimetres")));
    const auto inches = parse_skeleton_bvh(arm, {.mm_per_unit = 25.4});
    EXPECT_DOUBLE_EQ(x(inches), 55 * 25.4);
    EXPECT_TRUE(inches->notes.empty());
    EXPECT_FALSE(parse_skeleton_bvh(arm, {.mm_per_unit = -1}));
}

TEST(SkeletonBvh, PositionChannelsThatRepeatTheOffsetStandInItsPlace) {
    auto text = with(arm, "CHANNELS 3 Zrotation", "CHANNELS 6 Xposition Yposition Zposition Zrotation");
    text = text.substr(0, text.find("Frames:")) + "Frames: 2\nFrame Time: 0.1\n";
    const auto repeated = parse_skeleton_bvh(text + "0 0 0 0 0 0 30 0 0 0 0 0\n0 0 0 0 0 0 31 0 0 0 0 0\n");
    ASSERT_TRUE(repeated) << repeated.error().message;
    EXPECT_DOUBLE_EQ(repeated->poses[0].joints[1][0], 300);
    EXPECT_DOUBLE_EQ(repeated->poses[1].joints[1][0], 310);
    EXPECT_THAT(repeated->notes, Contains(HasSubstr("\"Elbow\": position channels taken in place of")));
    const auto added = parse_skeleton_bvh(text + "0 0 0 0 0 0 0 0 0 0 0 0\n0 0 0 0 0 0 1 0 0 0 0 0\n");
    ASSERT_TRUE(added);
    EXPECT_DOUBLE_EQ(added->poses[0].joints[1][0], 300);
    EXPECT_DOUBLE_EQ(added->poses[1].joints[1][0], 310);
    EXPECT_THAT(added->notes, Contains(HasSubstr("on top of")));
}

TEST(SkeletonBvh, AsManyFramesAreTakenAsAreThere) {
    const auto frames = [](const std::string& text) {
        const auto track = parse_skeleton_bvh(text);
        EXPECT_TRUE(track) << track.error().message;
        return track ? track->poses.size() : 0;
    };
    const auto notes = [](const std::string& text) { return parse_skeleton_bvh(text)->notes; };
    EXPECT_EQ(frames(arm), 3u);
    EXPECT_THAT(notes(arm), Not(Contains(HasSubstr("declares"))));
    for (const char* declared : {"Frames: 2", "Frames: 4", "Frames: 0", "Frames: 18446744073709551615"}) {
        EXPECT_EQ(frames(with(arm, "Frames: 3", declared)), 3u) << declared;
        EXPECT_THAT(notes(with(arm, "Frames: 3", declared)), Contains(HasSubstr("holds 3: these are taken")));
    }
    const auto cut = with(arm, "1 140 +2 0 0 90 90 0 0\n", "1 140 +2 0 0 90 90");
    EXPECT_EQ(frames(cut), 2u);
    EXPECT_THAT(notes(cut), Contains(HasSubstr("declares 3 frames and holds 2 and a part of another")));
    EXPECT_EQ(frames(arm + "1 2 3\n"), 3u);
    EXPECT_EQ(frames(arm + "END OF FILE\n"), 3u);
    EXPECT_THAT(notes(arm + "END OF FILE\n"), Contains(HasSubstr("the rest is ignored")));
    EXPECT_THAT(error_of(arm.substr(0, arm.find("0 140"))), HasSubstr("line 19: there is no frame of motion"));
}

TEST(SkeletonBvh, AFrameWithAValueThatIsNoNumberIsMissing) {
    for (const char* word : {"nan", "NaN", "-nan(ind)", "-1.#IND00", "1.#QNAN", "inf"}) {
        const auto track = parse_skeleton_bvh(with(arm, "0 140 0 90", std::string("0 ") + word + " 0 90"));
        ASSERT_TRUE(track) << track.error().message;
        ASSERT_EQ(track->poses.size(), 3u);
        EXPECT_FALSE(track->poses[0].joints.empty());
        EXPECT_TRUE(track->poses[1].joints.empty());
        EXPECT_THAT(track->notes, Contains(HasSubstr("In 1 of 3 frames of the BVH file, the first of them frame 1")));
    }
    EXPECT_THAT(error_of(with(arm, "1 140 +2", "1 x +2")),
                HasSubstr("frame 2 (the first is 0), channel 1 of joint \"Shoulder\": \"x\" is not a number"));
    EXPECT_THAT(error_of(arm.substr(0, arm.find("0 140")) + "nan 0 0 0 0 0 0 0 0\n"),
                HasSubstr("no frame has numbers"));
}

TEST(SkeletonBvh, KeywordsAndNumbersAreReadAsProgramsWriteThem) {
    const auto expected = parse_skeleton_bvh(arm);
    const auto in_file = [](std::string text, const std::string& from, const std::string& to) {
        for (auto at = text.find(from); at != text.npos; at = text.find(from, at + to.size()))
            text.replace(at, from.size(), to);
        return text;
    };
    const std::string motion = arm.substr(0, arm.find("0 140"));
    const std::string commas = motion + "0,0 140,0 0 0 0 0 0 0 0\n0 140 0 90,0 0 0 0 0 0\n1 140 +2 0 0 90 90 0 0,0\n";
    for (const std::string& text :
         {in_file(arm, "\n", "\r\n"), in_file(arm, "\n", "\r"), "\xEF\xBB\xBF" + arm,
          with(arm, "Frames: 3", "Frames:3"), with(arm, "Frame Time: 0.025", "Frame Time:0.025"),
          with(arm, "Frame Time: 0.025", "FrameTime :\t2.5e-2"), with(arm, "Frame Time: 0.025", "frame time: 0,025"),
          with(arm, "Frames: 3", "FRAMES\t3"), with(arm, "HIERARCHY", "# exported\nHierarchy // of an arm"),
          with(arm, "End Site", "End Site Hand"), commas,
          with(arm, "0 140 0 0 0 0 0 0 0", "0.0, 140.0, 0.0, 0, 0, 0, 0, 0, 0"),
          with(arm, "OFFSET 25 0 0", "OFFSET 25 0 0 CHANNELS 0")}) {
        const auto track = parse_skeleton_bvh(text);
        ASSERT_TRUE(track) << track.error().message << "\n" << text;
        EXPECT_DOUBLE_EQ(track->fps, 40);
        ASSERT_EQ(track->poses.size(), 3u) << text;
        for (std::size_t t = 0; t < 3; ++t) EXPECT_EQ(track->poses[t].joints, expected->poses[t].joints) << text;
    }
    EXPECT_THAT(error_of(in_file(with(arm, "OFFSET 30", "OFFSET x"), "\n", "\r")), HasSubstr("line 8:"));
    const auto named = parse_skeleton_bvh(with(arm, "ROOT Shoulder", "ROOT mixamorig:Left Shoulder \t"));
    ASSERT_TRUE(named);
    EXPECT_EQ(named->skeleton.joint_names[0], "mixamorig:Left Shoulder");
}

TEST(SkeletonBvh, AnEndSiteWithoutOffsetIsLeftOut) {
    const auto track = parse_skeleton_bvh(with(arm, "OFFSET 25 0 0", ""));
    ASSERT_TRUE(track) << track.error().message;
    EXPECT_THAT(track->skeleton.joint_names, ElementsAre("Shoulder", "Elbow"));
    EXPECT_EQ(track->skeleton.bones.size(), 1u);
}

TEST(SkeletonBvh, ARateThatIsNotSaidIsNotKnown) {
    for (const char* time : {"0", "0.0", "nan"}) {
        const auto track = parse_skeleton_bvh(with(arm, "Frame Time: 0.025", std::string("Frame Time: ") + time));
        ASSERT_TRUE(track) << track.error().message;
        EXPECT_FALSE(track->rate_is_known);
        EXPECT_DOUBLE_EQ(track->fps, 30);
        EXPECT_THAT(track->notes, Contains(HasSubstr("does not say its rate")));
    }
    EXPECT_TRUE(parse_skeleton_bvh(arm)->rate_is_known);
    EXPECT_THAT(error_of(with(arm, "Frame Time: 0.025", "Frame Time: soon")), HasSubstr("Frame Time"));
    EXPECT_THAT(error_of(with(arm, "Frame Time: 0.025", "Frame Time: -1")), HasSubstr("Frame Time"));
}

TEST(SkeletonBvh, ARoundedFrameTimeIsThatOfTheUsualRate) {
    const auto fps = [](const char* time) {
        return parse_skeleton_bvh(with(arm, "Frame Time: 0.025", std::string("Frame Time: ") + time))->fps;
    };
    EXPECT_DOUBLE_EQ(fps("0.033"), 30);
    EXPECT_DOUBLE_EQ(fps("0.0333333"), 30);
    EXPECT_DOUBLE_EQ(fps("0.0083"), 120);
    EXPECT_DOUBLE_EQ(fps("0.008"), 125);
    EXPECT_DOUBLE_EQ(fps("0.04"), 25);
    EXPECT_NEAR(fps("0.0333667"), 29.97003, 1e-5);
    EXPECT_DOUBLE_EQ(fps("0.0345"), 1 / 0.0345);
}

TEST(SkeletonBvh, PersonsMayBeInInchesOrFeet) {
    // A chain of 20 joints along +y.
    const auto person = [](double height) {
        std::string text = "HIERARCHY\nROOT j\n{\nOFFSET 0 0 0\nCHANNELS 3 Xrotation Yrotation Zrotation\n";
        for (int j = 0; j < 20; ++j) text += "JOINT j\n{\nOFFSET 0 " + std::to_string(height / 20) + " 0\nCHANNELS 0\n";
        for (int j = 0; j < 21; ++j) text += "}\n";
        const auto track = parse_skeleton_bvh(text + "MOTION\nFrames: 1\nFrame Time: 0.1\n0 0 0\n");
        EXPECT_TRUE(track) << track.error().message;
        return track ? track->poses[0].joints[20][1] : 0;
    };
    EXPECT_NEAR(person(66), 66 * 25.4, 0.01);
    EXPECT_NEAR(person(5.5), 5.5 * 304.8, 0.01);
    EXPECT_NEAR(person(1.7), 1700, 0.01);
    EXPECT_NEAR(person(170), 1700, 0.01);
    EXPECT_NEAR(person(1700), 1700, 0.01);
}

TEST(SkeletonBvh, ABadHierarchyIsAnErrorThatNamesTheLine) {
    EXPECT_THAT(error_of(with(arm, "\t\tOFFSET 30 0 0\n", "")), HasSubstr("line 13: \"Elbow\" has no OFFSET"));
    EXPECT_THAT(error_of(with(arm, "OFFSET 30 0 0", "OFFSET 30 0")), HasSubstr("line 9: OFFSET of \"Elbow\""));
    EXPECT_THAT(error_of(with(arm, "CHANNELS 3 Z", "CHANNELS 3 W")), HasSubstr("\"Wrotation\" is not a channel"));
    EXPECT_THAT(error_of(with(arm, "CHANNELS 3", "CHANNELS 4")), HasSubstr("is not a channel"));
    EXPECT_THAT(error_of(with(arm, "CHANNELS 3", "CHANNELS -3")), HasSubstr("CHANNELS"));
    EXPECT_THAT(error_of(with(arm, "CHANNELS 3", "CHANNELS 4000000000")), HasSubstr("CHANNELS"));
    EXPECT_THAT(error_of(with(arm, "Zrotation Xrotation Yrotation\n\t\tEnd", "Zscale Xrotation Yrotation\n\t\tEnd")),
                HasSubstr("scale"));
    EXPECT_THAT(error_of(with(arm, "JOINT Elbow", "JOINT")), HasSubstr("no name"));
    EXPECT_THAT(error_of(with(arm, "MOTION", "ROOT Second")), HasSubstr("second ROOT"));
    EXPECT_THAT(error_of("HIERARCHY ROOT a\n{ OFFSET 0 0 0 }\nMOTION Frames: 0 Frame Time: 1"), HasSubstr("no bone"));
    EXPECT_THAT(error_of(""), HasSubstr("HIERARCHY"));
}

TEST(SkeletonBvh, AHeaderCannotMakeTheReaderAllocateMoreThanTheFileHolds) {
    EXPECT_FALSE(parse_skeleton_bvh(with(arm, "Frames: 3", "Frames: 99999999999999999999999")));
    EXPECT_FALSE(parse_skeleton_bvh(with(arm, "Frames: 3", "Frames: -1")));
    const std::string still =
        "HIERARCHY ROOT a\n{ OFFSET 0 0 0 End Site { OFFSET 1 0 0 } }\nMOTION Frames: 1000 Frame Time: 1";
    EXPECT_FALSE(parse_skeleton_bvh(still));
    std::string deep = "HIERARCHY ROOT a\n{ OFFSET 0 0 0 ";
    for (std::size_t j = 0; j < max_skeleton_joints; ++j) deep += "JOINT b\n{ OFFSET 1 0 0 ";
    const auto track = parse_skeleton_bvh(deep);
    ASSERT_FALSE(track);
    EXPECT_EQ(track.error().kind, ErrorKind::limit);
    EXPECT_FALSE(parse_skeleton_bvh(with(arm, "0 140 0 90", "0 1e300 0 90")));
}

TEST(SkeletonBvh, ATextThatIsCutAnywhereIsATrackOrAnError) {
    for (std::size_t size = 0; size < arm.size(); ++size) {
        const auto track = parse_skeleton_bvh(arm.substr(0, size));
        EXPECT_EQ(track.has_value(), size >= arm.find("0 0\n0 140") + 3) << size;  // from the first whole frame on
    }
}

TEST(SkeletonBvh, AnyByteChangedGivesATrackOrAnError) {
    for (std::size_t i = 0; i < arm.size(); ++i)
        for (const char byte : {'\0', '0', '9', '-', 'e', ' ', '\n', '{', '}', 'J', '\xff'}) {
            std::string text = arm;
            text[i] = byte;
            const auto track = parse_skeleton_bvh(text);
            if (track) {
                EXPECT_EQ(track->timestamps.size(), track->poses.size());
            } else {
                EXPECT_FALSE(track.error().message.empty());
            }
        }
}

}  // namespace
}  // namespace htvm
