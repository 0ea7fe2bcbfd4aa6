// A capture as the commands read it: meshes from files or standard input, each with its pose.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "htvm/skeleton.hpp"
#include "io/ply.h"
#include "io/sequence.h"

namespace CLI {
class App;
}

namespace htvm::app {

struct CaptureOptions {
    std::string input;           // folder, pattern, glob, file, or - for concatenated PLY on standard input
    std::string skeleton;        // file; empty: none
    double fps = 0;              // of the meshes; 0: the skeleton's, else 30
    std::string unit = "auto";   // of the mesh files: mm, cm, m, or auto
    std::size_t frames = 0;      // at most; 0: all
    std::size_t first = 0;       // frames to leave out at the beginning
    double skeleton_offset = 0;  // seconds added to the skeleton's clock
};

// Adds the options above to a command.
void add_capture_options(CLI::App& command, CaptureOptions& options);

// The unit named mm, cm or m in millimetres.
Result<double> millimetres_of_unit(const std::string& name);

class Capture {
public:
    // Opens the input, reads the skeleton and says on the terminal what it found and assumed.
    static Result<Capture> open(const CaptureOptions& options);
    // The next frame's mesh in mm, or nothing at the end.
    Result<std::optional<Mesh>> next();
    // Back to the first frame. From files only: standard input does not come again.
    void rewind();
    // Of the frame that next() gave last: null where there is no skeleton.
    const Pose* pose() const;
    std::int64_t timestamp_us() const;
    std::size_t frames() const { return frames_; }  // 0: not known, from standard input
    const Skeleton& skeleton() const { return skeleton_; }
    const std::vector<double>& radii() const { return radii_; }  // from the skeleton's file; may be empty
    double fps() const { return fps_; }
    double millimetres_per_unit() const { return millimetres_per_unit_; }

private:
    Result<void> peek();
    Result<std::optional<Mesh>> read_next();
    CaptureOptions options_;
    SequenceFiles files_;
    std::unique_ptr<PlyStreamReader> stream_;
    std::optional<Mesh> peeked_;  // the first mesh, read beforehand to tell its unit
    std::size_t frames_ = 0, read_ = 0, given_ = 0;
    double fps_ = 30, millimetres_per_unit_ = 0;
    Skeleton skeleton_;
    std::vector<Pose> poses_;
    std::vector<double> radii_, timestamps_;
};

}  // namespace htvm::app
