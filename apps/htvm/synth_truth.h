// The files that htvm synth --truth writes beside a capture: DIR/surface/frame_00000.ply, the meshes without noise;
// DIR/marks/frame_00000.ply, the points that are fixed on the surface; DIR/truth.json, what they are on, and what limbs
// do. docs/synth.md describes them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "htvm/result.hpp"
#include "synth/truth.h"

namespace htvm::app {

class TruthFiles {
public:
    // Makes the folders and draws the marks.
    static Result<TruthFiles> create(const std::filesystem::path& folder, const SynthOptions& options, int first_frame,
                                     int marks);
    const std::vector<SurfaceMark>& marks() const { return marks_; }

    // The frame of that number, which follow each other; `frame`'s mesh is given up.
    Result<void> add(const std::string& file_name, SynthFrame frame, TrueFrame truth);
    // Writes truth.json.
    Result<void> finish() const;

private:
    std::filesystem::path folder_;
    SynthOptions options_;
    int first_frame_ = 0;
    std::vector<SurfaceMark> marks_;
    std::vector<std::vector<LimbState>> limbs_;  // of each frame
};

}  // namespace htvm::app
