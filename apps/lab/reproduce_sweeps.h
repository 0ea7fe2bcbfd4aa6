// The measurements behind the reproduction's curves: which coders run at which steps, and what was found.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "htvm/skeleton.hpp"
#include "rd_cache.h"
#include "rd_coders.h"
#include "rd_result.h"
#include "rd_source.h"
#include "rd_sweep.h"

namespace htvm::lab {

struct ExperimentPlan {
    std::vector<double> qualities{5, 15, 25, 40, 60, 80};  // figures 6 and 10
    std::vector<std::string> coders{"paper", "htvm-ep", "tfan", "draco10"};
    int key_interval = 30;
    std::vector<int> intervals{1, 2, 3, 5, 10, 30};  // figure 7 without a skeleton, with interval_qualities
    std::vector<double> interval_qualities{25, 60};
    int thresholds = 5;                                   // on motion, of each kind: figures 7 and 17 to 19
    double predicted_quality = 60;                        // figure 7, P-frames
    double motion_step = 2.5;                             // mm; figures 17 to 19, with picture_colour_step
    std::vector<double> geometry_steps{4, 2.5, 1.6, 1};   // mm; figures 11 to 13 and 16
    std::vector<double> colour_columns{16, 6};            // colour steps that go with every geometry step
    std::vector<double> geometry_rows{2.5, 1};            // geometry steps that go with every colour step
    std::vector<double> colour_steps{32, 16, 6, 3};       // levels
    double picture_colour_step = 6;                       // figures 16 to 19
    std::vector<double> noise_powers{0, 20, 40, 60, 80};  // mm^2; figure 20
    std::vector<double> noise_qualities{10, 30, 50, 70};
    std::uint64_t surface_samples = 100000;  // of M2, a direction
    std::size_t most_measured = 15;          // frames on which M1 and M2 are measured: evenly spread, from the first
    std::size_t picture_every = 5;           // M3 on every so many-th frame
};

// What all experiments share. The source must outlive them.
struct Laboratory {
    const SourceFrames* source = nullptr;
    ResultCache cache;
    std::string common_key;  // all that a result depends on besides its coder and steps
    std::filesystem::path work_folder;
    unsigned threads = 1;
};

// One point to measure.
struct Trial {
    CoderUnderTest coder;
    double geometry_step = 2, colour_step = 6;
    double quality = -1;  // of both steps, where they come from one; below 0: they do not
};

// Codes and measures what the cache has not, several trials at once, and says so under `name`. Trials that fail are
// left out, with a warning each; an error where all do.
Result<std::vector<RdPoint>> measure_trials(const Laboratory& laboratory, const std::string& name,
                                            const std::vector<Trial>& trials, const SweepOptions& options);

// The coder with the colours taken off every frame beforehand.
CoderUnderTest without_colours(CoderUnderTest coder);
// The coder with the skeleton of frame i replaced by poses[i]; `label` tells the poses apart in kept results.
CoderUnderTest with_poses(CoderUnderTest coder, std::vector<Pose> poses, const std::string& label);

// Gaussian noise of `power` (mm^2, variance of each coordinate) added to every joint, the same for the same seed and
// frame; orientations are left to be derived from the joints.
Pose noisy_pose(Pose pose, double power, std::uint64_t seed, std::size_t frame);

// So many-th frames to measure such that at most `most` are.
std::size_t measure_every(std::size_t frames, std::size_t most);

std::vector<Trial> geometry_trials(const ExperimentPlan& plan);                                             // 6, 10
std::vector<Trial> interval_trials(const ExperimentPlan& plan);                                             // 7
std::vector<Trial> colour_trials(const ExperimentPlan& plan);                                               // 11 to 13
std::vector<Trial> picture_trials(const ExperimentPlan& plan);                                              // 16
std::vector<Trial> noise_trials(const ExperimentPlan& plan, const std::vector<Pose>& poses, double power);  // 20

}  // namespace htvm::lab
