// The log of what was decided for each frame of an encoding: written as it goes, and read to repeat it to the byte.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "deadline.h"
#include "htvm/result.hpp"
#include "io/output_file.h"

namespace htvm::app {

// What was decided for a frame.
struct LoggedFrame {
    int effort = 5;
    bool may_repair = true;  // what tracking lost in it, if anything
    bool operator==(const LoggedFrame&) const = default;
};

struct EffortLog {
    int asked = 5;  // the effort that was asked for: what outlasts frames is searched for with it
    std::vector<LoggedFrame> frames;
};

// Frames of a log that does not say whether they may be repaired may be; what was asked for, if a log does not say it,
// is the usual effort, or the highest in it if that is higher. Lines may end as on Windows.
Result<EffortLog> read_effort_log(const std::filesystem::path& path);
// Why such a log does not do for so many frames, a number or "more".
std::string too_few_efforts(const std::string& path, std::size_t efforts, const std::string& frames);

// Writes a line for each frame, beside the file's place until all are there, as OutputFile does.
class EffortLogWriter {
public:
    // asked: as in EffortLog. bad_input if what is there already is anything but such a log, as a frame of the capture.
    static Result<EffortLogWriter> create(const std::filesystem::path& path, int asked);
    // The next frame's line, which outlasts the program from then on, however that ends.
    Result<void> add(const TimedFrame& frame);
    Result<void> finish();
    // Leaves the lines of an encoding that ended early beside the file's place, and says where; empty if there are
    // none, or the log is finished.
    std::filesystem::path keep();

private:
    EffortLogWriter(OutputFile file, int asked) : file_(std::move(file)), asked_(asked) {}

    OutputFile file_;
    int asked_;
    std::size_t frames_ = 0;
    bool is_finished_ = false;
};

}  // namespace htvm::app
