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
    double fps = 0;              // of the meshes; 0: that of the skeleton, or 30
    std::string unit = "auto";   // of the mesh files: mm, cm, m, or auto
    std::size_t frames = 0;      // at most this many; 0: all
    std::size_t first = 0;       // number of frames to skip at the beginning
    double skeleton_offset = 0;  // seconds to add to the skeleton's clock
};

// Adds the options above to a command.
void add_capture_options(CLI::App& command, CaptureOptions& options);

// The length in millimetres of the unit named mm, cm or m.
Result<double> millimetres_of_unit(const std::string& name);

class Capture {
public:
    // Opens the input, reads the skeleton, and reports on the terminal what it found and assumed.
    static Result<Capture> open(const CaptureOptions& options);
    // The next frame's mesh in mm; nothing at the end.
    Result<std::optional<Mesh>> next();
    // Goes back to the first frame. Works for files only: standard input cannot be read twice.
    void rewind();
    // The pose for the last mesh from next(); null if there is no skeleton.
    const Pose* pose() const;
    std::int64_t timestamp_us() const;
    std::size_t frames() const { return frames_; }  // 0: unknown, for standard input
    const Skeleton& skeleton() const { return skeleton_; }
    const std::vector<double>& radii() const { return radii_; }  // from the skeleton file; may be empty
    double fps() const { return fps_; }
    double millimetres_per_unit() const { return millimetres_per_unit_; }

private:
    Result<void> peek();
    Result<std::optional<Mesh>> read_next();
    CaptureOptions options_;
    SequenceFiles files_;
    std::unique_ptr<PlyStreamReader> stream_;
    std::optional<Mesh> peeked_;  // the first mesh, read ahead to find its unit
    std::size_t frames_ = 0, read_ = 0, given_ = 0;
    double fps_ = 30, millimetres_per_unit_ = 0;
    Skeleton skeleton_;
    std::vector<Pose> poses_;
    std::vector<double> radii_, timestamps_;
};

}  // namespace htvm::app
