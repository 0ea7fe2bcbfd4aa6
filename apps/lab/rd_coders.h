// The coders that htvm-lab rd measures, each an entry with a name and a function that codes frames: another profile
// joins by one more entry.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "htvm/encoder.hpp"
#include "htvm/frame.hpp"
#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "htvm/skeleton.hpp"
#include "metrics/mesh_measures.h"

namespace htvm::lab {

// One frame of the capture, as every coder gets it.
struct SourceFrame {
    std::size_t index = 0;
    Mesh mesh;
    std::optional<Pose> pose;  // none without a skeleton
    std::int64_t timestamp_us = 0;
};

// What a coder may know of the whole sequence beforehand.
struct SequenceFacts {
    Box box;                // round all frames, mm
    double frame_side = 0;  // longest side of a frame's own bounding box, mean over the frames, mm
    double fps = 30;
    Skeleton skeleton;
    std::vector<double> radii;
};

// A quality of the sweep: the same steps for every coder.
struct QualityPoint {
    double quality = 50;                   // 0..100
    double geometry_step = 2;              // mm
    double colour_step = 6;                // levels of 255
    std::filesystem::path working_folder;  // for coders that work on files: exists, empty, the run's own
    unsigned threads = 1;
};
QualityPoint quality_point(double quality);

struct CodedFrame {
    Mesh decoded;
    FrameType type = FrameType::intra;
    LayerBytes bytes;  // external_intra: what a coder does not tell apart
    double encode_ms = 0;
    std::optional<double> decode_ms;  // nothing where the coder does not tell it apart; encode_ms is then both
};

// Codes the next frame; called with every frame in order.
using FrameCoder = std::function<Result<CodedFrame>(const SourceFrame&)>;

struct CoderUnderTest {
    std::string name;
    std::string description;  // one line
    std::string settings;     // whatever else decides the result: part of the key of kept results
    std::function<Result<FrameCoder>(const SequenceFacts&, const QualityPoint&)> start;
    // What became of a quality in the coder's own terms (such as "10 bits"); empty: nothing to say.
    std::function<std::string(const SequenceFacts&, const QualityPoint&)> describe_quality;
};

// Our codec with the given options; the steps, the frame rate, the skeleton and the radii are put in by the sweep. The
// bytes are all packets but the index, which a live stream has not.
CoderUnderTest codec_under_test(const std::string& name, const std::string& description, const EncoderOptions& options);

// libdraco, every frame by itself, at a compression level of 0 to 10 (10 - speed). Positions are quantised by Draco
// over the frame's own bounding box, in all frames to the bits whose cell is nearest to our step in the mean frame.
// Draco has no lossy colour below 8 bits: the colours go in as multiples of our colour step, numbered, and come back
// times the step (one byte a frame is counted for it), so that both sides pay for the same colours. Duplicate vertices
// are joined as Draco's own importer does.
CoderUnderTest draco_under_test(const std::string& name, int compression_level);

// The bits whose cells over a side of `side` mm are nearest to step mm, by their ratio: 1..30.
int draco_position_bits(double side, double step);

// The paper's own choices, as `--profile paper`.
EncoderOptions paper_options(int key_interval);

// still_below of htvm-motion, mm: bones that moved less are animated where they fit (EncoderOptions::animation_error).
inline constexpr double default_still_below = 50;

// paper, htvm-ep, htvm-motion, htvm-rd, htvm-t, tfan, draco10, draco7.
std::vector<CoderUnderTest> built_in_coders(int key_interval);

}  // namespace htvm::lab
