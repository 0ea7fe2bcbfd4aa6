// The coders that experiments measure: each has a name and a function that codes frames. To add one, add an entry to
// built_in_coders(), or run it as a separate program, as a peer.
#pragma once

#include <cstdint>
#include <ctime>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/image.h"
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
    std::optional<Pose> pose;  // none if there is no skeleton
    std::int64_t timestamp_us = 0;
    std::shared_ptr<const TexturedMesh> textured;  // what the colours were made from, for pictures; null: no texture
};

// What a coder may know about the whole sequence in advance.
struct SequenceFacts {
    Box box;                // around all frames, mm
    double frame_side = 0;  // longest side of a frame's own bounding box, mean over the frames, mm
    double fps = 30;
    Skeleton skeleton;
    std::vector<double> radii;
};

// A quality of the sweep: every coder gets the same steps.
struct QualityPoint {
    double quality = 50;                   // 0..100
    double geometry_step = 2;              // mm
    double colour_step = 6;                // levels of 255
    std::filesystem::path working_folder;  // for coders that work on files: an existing, empty folder for this run
                                           // alone
    unsigned threads = 1;
};
QualityPoint quality_point(double quality);

struct CodedFrame {
    Mesh decoded;
    FrameType type = FrameType::intra;
    LayerBytes bytes;    // external_intra: bytes that a coder does not split up
    double recoded = 1;  // share of the decoded surface that it codes anew (metrics/recoded_area.h)
    double encode_ms = 0;
    std::optional<double> decode_ms;  // nothing if the coder does not time decoding separately; encode_ms is then the
                                      // sum of both
};

// Codes the next frame; called with every frame in order.
using FrameCoder = std::function<Result<CodedFrame>(const SourceFrame&)>;

struct CoderUnderTest {
    std::string name;
    std::string description;  // one line
    std::string settings;     // everything else that determines the result; part of the key of stored results
    std::function<Result<FrameCoder>(const SequenceFacts&, const QualityPoint&)> start;
    // What a quality means in the coder's own terms (such as "10 bits"); empty: nothing to say.
    std::function<std::string(const SequenceFacts&, const QualityPoint&)> describe_quality;
};

// Our codec with the given options; the sweep sets the steps, the frame rate, the skeleton and the radii. Bytes count
// all packets except the index, which a live stream does not have.
CoderUnderTest codec_under_test(const std::string& name, const std::string& description, const EncoderOptions& options);

// libdraco, every frame by itself, at a compression level of 0 to 10 (10 - speed). Draco quantises positions over the
// frame's own bounding box; in all frames it uses the number of bits whose cell size in the average frame is nearest to
// our step. Draco has no lossy colour below 8 bits. So colours are passed as multiples of our colour step, numbered,
// and multiplied by the step afterwards (one byte per frame is counted for it): both sides pay for the same colours.
// Duplicate vertices are merged as in Draco's own importer.
CoderUnderTest draco_under_test(const std::string& name, int compression_level);

// The number of bits, 1..30, whose cells over a side of `side` mm are nearest to `step` mm, by ratio.
int draco_position_bits(double side, double step);

// The paper's own choices, like `--profile paper`.
EncoderOptions paper_options(int key_interval);

// still_below of htvm-motion, mm: bones that moved less are animated if the animation fits
// (EncoderOptions::animation_error).
inline constexpr double default_still_below = 50;

// key_interval: 0: each coder's own default. denoise: of htvm-t.
// paper, htvm-ep, htvm-motion, htvm-rd, htvm-t, tfan, tfan-mpeg, draco10, draco7.
std::vector<CoderUnderTest> built_in_coders(int key_interval, Denoising denoise = Denoising::automatic);

// ---- The time that coding takes, even while other cores of the machine are busy -------------------------------------

// With one thread, the processor time of the calling thread: what the wall clock would show on a core of its own. With
// several threads, the wall clock.
class Stopwatch {
public:
    explicit Stopwatch(unsigned threads) : clock_(threads == 1 ? CLOCK_THREAD_CPUTIME_ID : CLOCK_MONOTONIC) {
        start_ = now();
    }
    double milliseconds() const { return now() - start_; }  // since construction, on the same thread

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

// A coder outside this program joins the sweep as a command. It is run once per frame through the shell, after these
// were replaced (names of files quoted):
//   {in}       a binary PLY: the frame in mm, with colours if the capture has some; must not be changed
//   {out}      where the command writes the coded frame; the size of this file is the frame's size
//   {decoded}  where it writes the decoded frame, as PLY in mm; for a fair result, decoded from {out} alone
//   {q}        the sweep's quality, 0..100
//   {step}     the position step of that quality, mm; {colour_step}: the colour step, levels of 255
//   {bits}     the position bits whose cells over a frame's bounding box are nearest to the step
// Exit status 0 means success. The wall-clock time counts as encoding and decoding together.

// From NAME=COMMAND; bad_input unless the name consists of letters, digits, dots, _ or - and the command contains {in},
// {out} and {decoded}.
Result<CoderUnderTest> peer_under_test(const std::string& name_and_command);

// Replaces every {key} by its value; braces around anything else stay.
std::string substitute(const std::string& text, const std::map<std::string, std::string>& values);

// The text as one word for the shell, whatever it contains.
std::string quoted_for_shell(const std::string& text);

}  // namespace htvm::lab
