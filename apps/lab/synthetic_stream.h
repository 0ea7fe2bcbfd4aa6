// A synthetic capture whose truth is known, made, encoded and decoded frame by frame in memory: what experiments on
// tracking need that no real capture tells, for as long as they like.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/thread.h"
#include "htvm/decoder.hpp"
#include "htvm/encoder.hpp"
#include "htvm/result.hpp"
#include "synth/synth.h"
#include "synth/truth.h"

namespace htvm::lab {

struct SyntheticOptions {
    SynthOptions synth{.motion = SynthMotion::fast, .vertices = 6000};
    int first_frame = 0;
    double quality = 42;   // as of htvm encode
    int key_interval = 0;  // frames; 0: the encoder's default
    Denoising denoise = Denoising::automatic;
    unsigned threads = 1;
};

// Adds --motion, --people, --vertices, --fps, --seed, --first-frame, -q, --keyint, --denoise and --threads.
void add_synthetic_options(CLI::App& command, SyntheticOptions& options);

struct SyntheticFrame {
    int number = 0;
    Mesh surface;     // the captured mesh as it is without its noise
    TrueFrame truth;  // of the marks
    Mesh decoded;
    FrameType type = FrameType::intra;
    bool renewal = false;            // an I-frame that is made of the tracked mesh, so that nothing was lost
    std::uint32_t topology = 0;      // FrameView::topology
    std::size_t kept_triangles = 0;  // metrics/recoded_area.h
    double recoded = 1;              // likewise: share of the surface
    std::size_t bytes = 0;           // of all packets since the frame before
};

class SyntheticStream {
public:
    // marks: of surface_marks(). Fails as Encoder::create() and check_synth_options() do.
    static Result<SyntheticStream> start(const SyntheticOptions& options, std::vector<SurfaceMark> marks);
    // Without end. with_truth: false leaves `truth` out, which takes as long as coding does.
    Result<SyntheticFrame> next(bool with_truth = true);

private:
    SyntheticStream(const SyntheticOptions& options, std::vector<SurfaceMark> marks, Encoder encoder);
    SyntheticOptions options_;
    std::vector<SurfaceMark> marks_;
    internal::ThreadPool pool_;
    Encoder encoder_;
    Decoder decoder_;
    int made_ = 0;
};

}  // namespace htvm::lab
