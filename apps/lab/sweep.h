// What every measurement stands on: the capture, read once and given to many coders; every coder at every quality over
// all of it, side by side; and the results, kept between runs.
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

// Removed with all that is in it, however the command ends.
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

// ---- Results kept between runs --------------------------------------------------------------------------------------

// Name, size and time of change of each file, and of this program's own: a text that is another once one was changed.
std::string fingerprint(const std::vector<std::filesystem::path>& files);

// A folder with one JSON file per result. The key is a text that says all that the result depends on.
class ResultCache {
public:
    explicit ResultCache(std::filesystem::path folder) : folder_(std::move(folder)) {}
    // Nothing where there is no result of that very key.
    std::optional<RdPoint> find(const std::string& name, const std::string& key) const;
    Result<void> keep(const std::string& name, const std::string& key, const RdPoint& point) const;

private:
    std::filesystem::path file(const std::string& name, const std::string& key) const;
    std::filesystem::path folder_;
};

// Writes a text file as a whole: another run that reads it sees the old one or the new one.
Result<void> write_text(const std::filesystem::path& path, const std::string& text);

// ---- The sweep itself -----------------------------------------------------------------------------------------------

struct SweepJob {
    const CoderUnderTest* coder = nullptr;
    QualityPoint quality;
    std::filesystem::path keep_frames;  // decoded frames go here as PLY; empty: nowhere
};

struct SweepOptions {
    CompareOptions compare;
    std::size_t measure_every = 1;  // metrics on every so many-th frame, from the first; rates on all
    unsigned threads = 1;           // jobs at once; a job has its thread for coding and measuring
};

// Runs the jobs side by side, each on its own: one frame after the other is coded, decoded and measured. done(job,
// result) is called once per job, from one thread at a time, as soon as it is through; step() once per frame, likewise.
void sweep(const std::vector<SweepJob>& jobs, const SourceFrames& source, const SweepOptions& options,
           const std::function<void(std::size_t, Result<RdPoint>)>& done, const std::function<void()>& step);

}  // namespace htvm::lab
