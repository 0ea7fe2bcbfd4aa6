#include "reproduce_sweeps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "reproduce_chart.h"
#include "reproduce_pictures.h"

namespace htvm::lab {
namespace {

Pose pose_of(std::size_t joints) {
    Pose pose;
    pose.joints.assign(joints, Vector3d{1, 2, 3});
    pose.orientations.assign(1, Rotation{});
    return pose;
}

TEST(NoisyPose, has_noise_of_the_power_and_no_orientations) {
    const auto noisy = noisy_pose(pose_of(4000), 40, 7, 3);
    double mean = 0, power = 0;
    for (const auto& joint : noisy.joints) {
        for (std::size_t k = 0; k < 3; ++k) {
            const double noise = joint[k] - static_cast<double>(k + 1);
            mean += noise / 12000;
            power += noise * noise / 12000;
        }
    }
    EXPECT_NEAR(0, mean, 0.3);
    EXPECT_NEAR(40, power, 3);
    EXPECT_TRUE(noisy.orientations.empty());
}

TEST(NoisyPose, depends_on_nothing_but_seed_and_frame) {
    const auto pose = pose_of(15);
    EXPECT_EQ(noisy_pose(pose, 20, 1, 5).joints, noisy_pose(pose, 20, 1, 5).joints);
    EXPECT_NE(noisy_pose(pose, 20, 1, 5).joints, noisy_pose(pose, 20, 1, 6).joints);
    EXPECT_NE(noisy_pose(pose, 20, 1, 5).joints, noisy_pose(pose, 20, 2, 5).joints);
    EXPECT_EQ(pose.joints, noisy_pose(pose, 0, 1, 5).joints);
}

TEST(MeasureEvery, takes_at_most_so_many_frames) {
    EXPECT_EQ(1u, measure_every(0, 15));
    EXPECT_EQ(1u, measure_every(15, 15));
    EXPECT_EQ(2u, measure_every(16, 15));
    EXPECT_EQ(2u, measure_every(30, 15));
}

TEST(ColourTrials, hold_every_step_of_each_column_and_row_once) {
    const ExperimentPlan plan;
    std::set<std::pair<double, double>> steps;
    std::size_t ours = 0;
    for (const auto& trial : colour_trials(plan)) {
        if (trial.coder.name != "paper") continue;
        ++ours;
        steps.insert({trial.geometry_step, trial.colour_step});
    }
    EXPECT_EQ(ours, steps.size());
    for (const double colour : plan.colour_columns)
        for (const double geometry : plan.geometry_steps) EXPECT_TRUE(steps.contains({geometry, colour}));
    for (const double geometry : plan.geometry_rows)
        for (const double colour : plan.colour_steps) EXPECT_TRUE(steps.contains({geometry, colour}));
}

TEST(Trials, of_different_coders_settings_never_share_a_key) {
    const ExperimentPlan plan;
    std::set<std::string> keys;
    std::size_t count = 0;
    auto add = [&](const std::vector<Trial>& trials) {
        for (const auto& trial : trials) {
            keys.insert(trial.coder.name + trial.coder.settings + std::to_string(trial.geometry_step) + " " +
                        std::to_string(trial.colour_step));
            ++count;
        }
    };
    add(geometry_trials(plan));
    add(noise_trials(plan, {pose_of(2)}, 20));
    add(noise_trials(plan, {pose_of(2)}, 40));
    EXPECT_EQ(count, keys.size());
}

TEST(FrontAzimuth, is_where_the_left_hip_is_to_the_left) {
    Skeleton skeleton;
    skeleton.joint_names = {"lhip", "rhip"};
    Pose pose;
    pose.joints = {{100, 900, 0}, {-100, 900, 0}};
    EXPECT_NEAR(0, front_azimuth({}, skeleton, pose), 1e-9);  // faces +z
    pose.joints = {{0, 900, -100}, {0, 900, 100}};
    EXPECT_NEAR(90, front_azimuth({}, skeleton, pose), 1e-9);  // faces +x
}

TEST(FrontAzimuth, without_a_skeleton_is_where_the_feet_point) {
    Mesh mesh;
    mesh.positions = {{0, 0, -80}, {0, 100, 0}, {0, 1000, 0}};  // a toe, a shin, a head
    EXPECT_NEAR(180, std::abs(front_azimuth(mesh, {}, std::nullopt)), 1e-9);
    EXPECT_EQ(0, front_azimuth({}, {}, std::nullopt));
}

Picture picture_of(int width, int height) {
    Picture picture;
    picture.width = width;
    picture.height = height;
    const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    picture.rgb.assign(3 * pixels, 100);
    picture.covered.assign(pixels, 0);
    return picture;
}

TEST(Crop, holds_what_was_drawn_and_a_margin) {
    auto picture = picture_of(10, 10);
    EXPECT_EQ(10, covered_part(picture).width);
    picture.covered[4 * 10 + 5] = 1;
    const auto crop = covered_part(picture);
    EXPECT_EQ(4, crop.left);
    EXPECT_EQ(3, crop.top);
    EXPECT_EQ(3, crop.width);
    EXPECT_EQ(3, crop.height);
    const auto part = cropped(picture, crop);
    EXPECT_EQ(27u, part.rgb.size());
    EXPECT_EQ(1, part.covered[4]);
}

TEST(Halved, takes_the_mean_of_four_pixels) {
    auto picture = picture_of(3, 2);
    picture.rgb[0] = 104;
    picture.covered[1] = 1;
    const auto half = halved(picture);
    EXPECT_EQ(1, half.width);
    EXPECT_EQ(1, half.height);
    EXPECT_EQ((std::vector<std::uint8_t>{101, 100, 100}), half.rgb);
    EXPECT_EQ(1, half.covered[0]);
}

TEST(ZeroAxis, starts_at_zero_and_holds_all_values) {
    const std::vector<double> values = {0.3, 4.7};
    const auto axis = zero_axis(values);
    EXPECT_EQ(0, axis.low);
    EXPECT_GT(axis.high, 4.7);
    EXPECT_EQ(0, axis.tics.front());
    EXPECT_EQ(1, zero_axis({}).high);
}

TEST(ChartScript, quotes_what_a_title_holds) {
    Chart chart;
    chart.title = "it's";
    chart.lines.push_back({"a 'b'", "#000000", 7, 1, {{1, 2}}});
    const auto script = chart_script(chart, "out/figure.svg");
    EXPECT_NE(std::string::npos, script.find("set title 'it''s'"));
    EXPECT_NE(std::string::npos, script.find("title 'a ''b'''"));
    EXPECT_NE(std::string::npos, script.find("set output 'out/figure.svg'"));
}

}  // namespace
}  // namespace htvm::lab
