#include "experiments.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "charts.h"
#include "galleries.h"
#include "htvm/decoder.hpp"
#include "htvm/encoder.hpp"
#include "synth/synth.h"

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

// Two bones in a row; the second moves twice as far from its place in the first pose as the first.
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

struct Shots {
    std::vector<std::shared_ptr<const SourceFrame>> frames;
    SequenceFacts facts;
};

// A few frames of the synthetic person, who walks.
Shots walking() {
    Shots out;
    SynthOptions options;
    options.vertices = 2000;
    for (const int i : {40, 43, 46}) {
        const auto made = synth_frame(options, i);
        SourceFrame frame;
        frame.index = static_cast<std::size_t>(i);
        frame.mesh = made.mesh;
        frame.pose = made.true_pose;
        frame.timestamp_us = 33333 * i;
        out.frames.push_back(std::make_shared<const SourceFrame>(std::move(frame)));
    }
    out.facts.skeleton = synth_skeleton();
    return out;
}

EncoderOptions partly(double still_below) {
    auto options = paper_options(30);
    options.topology.still_below = still_below;
    options.topology.animation_error = 0;
    options.threads = 1;
    return options;
}

TEST(SeamStages, the_last_is_what_the_decoder_shows) {
    const auto shots = walking();
    const auto stages = code_in_stages(shots.frames, shots.facts, partly(60));
    ASSERT_TRUE(stages) << stages.error().message;
    ASSERT_EQ(2u, stages->size());
    EXPECT_EQ(43u, (*stages)[0].frame);
    EXPECT_EQ(46u, (*stages)[1].frame);
    auto options = partly(60);
    options.skeleton = shots.facts.skeleton;
    options.key_interval = 1000000;
    options.topology.scene_changes = false;
    auto encoder = Encoder::create(options);
    ASSERT_TRUE(encoder);
    Decoder decoder;
    std::vector<Mesh> shown;
    for (const auto& frame : shots.frames) {
        ASSERT_TRUE(encoder->push(frame->mesh, &*frame->pose, frame->timestamp_us));
        while (auto packet = encoder->pull())
            if (auto decoded = decoder.decode_copy(*packet); decoded && *decoded) shown.push_back((*decoded)->mesh);
    }
    ASSERT_EQ(3u, shown.size());
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_EQ(shown[i + 1].positions, (*stages)[i].zippered.positions);
        EXPECT_EQ(shown[i + 1].triangles, (*stages)[i].zippered.triangles);
    }
}

TEST(SeamStages, each_adds_to_the_coded_part) {
    const auto shots = walking();
    const auto stages = code_in_stages(shots.frames, shots.facts, partly(60));
    ASSERT_TRUE(stages);
    for (const auto& stage : *stages) {
        const auto coded = static_cast<std::ptrdiff_t>(stage.coded_triangles);
        for (const auto* mesh : {&stage.overlapping, &stage.trimmed})
            EXPECT_TRUE(
                std::equal(mesh->triangles.begin(), mesh->triangles.begin() + coded, stage.zippered.triangles.begin()));
        EXPECT_EQ(stage.kept_end, stage.trimmed.triangles.size());
        EXPECT_LT(stage.kept_end, stage.zippered.triangles.size());
        EXPECT_LT(stage.trimmed.triangles.size(), stage.overlapping.triangles.size());
    }
}

TEST(SeamCounts, fall_from_trimmed_to_zippered) {
    const auto shots = walking();
    const auto stages = code_in_stages(shots.frames, shots.facts, partly(60));
    ASSERT_TRUE(stages);
    for (std::size_t i = 0; i < stages->size(); ++i) {
        const auto counts = count_seams(shots.frames[i + 1]->mesh, (*stages)[i], 1);
        ASSERT_TRUE(counts);
        EXPECT_EQ(0u, counts->original.open_edges);
        EXPECT_GT(counts->overlapping.open_edges, 0u);
        EXPECT_GT(counts->trimmed.open_edges, 0u);
        EXPECT_LT(10 * counts->zippered.open_edges, counts->trimmed.open_edges);
    }
}

TEST(SeamStages, there_are_none_where_all_or_nothing_is_coded) {
    const auto shots = walking();
    for (const double still_below : {0.0, 1e6}) {
        const auto stages = code_in_stages(shots.frames, shots.facts, partly(still_below));
        ASSERT_TRUE(stages);
        EXPECT_TRUE(stages->empty());
    }
    EXPECT_TRUE(code_in_stages({}, shots.facts, partly(60))->empty());
}

}  // namespace
}  // namespace htvm::lab
