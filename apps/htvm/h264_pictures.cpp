#include "h264_pictures.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <utility>

#include "io/child_program.h"

namespace htvm::app {
namespace {

constexpr unsigned slice = 1, key_slice = 5, sequence_parameters = 7, picture_parameters = 8, delimiter = 9;

// Pictures that follow are waited for, some 40 of them, but none refers to one that is shown later, since each packet
// of the stream shows the next picture. One thread, so that the bytes are the same on every machine.
std::vector<std::string> words_of(const H264Options& options) {
    return {options.ffmpeg,
            "-loglevel",
            "error",
            "-f",
            "rawvideo",
            "-pix_fmt",
            "yuv420p",
            "-s",
            fmt::format("{}x{}", options.width, options.height),
            "-framerate",
            fmt::format("{:.6f}", options.frames_per_second),
            "-i",
            "pipe:0",
            "-fps_mode",
            "passthrough",
            "-c:v",
            "libx264",
            "-preset",
            "medium",
            "-profile:v",
            "high",
            "-crf",
            fmt::format("{:.2f}", options.quantiser),
            "-x264-params",
            "threads=1:bframes=0:keyint=infinite:scenecut=0:aud=1:repeat-headers=1:range=tv:colorprim=bt709:"
            "transfer=iec61966-2-1:colormatrix=bt709",
            "-f",
            "h264",
            "pipe:1"};
}

std::vector<std::uint8_t> contents(std::FILE* file) {
    std::vector<std::uint8_t> out;
    std::array<std::uint8_t, 65536> some{};
    std::rewind(file);
    for (std::size_t count; (count = std::fread(some.data(), 1, some.size(), file)) > 0;)
        out.insert(out.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(count));
    return out;
}

}  // namespace

std::vector<CodedPicture> h264_access_units(std::span<const std::uint8_t> bytes) {
    std::vector<CodedPicture> out;
    const auto is_start = [&](std::size_t at) {
        return at + 3 <= bytes.size() && bytes[at] == 0 && bytes[at + 1] == 0 && bytes[at + 2] == 1;
    };
    const auto next_start = [&](std::size_t at) {
        while (at < bytes.size() && !is_start(at)) ++at;
        return at;
    };
    for (auto at = next_start(0); at < bytes.size();) {
        const auto begin = at + 3;
        at = next_start(begin);
        auto unit = bytes.subspan(begin, at - begin);
        while (!unit.empty() && unit.back() == 0) unit = unit.first(unit.size() - 1);  // of the next start
        if (unit.empty()) continue;
        const auto type = unit[0] & 31u;
        if (type == delimiter) out.emplace_back();
        const bool decodes =
            type == slice || type == key_slice || type == sequence_parameters || type == picture_parameters;
        if (!decodes || out.empty()) continue;
        auto& picture = out.back();
        picture.key = picture.key || type == key_slice;
        for (int shift = 24; shift >= 0; shift -= 8)
            picture.bytes.push_back(static_cast<std::uint8_t>(unit.size() >> shift));
        picture.bytes.insert(picture.bytes.end(), unit.begin(), unit.end());
    }
    return out;
}

H264Pictures::H264Pictures(H264Pictures&& other) noexcept
    : options_(std::move(other.options_)),
      ffmpeg_(std::exchange(other.ffmpeg_, 0)),
      pipe_(std::exchange(other.pipe_, -1)),
      coded_(std::move(other.coded_)),
      said_(std::move(other.said_)),
      pushed_(other.pushed_),
      ready_(std::move(other.ready_)) {}

H264Pictures::~H264Pictures() {
    if (ffmpeg_ != 0) ::kill(ffmpeg_, SIGKILL);
    if (pipe_ >= 0) ::close(pipe_);
    if (ffmpeg_ != 0) ends_well(ffmpeg_);
}

Result<void> H264Pictures::begin() {
    std::array<int, 2> ends{};
    coded_.reset(std::tmpfile());
    said_.reset(std::tmpfile());
    if (!coded_ || !said_)
        return fail(ErrorKind::bad_input, "pictures: there is no place for a temporary file (TMPDIR)");
    for (auto* file : {coded_.get(), said_.get()}) ::fcntl(::fileno(file), F_SETFD, FD_CLOEXEC);
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) return fail(ErrorKind::limit, "pictures: too many files are open");
    // An ffmpeg that ends early is an error of write(), not the end of this program.
    std::signal(SIGPIPE, SIG_IGN);
    ffmpeg_ = start_program(words_of(options_), {ends[0], ::fileno(coded_.get()), ::fileno(said_.get())});
    ::close(ends[0]);
    pipe_ = ends[1];
    pushed_ = 0;
    if (ffmpeg_ != 0) return {};
    return fail(ErrorKind::unsupported,
                fmt::format("the program {} was not found, which codes H.264: install ffmpeg, or name one (--ffmpeg); "
                            "--texture-codec vp9 needs none",
                            options_.ffmpeg));
}

tl::unexpected<Error> H264Pictures::ended_early() {
    auto said = contents(said_.get());
    said.resize(std::min<std::size_t>(said.size(), 200));
    std::string line(said.begin(), std::find(said.begin(), said.end(), '\n'));
    std::replace_if(
        line.begin(), line.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    return fail(ErrorKind::unsupported,
                fmt::format("{} codes no H.264 by libx264{}{}; --texture-codec vp9 needs no ffmpeg", options_.ffmpeg,
                            line.empty() ? "" : ": ", line));
}

// All that were given are coded.
Result<void> H264Pictures::end() {
    if (ffmpeg_ == 0) return {};
    ::close(std::exchange(pipe_, -1));
    if (!ends_well(std::exchange(ffmpeg_, 0))) return ended_early();
    auto pictures = h264_access_units(contents(coded_.get()));
    const auto keys = std::count_if(pictures.begin(), pictures.end(), [](const auto& one) { return one.key; });
    if (pictures.size() != pushed_ || keys != 1 || !pictures.front().key) return ended_early();
    std::move(pictures.begin(), pictures.end(), std::back_inserter(ready_));
    return {};
}

Result<void> H264Pictures::push(const PicturePlanes& picture, bool key) {
    if (key || ffmpeg_ == 0) {
        if (auto ended = end(); !ended) return ended;
        if (auto begun = begin(); !begun) return begun;
    }
    std::vector<std::uint8_t> samples;
    for (std::size_t k = 0; k < 3; ++k) {
        const auto width = k == 0 ? picture.width : picture.width / 2,
                   height = k == 0 ? picture.height : picture.height / 2;
        for (std::uint32_t y = 0; y < height; ++y) {
            const auto* row = picture.samples[k] + static_cast<std::ptrdiff_t>(y) * picture.strides[k];
            samples.insert(samples.end(), row, row + width);
        }
    }
    for (std::size_t sent = 0; sent < samples.size();) {
        const auto count = ::write(pipe_, samples.data() + sent, samples.size() - sent);
        if (count > 0) {
            sent += static_cast<std::size_t>(count);
        } else if (errno != EINTR) {
            ::close(std::exchange(pipe_, -1));
            ends_well(std::exchange(ffmpeg_, 0));
            return ended_early();
        }
    }
    ++pushed_;
    return {};
}

Result<void> H264Pictures::finish() { return end(); }

std::optional<CodedPicture> H264Pictures::pull() {
    if (ready_.empty()) return std::nullopt;
    auto out = std::move(ready_.front());
    ready_.pop_front();
    return out;
}

}  // namespace htvm::app
