#include "video_output.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <string_view>
#include <utility>
#include <vector>

#include "io/child_program.h"
#include "io/output_file.h"

namespace htvm::app {
namespace {

namespace fs = std::filesystem;

struct VideoFormat {
    const char* extension;
    const char* name;  // as ffmpeg calls it
    std::vector<std::string> words;
};

// Which codec it is, is left to ffmpeg, as not every one has every codec.
const std::array<VideoFormat, 5>& video_formats() {
    const std::vector<std::string> video = {"-vf",
                                            "scale=out_color_matrix=bt709:out_range=tv",
                                            "-pix_fmt",
                                            "yuv420p",
                                            "-colorspace",
                                            "bt709",
                                            "-color_trc",
                                            "bt709",
                                            "-crf",
                                            "18",
                                            "-color_primaries",
                                            "bt709"};
    auto for_web = video;
    for_web.insert(for_web.end(), {"-movflags", "+faststart"});
    static const std::array<VideoFormat, 5> formats = {{
        {".mp4", "mp4", for_web},
        {".mov", "mov", for_web},
        {".mkv", "matroska", video},
        {".webm", "webm", video},
        {".gif", "gif", {"-vf", "split[a][b];[a]palettegen[p];[b][p]paletteuse"}},
    }};
    return formats;
}

const VideoFormat* video_format(const fs::path& path) {
    for (const auto& format : video_formats())
        if (path.extension() == format.extension) return &format;
    return nullptr;
}

bool is_pattern(const fs::path& path) { return path.filename().string().find('%') != std::string::npos; }

}  // namespace

Result<VideoOutput> VideoOutput::open(const VideoOptions& options) {
    VideoOutput out(options);
    const fs::path path = options.path;
    if (const auto* format = video_format(path); format && !is_pattern(path)) {
        if (!options.background)
            return fail(ErrorKind::bad_input,
                        "a video cannot be transparent; give --background a colour, or write PNG "
                        "files");
        if ((options.width % 2 != 0 || options.height % 2 != 0) && std::string_view(format->name) != "gif")
            return fail(ErrorKind::bad_input, "the width and the height of a video must be even");
        if (auto ok = out.start_ffmpeg(); !ok) return tl::unexpected(ok.error());
        return out;
    }
    auto names = output_names(options.path, ".png");
    if (!names) return tl::unexpected(names.error());
    if (names->one_file || output_path(*names, 0).extension() != ".png")
        return fail(ErrorKind::unsupported,
                    options.path +
                        ": give the name of a video (.mp4, .mov, .mkv, .webm, .gif), or a folder or a pattern "
                        "such as frames/%05d.png for PNG files");
    std::error_code error;
    if (!names->folder.empty()) fs::create_directories(names->folder, error);
    if (error) return fail(ErrorKind::bad_input, names->folder.string() + " cannot be made: " + error.message());
    out.pictures_ = std::move(*names);
    return out;
}

Result<void> VideoOutput::start_ffmpeg() {
    const fs::path path = options_.path;
    const auto* format = video_format(path);
    // Made here, so that a place that cannot be written to is told of before ffmpeg complains in its own words.
    auto file = OutputFile::create(path);
    if (!file) return tl::unexpected(file.error());
    video_.emplace(std::move(*file));
    std::vector<std::string> words = {options_.ffmpeg,
                                      "-y",
                                      "-loglevel",
                                      "error",
                                      "-f",
                                      "rawvideo",
                                      "-pix_fmt",
                                      "rgb24",
                                      "-s",
                                      fmt::format("{}x{}", options_.width, options_.height),
                                      "-r",
                                      fmt::format("{}/{}", options_.rate.numerator, options_.rate.denominator),
                                      "-i",
                                      "pipe:0"};
    words.insert(words.end(), format->words.begin(), format->words.end());
    words.insert(words.end(), {"-f", format->name, "file:" + video_->written_at().string()});
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) return tl::unexpected(write_error("a pipe to ffmpeg", errno));
    // An ffmpeg that ends early is an error of write(), not the end of this program.
    std::signal(SIGPIPE, SIG_IGN);
    ffmpeg_ = start_program(words, {ends[0], no_stream, our_stream});
    ::close(ends[0]);
    pipe_ = ends[1];
    if (ffmpeg_ != 0) return {};
    close_pipe();
    return fail(
        ErrorKind::unsupported,
        fmt::format("the program {} was not found, which makes videos: install ffmpeg or name one (--ffmpeg), or "
                    "give a folder or a pattern such as {}/%05d.png for PNG files",
                    options_.ffmpeg, path.stem().string()));
}

VideoOutput::VideoOutput(VideoOutput&& other) noexcept
    : options_(std::move(other.options_)),
      pictures_(std::move(other.pictures_)),
      written_(other.written_),
      video_(std::move(other.video_)),
      pipe_(std::exchange(other.pipe_, -1)),
      ffmpeg_(std::exchange(other.ffmpeg_, 0)) {}

void VideoOutput::close_pipe() {
    if (pipe_ >= 0) ::close(pipe_);
    pipe_ = -1;
}

VideoOutput::~VideoOutput() {
    if (ffmpeg_ == 0) return;
    ::kill(ffmpeg_, SIGKILL);
    close_pipe();
    ends_well(ffmpeg_);
}

Result<void> VideoOutput::write(const SmoothPicture& picture) {
    if (pictures_) {
        const auto png = png_of(picture, options_.background);
        if (!png) return tl::unexpected(png.error());
        return write_file(output_path(*pictures_, written_++), *png);
    }
    const auto pixels = on_background(picture, *options_.background);
    for (std::size_t sent = 0; sent < pixels.size();) {
        const auto count = ::write(pipe_, pixels.data() + sent, pixels.size() - sent);
        if (count > 0)
            sent += static_cast<std::size_t>(count);
        else if (errno != EINTR)
            return fail(ErrorKind::bad_input, options_.path + ": ffmpeg ended early; it says why above");
    }
    return {};
}

Result<void> VideoOutput::finish() {
    if (pictures_) return {};
    close_pipe();
    if (ends_well(std::exchange(ffmpeg_, 0))) return video_->finish();
    return fail(ErrorKind::bad_input, options_.path + ": ffmpeg could not make it; it says why above");
}

}  // namespace htvm::app
