// The files that htvm synth --truth writes beside a capture: DIR/surface/frame_00000.ply, the meshes without noise;
// DIR/marks/frame_00000.ply, the points that are fixed on the surface; of textured captures
// DIR/texture/frame_00000.png, the images without noise and exposure; of captures by depth cameras
// DIR/seen/frame_00000.ply, what of the surface they could see; DIR/truth.json, what the marks are on, what limbs do,
// the exposure, and where the cameras are. docs/synth.md describes them.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "htvm/result.hpp"
#include "synth/depth_cameras.h"
#include "synth/texture.h"
#include "synth/truth.h"

namespace htvm::app {

class TruthFiles {
public:
    // Makes the folders and draws the marks. cameras: null if there are none.
    static Result<TruthFiles> create(const std::filesystem::path& folder, const SynthOptions& options, int first_frame,
                                     int marks, const DepthCameraOptions* cameras);
    const std::vector<SurfaceMark>& marks() const { return marks_; }

    // The frame of that number, which follow each other; `frame`'s mesh is given up. texture: null if there is none.
    // capture: likewise.
    Result<void> add(const std::string& file_name, SynthFrame frame, TrueFrame truth, const SynthTexture* texture,
                     const DepthCapture* capture);
    // Writes truth.json.
    Result<void> finish() const;

private:
    std::filesystem::path folder_;
    SynthOptions options_;
    int first_frame_ = 0;
    std::vector<SurfaceMark> marks_;
    struct Exposed {
        int layout;
        std::array<double, 3> gain;
    };
    std::vector<std::vector<LimbState>> limbs_;  // of each frame
    std::vector<Exposed> textures_;              // of each frame, if there are textures
    std::optional<DepthCameraOptions> cameras_;
    std::vector<std::vector<DepthCamera>> camera_places_;  // of each frame, if there are cameras
};

}  // namespace htvm::app
