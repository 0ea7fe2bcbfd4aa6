// What every measurement is based on: the capture, read once and passed to many coders; every coder at every quality
// over all of it, side by side; and the results, stored between runs.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "coders.h"
#include "command_line/capture.h"
#include "htvm/result.hpp"
#include "metrics/compare.h"
#include "results.h"

namespace htvm::lab {

// A folder that is removed with all its contents, however the command ends.
struct WorkFolder {
    std::filesystem::path where;
    explicit WorkFolder(std::filesystem::path folder) : where(std::move(folder)) {}
    WorkFolder(const WorkFolder&) = delete;
    WorkFolder& operator=(const WorkFolder&) = delete;
    ~WorkFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(where, ignored);
    }
};

inline Result<void> make_folder(const std::filesystem::path& folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) return fail(ErrorKind::bad_input, folder.string() + " cannot be made: " + error.message());
    return {};
}

// ---- The capture ----------------------------------------------------------------------------------------------------

struct SourceOptions {
    bool geometry_only = false;                       // leave the colours out
    std::size_t memory_bytes = std::size_t{1} << 30;  // frames beyond this are kept in `spill_folder` as PLY
    std::filesystem::path spill_folder;               // must exist
};

class SourceFrames {
public:
    // Reads the whole capture, in mm, without normals and texture coordinates, which no coder is measured by; textures
    // are kept for pictures.
    static Result<SourceFrames> load(app::Capture& capture, const SourceOptions& options);
    // Frames that were made; facts: all but what follows from the meshes.
    static Result<SourceFrames> of(std::vector<SourceFrame> frames, SequenceFacts facts, const SourceOptions& options);
    std::size_t size() const { return frames_.size(); }
    const SequenceFacts& facts() const { return facts_; }
    // Thread-safe.
    Result<std::shared_ptr<const SourceFrame>> frame(std::size_t index) const;

private:
    Result<void> keep(SourceFrame frame, const SourceOptions& options);
    SequenceFacts facts_;
    std::size_t bytes_ = 0;
    std::vector<std::shared_ptr<const SourceFrame>> frames_;  // without its mesh if that is in a file
    std::vector<std::filesystem::path> files_;                // empty if the mesh is in memory
    std::vector<std::filesystem::path> textured_;             // likewise; empty too if there is no texture
};

// ---- Results stored between runs ------------------------------------------------------------------------------------

// Name, size and modification time of each file and of this program: the text changes whenever one of them does.
std::string fingerprint(const std::vector<std::filesystem::path>& files);

// A folder with one JSON file per result. The key is a text with everything that the result depends on.
class ResultCache {
public:
    explicit ResultCache(std::filesystem::path folder) : folder_(std::move(folder)) {}
    // Nothing if there is no result with exactly this key.
    std::optional<RdPoint> find(const std::string& name, const std::string& key) const;
    Result<void> keep(const std::string& name, const std::string& key, const RdPoint& point) const;

private:
    std::filesystem::path file(const std::string& name, const std::string& key) const;
    std::filesystem::path folder_;
};

// Writes a text file atomically: another run that reads it sees either the old one or the new one.
Result<void> write_text(const std::filesystem::path& path, const std::string& text);

// ---- The sweep itself -----------------------------------------------------------------------------------------------

struct SweepJob {
    const CoderUnderTest* coder = nullptr;
    QualityPoint quality;
    std::filesystem::path keep_frames;  // decoded frames are written here as PLY; empty: nowhere
};

struct SweepOptions {
    CompareOptions compare;
    std::size_t measure_every = 1;  // metrics on every n-th frame, beginning with the first; rates on all
    unsigned threads = 1;           // number of jobs at once; each job codes and measures on one thread
};

// Runs the jobs side by side. Each job codes, decodes and measures its frames one after another. done(job, result) is
// called once per job as soon as it is finished, from one thread at a time; step() once per frame, likewise.
void sweep(const std::vector<SweepJob>& jobs, const SourceFrames& source, const SweepOptions& options,
           const std::function<void(std::size_t, Result<RdPoint>)>& done, const std::function<void()>& step);

}  // namespace htvm::lab
