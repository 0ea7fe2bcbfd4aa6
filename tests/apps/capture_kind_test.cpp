// What the frames of a capture have in common.
#include "command_line/capture_kind.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace htvm::app {
namespace {

using testing::HasSubstr;

Mesh person(float size = 1, float x = 0, bool coloured = true) {
    Mesh out;
    for (int i = 0; i < 60; ++i)
        out.positions.push_back(
            {x + size * 200 * static_cast<float>(i % 3), size * 30 * static_cast<float>(i), size * 10});
    for (std::uint32_t i = 2; i < 60; ++i) out.triangles.push_back({i - 2, i - 1, i});
    if (coloured) out.colours.assign(60, {90, 80, 70});
    return out;
}

TEST(GlobalShift, IsTakenOfWhatIsFar) {
    EXPECT_EQ(shift_of(person(), 1), GlobalShift{}) << "at the origin";
    EXPECT_EQ(shift_of(person(1, 50000), 1), GlobalShift{}) << "50 m away floats are fine";
    EXPECT_EQ(shift_of(person(1, 5e8f), 1), (GlobalShift{500000000, 1000, 0})) << "in whole metres";
    EXPECT_EQ(shift_of(person(0.001f, 5e5f), 1000), (GlobalShift{500000000, 1000, 0})) << "of files in metres";
    EXPECT_EQ(shift_of({}, 1), GlobalShift{});
}

TEST(GlobalShift, IsOfTheSurfaceNotOfUnusedVertices) {
    auto mesh = person();
    mesh.positions.push_back({1e9f, 0, 0});
    EXPECT_EQ(shift_of(mesh, 1), GlobalShift{});
}

TEST(CaptureKind, TellsFramesWithoutTheColoursThatOthersHave) {
    CaptureKind kind;
    for (int i = 0; i < 3; ++i) kind.add(person(), {}, false);
    EXPECT_EQ(kind.unlike(person(), {}, false), "");
    EXPECT_THAT(kind.unlike(person(1, 0, false), {}, false), HasSubstr("no colours"));
    EXPECT_EQ(kind.unlike(person(1, 0, false), {}, true), "") << "an image gives them";
    EXPECT_EQ(kind.unlike({}, {}, false), "") << "an empty mesh is of every kind";
}

TEST(CaptureKind, TellsFramesWithColoursAmongThoseWithout) {
    CaptureKind kind;
    for (int i = 0; i < 3; ++i) kind.add(person(1, 0, false), {}, false);
    EXPECT_THAT(kind.unlike(person(), {}, false), HasSubstr("has colours"));
}

TEST(CaptureKind, TellsFramesOfAnotherSize) {
    CaptureKind kind;
    kind.add(person(), {}, false);
    EXPECT_EQ(kind.unlike(person(0.4f), {}, false), "") << "somebody crouches";
    EXPECT_THAT(kind.unlike(person(0.001f), {}, false), HasSubstr("1000 times smaller"));
    EXPECT_THAT(kind.unlike(person(25), {}, false), HasSubstr("25 times larger"));
    auto with_stray = person();
    with_stray.positions.push_back({4e5f, 0, 4e5f});
    with_stray.colours.push_back({0, 0, 0});
    EXPECT_EQ(kind.unlike(with_stray, {}, false), "") << "a flying vertex is no other size";
}

// Around the sizes that people have as they move.
CaptureKind usual_kind() {
    CaptureKind out;
    for (const float size : {0.9f, 1.0f, 1.1f}) out.add(person(size), {}, false);
    return out;
}

TEST(CaptureKind, TellsFramesInAnotherUnitThanTheirNeighbours) {
    const auto kind = usual_kind();
    EXPECT_THAT(kind.odd_size(person(2.54f)), HasSubstr("2.5 times larger than the other frames")) << "cm among inches";
    EXPECT_THAT(kind.odd_size(person(1 / 3.28f)), HasSubstr("3.3 times smaller")) << "feet among metres";
    EXPECT_THAT(kind.odd_size(person(1.8f)), "") << "people are no units";
    EXPECT_EQ(kind.unlike(person(2.54f), {}, false), "") << "which may be meant so";
    EXPECT_THAT(kind.unlike(person(9.9f), {}, false), HasSubstr("another unit")) << "decimetres among metres";
}

TEST(CaptureKind, TheUsualSizeIsNotThatOfTheFirstFrame) {
    CaptureKind kind;
    for (const float size : {0.1f, 1.0f, 1.1f}) kind.add(person(size), {}, false);
    EXPECT_THAT(kind.unlike(person(0.1f), {}, false), HasSubstr("10 times smaller than the other frames"));
    EXPECT_EQ(kind.unlike(person(1.05f), {}, false), "");
}

TEST(CaptureKind, ASizeThatEdgesDisagreeWithIsNoUnit) {
    const auto kind = usual_kind();
    auto two = person();  // a second person comes, three metres away
    const auto more = person(1, 3000);
    const auto count = static_cast<std::uint32_t>(two.positions.size());
    two.positions.insert(two.positions.end(), more.positions.begin(), more.positions.end());
    for (const auto& t : more.triangles) two.triangles.push_back({t[0] + count, t[1] + count, t[2] + count});
    EXPECT_GT(size_of(two).reach, 2 * size_of(person()).reach);
    EXPECT_EQ(kind.odd_size(two), "");
    auto coarse = person(1);  // every third vertex, longer edges
    coarse.triangles.clear();
    for (std::uint32_t i = 12; i < 60; ++i) coarse.triangles.push_back({i - 12, i - 6, i});
    EXPECT_GT(size_of(coarse).edge, 1.5 * size_of(person()).edge);
    EXPECT_EQ(kind.odd_size(coarse), "");
}

TEST(MeshSize, ASpikeIsFarFromTheMiddleAndChangesNoneOfTheOthers) {
    auto spiked = person();
    spiked.positions[59] = {90000, 0, 0};
    const auto size = size_of(spiked), plain = size_of(person());
    EXPECT_NEAR(size.reach, plain.reach, 0.1 * plain.reach);
    EXPECT_NEAR(size.edge, plain.edge, 0.1 * plain.edge);
    EXPECT_NEAR(farthest_from(size.middle, spiked), 90000, 1000);
    EXPECT_LT(farthest_from(plain.middle, person()), 1200);
    EXPECT_EQ(farthest_from({}, {}), 0);
}

TEST(CaptureKind, AddsUpTheColoursOfFrames) {
    CaptureKind kind;
    EXPECT_EQ(kind.colour_range(), std::nullopt) << "types say it";
    MeshFindings dark, bright, unit;
    for (int i = 0; i < 10; ++i) dark.colour_levels.count(1);
    for (int i = 0; i < 1000; ++i) bright.colour_levels.count(130);
    kind.add(person(), dark, false);
    EXPECT_EQ(kind.colour_range(), ColourRange::unit);
    kind.add(person(), bright, false);
    EXPECT_EQ(kind.colour_range(), ColourRange::bytes);
    for (int i = 0; i < 100; ++i) unit.colour_levels.count(0.004 * i);
    EXPECT_THAT(kind.unlike(person(), unit.colour_levels, false),
                HasSubstr("its colours are 0 to 1, those of the other frames 0 to 255"));
    EXPECT_EQ(kind.unlike(person(), dark.colour_levels, false), "") << "so dark a frame may be of any range";
}

TEST(CaptureKind, OneFrameOfAnotherRangeDoesNotDecideForTheOthers) {
    CaptureKind kind;
    MeshFindings unit, bytes;
    for (int i = 0; i < 100; ++i) unit.colour_levels.count(0.004 * i);
    for (int i = 0; i < 100; ++i) bytes.colour_levels.count(2 * i);
    for (int i = 0; i < 3; ++i) kind.add(person(), unit, false);
    kind.add(person(), bytes, false);
    EXPECT_EQ(kind.colour_range(), ColourRange::unit);
    EXPECT_THAT(kind.unlike(person(), bytes.colour_levels, false), HasSubstr("its colours are 0 to 255"));
}

}  // namespace
}  // namespace htvm::app
