// Pictures one after the other: into a video file, by whatever ffmpeg there is on the machine, or into numbered PNG
// files.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <optional>
#include <string>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "io/output_file.h"
#include "io/sequence.h"
#include "io/timestamps.h"
#include "metrics/smooth_picture.h"

namespace htvm::app {

struct VideoOptions {
    std::string path;               // of a video (.mp4, .mov, .mkv, .webm, .gif); or a folder or pattern for PNG files
    std::string ffmpeg = "ffmpeg";  // the program
    int width = 0, height = 0;      // of every picture
    FrameRate rate;
    std::optional<Colour> background;  // none: transparent, for PNG files only
};

class VideoOutput {
public:
    // unsupported if there is no ffmpeg for a video, or it is of another kind; usage errors are bad_input.
    static Result<VideoOutput> open(const VideoOptions& options);
    VideoOutput(VideoOutput&& other) noexcept;
    VideoOutput& operator=(VideoOutput&&) = delete;
    // Ends ffmpeg; its file is there only if finish() was called.
    ~VideoOutput();

    Result<void> write(const SmoothPicture& picture);
    // A video is in its place only now.
    Result<void> finish();

private:
    explicit VideoOutput(VideoOptions options) : options_(std::move(options)) {}
    Result<void> start_ffmpeg();
    void close_pipe();
    VideoOptions options_;
    std::optional<OutputNames> pictures_;  // of PNG files
    std::size_t written_ = 0;
    std::optional<OutputFile> video_;  // into which ffmpeg writes
    int pipe_ = -1;
    pid_t ffmpeg_ = 0;
};

}  // namespace htvm::app
