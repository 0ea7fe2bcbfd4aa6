#include "io/skeleton_rate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace htvm {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

SkeletonTrack poses_at(std::size_t count, double fps) {
    SkeletonTrack track;
    track.fps = fps;
    for (std::size_t t = 0; t < count; ++t) track.timestamps.push_back(static_cast<double>(t) / fps);
    track.poses.resize(count);
    return track;
}

TEST(MeshRate, IsTheSkeletonsWhereBothLastAboutAsLong) {
    for (const std::size_t meshes : {60u, 50u, 80u, 1u}) {
        const auto rate = mesh_rate_beside(poses_at(60, 30), meshes);
        EXPECT_DOUBLE_EQ(rate.fps, 30);
        EXPECT_EQ(rate.note, "") << meshes;
    }
}

TEST(MeshRate, IsAPartOfTheSkeletonsWhereThereAreSeveralPosesForEachMesh) {
    for (const std::size_t poses : {240u, 238u, 250u}) {
        const auto rate = mesh_rate_beside(poses_at(poses, 120), 60);
        EXPECT_DOUBLE_EQ(rate.fps, 30);
        EXPECT_FALSE(rate.is_doubtful);
        EXPECT_THAT(rate.note, AllOf(HasSubstr("4 for each of the 60 meshes"), HasSubstr("--fps")));
    }
}

TEST(MeshRate, IsAUsualOneWhereThatFits) {
    const auto slower = mesh_rate_beside(poses_at(200, 100), 60);
    EXPECT_DOUBLE_EQ(slower.fps, 30);
    EXPECT_THAT(slower.note, HasSubstr("as the 60 meshes do at 30 a second"));
    EXPECT_DOUBLE_EQ(mesh_rate_beside(poses_at(60, 30), 120).fps, 60);
}

TEST(MeshRate, IsDoubtfulWhereNothingFits) {
    const auto rate = mesh_rate_beside(poses_at(60, 30), 155);
    EXPECT_DOUBLE_EQ(rate.fps, 30);
    EXPECT_TRUE(rate.is_doubtful);
    EXPECT_THAT(rate.note, AllOf(HasSubstr("60 poses at 30 a second last 2 s"), HasSubstr("5.167 s")));
}

TEST(MeshRate, DurationsThatDifferByMoreThanAThirdAreSaid) {
    EXPECT_EQ(unlike_durations(poses_at(60, 30), 2.5), "");
    EXPECT_THAT(unlike_durations(poses_at(60, 30), 4), AllOf(HasSubstr("lasts 2 s"), HasSubstr("the meshes 4 s")));
    EXPECT_NE(unlike_durations(poses_at(60, 30), 1), "");
    EXPECT_EQ(unlike_durations(poses_at(60, 30), 0), "") << "not known";
}

TEST(MeshRate, GoesToATrackWithoutARate) {
    auto track = poses_at(60, 30);
    take_rate_of_meshes(track, 25, 60);
    EXPECT_DOUBLE_EQ(track.fps, 25);
    EXPECT_DOUBLE_EQ(track.timestamps[50], 2);
    EXPECT_THAT(track.notes, Contains(HasSubstr("at 25 a second, one for each mesh")));
    auto mocap = poses_at(240, 30);
    take_rate_of_meshes(mocap, 25, 60);
    EXPECT_DOUBLE_EQ(mocap.fps, 100);
}

}  // namespace
}  // namespace htvm
