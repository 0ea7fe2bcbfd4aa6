// The capture as htvm-lab rd holds it: read once, given to many coders.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "command_line/capture.h"
#include "rd_coders.h"

namespace htvm::lab {

struct SourceOptions {
    bool geometry_only = false;                       // leave the colours out
    std::size_t memory_bytes = std::size_t{1} << 30;  // frames beyond it wait in `spill_folder` as PLY
    std::filesystem::path spill_folder;               // must exist
};

class SourceFrames {
public:
    // Reads all of the capture, in mm, without normals and texture coordinates, which no metric looks at.
    static Result<SourceFrames> load(app::Capture& capture, const SourceOptions& options);
    std::size_t size() const { return frames_.size(); }
    const SequenceFacts& facts() const { return facts_; }
    // Threads may call it at once.
    Result<std::shared_ptr<const SourceFrame>> frame(std::size_t index) const;

private:
    Result<void> keep(SourceFrame frame, const SourceOptions& options);
    SequenceFacts facts_;
    std::size_t bytes_ = 0;
    std::vector<std::shared_ptr<const SourceFrame>> frames_;  // without its mesh where that is in a file
    std::vector<std::filesystem::path> files_;                // empty where the mesh is in memory
};

}  // namespace htvm::lab
