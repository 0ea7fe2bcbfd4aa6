#include "reproduce_motion.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace htvm::lab {
namespace {

// Two digits, so that a threshold can be read and typed.
double rounded(double value) {
    if (!(value > 0)) return 0;
    const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
    return std::round(value / unit) * unit;
}

// At equal parts between `low` and `high` of the values, without repeats.
std::vector<double> quantiles(const std::vector<double>& values, double low, double high, int count) {
    std::vector<double> out;
    for (int i = 0; i < count; ++i) {
        const double part = count == 1 ? (low + high) / 2 : low + (high - low) * i / (count - 1);
        const double threshold = rounded(quantile(values, part));
        if (threshold > 0 && (out.empty() || threshold > out.back())) out.push_back(threshold);
    }
    return out;
}

CoderUnderTest labelled(const EncoderOptions& options, const std::string& label) {
    auto coder = codec_under_test("paper", "the paper's coder, " + label, options);
    coder.describe_quality = [label](const SequenceFacts&, const QualityPoint&) { return label; };
    return coder;
}

Trial trial_of(const CoderUnderTest& coder, double quality) {
    const auto steps = quality_point(quality);
    return {coder, steps.geometry_step, steps.colour_step, quality};
}

}  // namespace

std::vector<double> bone_motion(const Skeleton& skeleton, const Pose& reference, const Pose& pose) {
    std::vector<double> out;
    for (const auto& bone : skeleton.bones) {
        double squares = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const double shift = (pose.joints[bone.first][k] + pose.joints[bone.second][k] -
                                  reference.joints[bone.first][k] - reference.joints[bone.second][k]) /
                                 2;
            squares += shift * shift;
        }
        out.push_back(std::sqrt(squares));
    }
    return out;
}

double skeletal_motion(const Skeleton& skeleton, const Pose& reference, const Pose& pose) {
    const auto motion = bone_motion(skeleton, reference, pose);
    return std::accumulate(motion.begin(), motion.end(), 0.0);
}

double quantile(std::vector<double> values, double part) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    const double place = std::clamp(part, 0.0, 1.0) * static_cast<double>(values.size() - 1);
    const auto low = static_cast<std::size_t>(place);
    const std::size_t high = std::min(low + 1, values.size() - 1);
    return values[low] + (place - static_cast<double>(low)) * (values[high] - values[low]);
}

double share_of_intra(const Skeleton& skeleton, std::span<const Pose> poses, double intra_above) {
    if (poses.empty()) return 0;
    std::size_t last = 0, count = 1;
    for (std::size_t i = 1; i < poses.size(); ++i) {
        if (skeletal_motion(skeleton, poses[last], poses[i]) <= intra_above) continue;
        last = i;
        ++count;
    }
    return static_cast<double>(count) / static_cast<double>(poses.size());
}

std::optional<MotionThresholds> motion_thresholds(const Skeleton& skeleton, std::span<const Pose> poses,
                                                  int key_interval, int count) {
    if (skeleton.bones.empty() || key_interval < 2) return std::nullopt;
    std::vector<double> of_bones, of_skeleton;
    for (std::size_t i = 0; i < poses.size(); ++i) {
        const auto reference = i / static_cast<std::size_t>(key_interval) * static_cast<std::size_t>(key_interval);
        if (i == reference) continue;
        const auto motion = bone_motion(skeleton, poses[reference], poses[i]);
        of_bones.insert(of_bones.end(), motion.begin(), motion.end());
        of_skeleton.push_back(std::accumulate(motion.begin(), motion.end(), 0.0));
    }
    MotionThresholds out;
    out.still_below = quantiles(of_bones, 0.15, 0.8, count);
    out.predicted_below = quantiles(of_skeleton, 0.1, 0.9, count);
    out.intra_above = quantiles(of_skeleton, 0, 0.9, count);
    if (out.still_below.empty() || out.predicted_below.empty() || out.intra_above.empty()) return std::nullopt;
    out.still_below.insert(out.still_below.begin(), 0);
    out.predicted_below.insert(out.predicted_below.begin(), 0);
    out.share_at_400 = share_of_intra(skeleton, poses, 400);
    out.share_at_500 = share_of_intra(skeleton, poses, 500);
    return out;
}

std::string threshold_words(const char* what, double millimetres) {
    return fmt::format("{} {:g} mm", what, millimetres);
}

std::vector<std::pair<double, const RdPoint*>> by_threshold(std::span<const RdPoint> points, const char* what,
                                                            std::span<const double> thresholds) {
    std::vector<std::pair<double, const RdPoint*>> out;
    for (const double threshold : thresholds)
        for (const auto& point : points)
            if (point.setting == threshold_words(what, threshold)) out.emplace_back(threshold, &point);
    return out;
}

CoderUnderTest motion_coder(int key_interval, double still_below) {
    auto options = paper_options(key_interval);
    options.topology.still_below = still_below;
    options.topology.animation_error = 0;
    return labelled(options, threshold_words(still_below_words, still_below));
}

std::vector<Trial> motion_trials(const ExperimentPlan& plan, const MotionThresholds& thresholds) {
    std::vector<Trial> out;
    for (const double threshold : thresholds.still_below)
        out.push_back({motion_coder(plan.key_interval, threshold), plan.motion_step, plan.picture_colour_step});
    return out;
}

std::vector<Trial> intra_choice_trials(const ExperimentPlan& plan, const MotionThresholds& thresholds) {
    std::vector<Trial> out;
    for (const double quality : plan.interval_qualities) {
        for (const double threshold : thresholds.intra_above) {
            // The threshold alone decides.
            auto options = paper_options(1000000);
            options.topology.frame_choice = FrameChoice::motion;
            options.topology.intra_above = threshold;
            options.topology.scene_changes = false;
            out.push_back(
                trial_of(without_colours(labelled(options, threshold_words(intra_above_words, threshold))), quality));
        }
    }
    return out;
}

std::vector<Trial> predicted_trials(const ExperimentPlan& plan, const MotionThresholds& thresholds, bool checked) {
    std::vector<Trial> out;
    for (const bool check : {false, true}) {
        if (check && !checked) continue;
        for (const double threshold : thresholds.predicted_below) {
            auto options = paper_options(plan.key_interval);
            options.topology.frame_choice = FrameChoice::motion;
            options.topology.predicted_below = threshold;
            if (!check) options.topology.animation_error = 0;
            const auto label = threshold_words(check ? checked_words : predicted_below_words, threshold);
            out.push_back(trial_of(without_colours(labelled(options, label)), plan.predicted_quality));
        }
    }
    return out;
}

}  // namespace htvm::lab
