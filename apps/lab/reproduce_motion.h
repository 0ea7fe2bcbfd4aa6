// Thresholds on the skeleton's motion, and the coders that choose frames or bones by it (figures 7 and 17 to 19).
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "htvm/skeleton.hpp"
#include "reproduce_sweeps.h"

namespace htvm::lab {

// "Per-bone motion" (paper, section III-B): how far the middle of each bone is from where it was in `reference`, mm.
// Both poses must have the skeleton's joints.
std::vector<double> bone_motion(const Skeleton& skeleton, const Pose& reference, const Pose& pose);
// "Skeletal motion": their sum, mm.
double skeletal_motion(const Skeleton& skeleton, const Pose& reference, const Pose& pose);

// The value that a part (0..1) of the values lie below; 0 of none.
double quantile(std::vector<double> values, double part);

// What a threshold on the skeletal motion since the last I-frame makes of the poses: the share of I-frames, 0..1, the
// first frame among them.
double share_of_intra(const Skeleton& skeleton, std::span<const Pose> poses, double intra_above);

// Thresholds to try, in mm, rising, each at a part of what the capture's own motion is (against an I-frame every
// key_interval frames): a walk and a dance need other ones.
struct MotionThresholds {
    std::vector<double> still_below;            // on per-bone motion; the first is 0: everything is coded
    std::vector<double> predicted_below;        // on skeletal motion; the first is 0: no P-frames
    std::vector<double> intra_above;            // on skeletal motion
    double share_at_400 = 0, share_at_500 = 0;  // of I-frames, at the paper's own thresholds
};
// `count` of each besides the 0s. Nothing without a skeleton, poses or motion.
std::optional<MotionThresholds> motion_thresholds(const Skeleton& skeleton, std::span<const Pose> poses,
                                                  int key_interval, int count);

// What RdPoint::setting says of a trial at a threshold, such as "still below 40 mm".
std::string threshold_words(const char* what, double millimetres);
inline constexpr const char* still_below_words = "still below";
inline constexpr const char* predicted_below_words = "P below";
inline constexpr const char* checked_words = "checked, P below";
inline constexpr const char* intra_above_words = "I above";

// The points of one kind of threshold, with it, rising.
std::vector<std::pair<double, const RdPoint*>> by_threshold(std::span<const RdPoint> points, const char* what,
                                                            std::span<const double> thresholds);

// The paper's coder with motion-based coding, the animation unchecked.
CoderUnderTest motion_coder(int key_interval, double still_below);

std::vector<Trial> motion_trials(const ExperimentPlan& plan, const MotionThresholds& thresholds);        // 17 and 18
std::vector<Trial> intra_choice_trials(const ExperimentPlan& plan, const MotionThresholds& thresholds);  // 7
// With P-frames unchecked, as in the paper, and where `checked` with the default check too.
std::vector<Trial> predicted_trials(const ExperimentPlan& plan, const MotionThresholds& thresholds, bool checked);

}  // namespace htvm::lab
