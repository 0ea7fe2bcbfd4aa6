// The coders that experiments measure: each has a name and a function that codes frames. Another one joins by one more
// entry in built_in_coders(), or, being a program of its own, as a peer.
#pragma once

#include <cstdint>
#include <ctime>
#include <filesystem>
#include <functional>
#include <map>
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

// paper, htvm-ep, htvm-motion, htvm-rd, htvm-t, tfan, tfan-mpeg, draco10, draco7.
std::vector<CoderUnderTest> built_in_coders(int key_interval);

// ---- Time that coding takes, while other cores of the machine are busy with other things ----------------------------

// On one thread, the processor time of the calling thread: what the wall clock would say on a core of its own. With
// several threads, the wall clock.
class Stopwatch {
public:
    explicit Stopwatch(unsigned threads) : clock_(threads == 1 ? CLOCK_THREAD_CPUTIME_ID : CLOCK_MONOTONIC) {
        start_ = now();
    }
    double milliseconds() const { return now() - start_; }  // since the construction, by the same thread

private:
    double now() const {
        std::timespec t{};
        clock_gettime(clock_, &t);
        return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
    }
    clockid_t clock_;
    double start_ = 0;
};

// ---- Peers: other programs ------------------------------------------------------------------------------------------

// Coders outside this program join the sweep as a command, run once per frame through the shell after these were put
// into it, names of files quoted:
//   {in}       a binary PLY: the frame in mm, with colours where the capture has some (to be read only)
//   {out}      where the command writes the coded frame: the size of this file is what counts
//   {decoded}  where it writes the decoded frame, as PLY in mm, from nothing but {out} if it is to be fair
//   {q}        the sweep's quality, 0..100
//   {step}     that quality's step of positions, mm; {colour_step}, of colours, levels of 255
//   {bits}     the position bits whose cells over a frame's bounding box are nearest to the step
// Exit status 0 is success. Its time, on the wall clock, counts as encoding and decoding together.

// From NAME=COMMAND; bad_input unless the name is letters, digits, dots, _ or - and the command names {in}, {out} and
// {decoded}.
Result<CoderUnderTest> peer_under_test(const std::string& name_and_command);

// Every {key} replaced by its value; braces round anything else stay.
std::string substitute(const std::string& text, const std::map<std::string, std::string>& values);

// As one word for the shell, whatever it holds.
std::string quoted_for_shell(const std::string& text);

}  // namespace htvm::lab
