#include "reproduce_motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "htvm/encoder.hpp"
#include "reproduce_motion_gallery.h"

namespace htvm::lab {
namespace {

// Two bones in a row, the second twice as far from where the first pose has them as the first.
Skeleton two_bones() {
    Skeleton skeleton;
    skeleton.joint_names = {"a", "b", "c"};
    skeleton.bones = {{0, 1}, {1, 2}};
    return skeleton;
}

Pose moved_by(double shift) {
    Pose pose;
    pose.joints = {{0, 0, 0}, {0, 100 + 2 * shift, 0}, {0, 200, 2 * shift}};
    return pose;
}

TEST(BoneMotion, is_how_far_the_middle_of_a_bone_went) {
    const auto motion = bone_motion(two_bones(), moved_by(0), moved_by(10));
    ASSERT_EQ(2u, motion.size());
    EXPECT_DOUBLE_EQ(10, motion[0]);
    EXPECT_DOUBLE_EQ(std::sqrt(200.0), motion[1]);
    EXPECT_DOUBLE_EQ(10 + std::sqrt(200.0), skeletal_motion(two_bones(), moved_by(0), moved_by(10)));
}

TEST(Quantile, lies_between_the_sorted_values) {
    EXPECT_EQ(0, quantile({}, 0.5));
    EXPECT_EQ(3, quantile({3}, 0.9));
    EXPECT_EQ(1, quantile({4, 1, 2}, 0));
    EXPECT_EQ(2, quantile({4, 1, 2}, 0.5));
    EXPECT_EQ(3, quantile({4, 1, 2}, 0.75));
    EXPECT_EQ(4, quantile({4, 1, 2}, 1));
}

std::vector<Pose> walk(std::size_t frames) {
    std::vector<Pose> poses;
    for (std::size_t i = 0; i < frames; ++i) poses.push_back(moved_by(static_cast<double>(i)));
    return poses;
}

TEST(ShareOfIntra, counts_the_first_frame_and_each_that_is_too_far_from_the_last) {
    const auto poses = walk(10);
    const double step = skeletal_motion(two_bones(), poses[0], poses[1]);
    EXPECT_EQ(0, share_of_intra(two_bones(), {}, 1));
    EXPECT_DOUBLE_EQ(1, share_of_intra(two_bones(), poses, 0));
    EXPECT_DOUBLE_EQ(0.5, share_of_intra(two_bones(), poses, 1.5 * step));
    EXPECT_DOUBLE_EQ(0.1, share_of_intra(two_bones(), poses, 100 * step));
}

TEST(MotionThresholds, rise_and_begin_with_none_where_all_is_coded) {
    const auto thresholds = motion_thresholds(two_bones(), walk(30), 30, 5);
    ASSERT_TRUE(thresholds);
    for (const auto* list : {&thresholds->still_below, &thresholds->predicted_below, &thresholds->intra_above}) {
        EXPECT_EQ(list == &thresholds->intra_above ? 5u : 6u, list->size());
        for (std::size_t i = 1; i < list->size(); ++i) EXPECT_GT((*list)[i], (*list)[i - 1]);
    }
    EXPECT_EQ(0, thresholds->still_below[0]);
    EXPECT_EQ(0, thresholds->predicted_below[0]);
    EXPECT_GT(thresholds->intra_above[0], 0);
}

TEST(MotionThresholds, need_a_skeleton_that_moves) {
    EXPECT_FALSE(motion_thresholds({}, {}, 30, 5));
    EXPECT_FALSE(motion_thresholds(two_bones(), {}, 30, 5));
    EXPECT_FALSE(motion_thresholds(two_bones(), std::vector<Pose>(10, moved_by(3)), 30, 5));
    EXPECT_FALSE(motion_thresholds(two_bones(), walk(30), 1, 5));  // I-frames only
}

TEST(MotionTrials, have_options_that_the_encoder_takes_and_settings_of_their_own) {
    const ExperimentPlan plan;
    const auto thresholds = motion_thresholds(two_bones(), walk(30), 30, 4);
    ASSERT_TRUE(thresholds);
    std::vector<Trial> trials = motion_trials(plan, *thresholds);
    EXPECT_EQ(thresholds->still_below.size(), trials.size());
    for (const auto& more : {intra_choice_trials(plan, *thresholds), predicted_trials(plan, *thresholds, true)})
        trials.insert(trials.end(), more.begin(), more.end());
    SequenceFacts facts;
    facts.skeleton = two_bones();
    std::set<std::string> keys;
    for (const auto& trial : trials) {
        QualityPoint quality;
        quality.geometry_step = trial.geometry_step;
        quality.colour_step = trial.colour_step;
        EXPECT_TRUE(trial.coder.start(facts, quality));
        EXPECT_TRUE(keys.insert(trial.coder.settings + std::to_string(trial.geometry_step)).second)
            << trial.coder.settings;
        EXPECT_FALSE(trial.coder.describe_quality(facts, quality).empty());
    }
    EXPECT_EQ(predicted_trials(plan, *thresholds, false).size() * 2, predicted_trials(plan, *thresholds, true).size());
}

TEST(ByThreshold, finds_the_points_of_one_kind_by_their_words) {
    std::vector<RdPoint> points(3);
    points[0].setting = threshold_words(still_below_words, 40);
    points[1].setting = threshold_words(still_below_words, 8.5);
    points[2].setting = threshold_words(predicted_below_words, 40);
    const std::vector<double> thresholds = {8.5, 20, 40};
    const auto found = by_threshold(points, still_below_words, thresholds);
    ASSERT_EQ(2u, found.size());
    EXPECT_EQ(8.5, found[0].first);
    EXPECT_EQ(&points[1], found[0].second);
    EXPECT_EQ(&points[0], found[1].second);
}

TEST(Tinted, gives_every_triangle_vertices_and_a_colour_of_its_part) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
    mesh.triangles = {{0, 1, 2}, {1, 3, 2}, {2, 1, 3}};
    const auto out = tinted(mesh, 1, 2);
    ASSERT_EQ(9u, out.positions.size());
    ASSERT_EQ(9u, out.colours.size());
    EXPECT_EQ(out.colours[0], out.colours[2]);
    EXPECT_NE(out.colours[2], out.colours[3]);
    EXPECT_NE(out.colours[5], out.colours[6]);
    EXPECT_EQ(mesh.positions[3], out.positions[4]);
    EXPECT_TRUE(tinted({}, 0, 0).triangles.empty());
}

TEST(BusiestSeam, is_where_most_stitches_face_the_same_way) {
    SeamStages stages;
    auto& mesh = stages.zippered;
    auto add = [&](float x, float side) {
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        mesh.positions.insert(mesh.positions.end(), {{x, 0, 0}, {x + side, 0, 0}, {x, side, 0}});
        mesh.triangles.push_back({first, first + 1, first + 2});
    };
    for (int i = 0; i < 20; ++i) add(500, 1);  // no stitches
    stages.kept_end = mesh.triangles.size();
    EXPECT_FALSE(busiest_seam(stages, 10));
    add(0, 5);
    for (const float x : {100.0f, 101.0f, 102.0f}) add(x, 1);
    const auto spot = busiest_seam(stages, 10);
    ASSERT_TRUE(spot);
    EXPECT_NEAR(101, spot->centre[0], 2);
    EXPECT_NEAR(1, spot->normal[2], 1e-9);
}

}  // namespace
}  // namespace htvm::lab
