// What the benchmarks encode, in memory.
#pragma once

#include <cstddef>
#include <vector>

#include "synth/synth.h"

namespace htvm::bench {

// Six frames of the default synthetic person in motion: about 35,000 vertices with colour, or as many as
// HTVM_BENCH_VERTICES says.
const std::vector<SynthFrame>& synthetic_frames();

// A whole capture: the folder that HTVM_BENCH_CAPTURE names, or 40 frames of the synthetic person, forwards and
// backwards, so that it never jumps. Of a folder at most 300 frames.
struct WholeCapture {
    std::vector<Mesh> meshes;
    Mesh& frame(std::size_t number);  // there and back, as long as wanted
    double vertices() const;          // a frame, on average
};
WholeCapture& whole_capture();

}  // namespace htvm::bench
