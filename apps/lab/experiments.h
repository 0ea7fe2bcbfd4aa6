// The measurements behind the curves of the reproduction: which coders run at which steps, and the results.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "coders.h"
#include "htvm/encoder.hpp"
#include "htvm/frame.hpp"
#include "htvm/result.hpp"
#include "htvm/skeleton.hpp"
#include "metrics/topology.h"
#include "results.h"
#include "sweep.h"

namespace htvm::lab {

struct ExperimentPlan {
    std::vector<double> qualities{5, 15, 25, 40, 60, 80};  // figures 6 and 10
    std::vector<std::string> coders{"paper", "htvm-ep", "tfan", "tfan-mpeg", "draco10"};
    int key_interval = 30;
    std::vector<int> intervals{1, 2, 3, 5, 10, 30};  // figure 7 without a skeleton, with interval_qualities
    std::vector<double> interval_qualities{25, 60};
    int thresholds = 5;                                   // number of thresholds on motion, of each kind: figures 7 and
                                                          // 17 to 19
    double predicted_quality = 60;                        // figure 7, P-frames
    double motion_step = 2.5;                             // mm; figures 17 to 19, with picture_colour_step
    std::vector<double> geometry_steps{4, 2.5, 1.6, 1};   // mm; figures 11 to 13 and 16
    std::vector<double> colour_columns{16, 6};            // colour steps combined with every geometry step
    std::vector<double> geometry_rows{2.5, 1};            // geometry steps combined with every colour step
    std::vector<double> colour_steps{32, 16, 6, 3};       // levels
    double picture_colour_step = 6;                       // figures 16 to 19
    std::vector<double> noise_powers{0, 20, 40, 60, 80};  // mm^2; figure 20
    std::vector<double> noise_qualities{10, 30, 50, 70};
    int camera_frames = 100;                 // figure 20 of one depth camera's capture: as many as the paper's
    std::uint64_t surface_samples = 100000;  // for M2, per direction
    std::size_t most_measured = 15;          // number of frames on which M1 and M2 are measured, evenly spread,
                                             // beginning with the first
    std::size_t picture_every = 5;           // M3 on every n-th frame
};

// What all experiments share. The source must outlive it.
struct Laboratory {
    const SourceFrames* source = nullptr;
    ResultCache cache;
    std::string common_key;  // everything that a result depends on besides its coder and steps
    std::filesystem::path work_folder;
    unsigned threads = 1;
};

// One point to measure.
struct Trial {
    CoderUnderTest coder;
    double geometry_step = 2, colour_step = 6;
    double quality = -1;  // that both steps follow from; < 0: they do not follow from a quality
};

// Codes and measures what is not in the cache, several trials at once, and reports it under `name`. Trials that fail
// are left out with a warning; an error if all fail.
Result<std::vector<RdPoint>> measure_trials(const Laboratory& laboratory, const std::string& name,
                                            const std::vector<Trial>& trials, const SweepOptions& options);

// The coder with colours removed from every frame beforehand.
CoderUnderTest without_colours(CoderUnderTest coder);
// The coder with the skeleton of frame i replaced by poses[i]; `label` distinguishes the poses in stored results.
CoderUnderTest with_poses(CoderUnderTest coder, std::vector<Pose> poses, const std::string& label);

// Adds Gaussian noise of `power` (mm^2, variance of each coordinate) to every joint, the same for the same seed and
// frame; orientations are removed, to be derived from the joints.
Pose noisy_pose(Pose pose, double power, std::uint64_t seed, std::size_t frame);

// The n for which measuring every n-th frame measures at most `most`.
std::size_t measure_every(std::size_t frames, std::size_t most);

std::vector<Trial> geometry_trials(const ExperimentPlan& plan);                                             // 6, 10
std::vector<Trial> interval_trials(const ExperimentPlan& plan);                                             // 7
std::vector<Trial> colour_trials(const ExperimentPlan& plan);                                               // 11 to 13
std::vector<Trial> picture_trials(const ExperimentPlan& plan);                                              // 16
std::vector<Trial> noise_trials(const ExperimentPlan& plan, const std::vector<Pose>& poses, double power);  // 20

// ---- Thresholds on the skeleton's motion, and the coders that use them (figures 7 and 17 to 19) ---------------------

// "Per-bone motion" (paper, section III-B): how far the middle of each bone is from where it was in `reference`, mm.
// Both poses must have the joints of the skeleton.
std::vector<double> bone_motion(const Skeleton& skeleton, const Pose& reference, const Pose& pose);
// "Skeletal motion": their sum, mm.
double skeletal_motion(const Skeleton& skeleton, const Pose& reference, const Pose& pose);

// The value below which a share (0..1) of the values lies; 0 if there are none.
double quantile(std::vector<double> values, double part);

// The share of I-frames, 0..1, that a threshold on the skeletal motion since the last I-frame gives for these poses,
// including the first frame.
double share_of_intra(const Skeleton& skeleton, std::span<const Pose> poses, double intra_above);

// Thresholds to try, in mm, ascending. They are chosen relative to the capture's own motion (with an I-frame every
// key_interval frames), since a walk and a dance need different ones.
struct MotionThresholds {
    std::vector<double> still_below;            // on per-bone motion; the first is 0: everything is coded
    std::vector<double> predicted_below;        // on skeletal motion; the first is 0: no P-frames
    std::vector<double> intra_above;            // on skeletal motion
    double share_at_400 = 0, share_at_500 = 0;  // share of I-frames with the paper's own thresholds
};
// `count` of each kind besides the zeros. Nothing without a skeleton, poses or motion.
std::optional<MotionThresholds> motion_thresholds(const Skeleton& skeleton, std::span<const Pose> poses,
                                                  int key_interval, int count);

// RdPoint::setting for a trial with a threshold, such as "still below 40 mm".
std::string threshold_words(const char* what, double millimetres);
inline constexpr const char* still_below_words = "still below";
inline constexpr const char* predicted_below_words = "P below";
inline constexpr const char* checked_words = "checked, P below";
inline constexpr const char* intra_above_words = "I above";

// The points of one kind of threshold, each with its threshold, ascending.
std::vector<std::pair<double, const RdPoint*>> by_threshold(std::span<const RdPoint> points, const char* what,
                                                            std::span<const double> thresholds);

// The paper's coder with motion-based coding, without a check of the animation.
CoderUnderTest motion_coder(int key_interval, double still_below);

std::vector<Trial> motion_trials(const ExperimentPlan& plan, const MotionThresholds& thresholds);        // 17 and 18
std::vector<Trial> intra_choice_trials(const ExperimentPlan& plan, const MotionThresholds& thresholds);  // 7
// With P-frames unchecked, as in the paper; if `checked`, also with the default check.
std::vector<Trial> predicted_trials(const ExperimentPlan& plan, const MotionThresholds& thresholds, bool checked);

// ---- One run of the paper's coder, looked into (figures 21 to 25) ---------------------------------------------------

struct InternalFrame {
    FrameInfo info;
    double encode_ms = 0, decode_ms = 0;  // wall clock
};

struct StageMean {
    std::string stage;
    double milliseconds = 0;  // mean over the EP-frames
};

struct InternalRun {
    double quality = 50, geometry_step = 2, colour_step = 6;
    unsigned threads = 1;
    std::vector<InternalFrame> frames;
    std::vector<StageMean> stages;                     // for encoding an EP-frame
    std::vector<std::uint64_t> distance_order_counts;  // in frame `order_frame`, the escapes last; may be empty
    std::size_t order_frame = 0;
    double bits_per_vertex = 0;  // over all frames
};

// The quality among 20, 25 ... 95 at which the rate of EP-frames in the middle and at the end is nearest to `rate`,
// bpvf.
Result<double> quality_near_rate(const SourceFrames& source, double rate, int key_interval, unsigned threads);

// The paper's coder over the whole sequence.
Result<InternalRun> run_internals(const SourceFrames& source, double quality, int key_interval, unsigned threads);

// Bits per captured vertex of one layer, for each EP-frame.
std::vector<double> layer_rates(const InternalRun& run, std::size_t (*bytes)(const LayerBytes&));

double mean_of(const std::vector<double>& values);  // 0 if there are none

// ---- Motion-coded frames taken apart (figure 19) --------------------------------------------------------------------

// A frame before, during and after zippering, mm. In each mesh except `animated`, the vertices and triangles of the
// coded part come first.
struct SeamStages {
    std::size_t frame = 0;
    std::size_t coded_triangles = 0;
    std::size_t kept_end = 0;  // in trimmed and zippered: the stitches come after it
    Mesh animated;             // the whole I-frame's mesh, moved as a P-frame would show it
    Mesh overlapping;          // coded part plus every animated triangle that has a vertex of a still bone
    Mesh trimmed;              // coded part plus the animated triangles that are kept
    Mesh zippered;             // the same plus the stitches: what the decoder shows
};

// Codes the first frame as an I-frame and the others against it, in order of time; returns those that were partly
// coded. The skeleton and radii come from the facts.
Result<std::vector<SeamStages>> code_in_stages(const std::vector<std::shared_ptr<const SourceFrame>>& frames,
                                               const SequenceFacts& facts, const EncoderOptions& options);

// What topology() finds in a captured frame and at each stage.
struct SeamCounts {
    std::size_t frame = 0;
    Topology original, animated, overlapping, trimmed, zippered;
};
// Cracks may be as wide as two edges of the captured mesh, so that wide ones are found too.
Result<SeamCounts> count_seams(const Mesh& original, const SeamStages& stages, unsigned threads);

}  // namespace htvm::lab
