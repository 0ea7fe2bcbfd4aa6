// Pictures as H.264, by whatever ffmpeg there is on the machine: for browsers that decode neither AV1 nor VP9.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <cstdio>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "htvm/picture_encoder.hpp"
#include "htvm/picture_planes.hpp"
#include "htvm/result.hpp"

namespace htvm::app {

struct H264Options {
    std::string ffmpeg = "ffmpeg";        // the program, which needs libx264
    std::uint32_t width = 0, height = 0;  // pixels, both even
    double frames_per_second = 30;
    double quantiser = 26;  // 0..51, how coarse pictures are: libx264's constant rate factor
};

// Takes pictures as PictureEncoder does, and gives those from one key picture to the next once the latter comes: each
// key picture begins another run of ffmpeg, so that pictures from one on are coded alike wherever the stream begins.
class H264Pictures {
public:
    explicit H264Pictures(H264Options options) : options_(std::move(options)) {}
    H264Pictures(H264Pictures&&) noexcept;
    H264Pictures& operator=(H264Pictures&&) = delete;
    ~H264Pictures();

    // unsupported: there is no ffmpeg, or it has no libx264.
    Result<void> push(const PicturePlanes& picture, bool key);
    Result<void> finish();
    // Planes of BT.709 in limited range; the first is a key picture.
    std::optional<CodedPicture> pull();

private:
    struct Close {
        void operator()(std::FILE* file) const { std::fclose(file); }
    };
    using File = std::unique_ptr<std::FILE, Close>;
    Result<void> begin();
    Result<void> end();
    tl::unexpected<Error> ended_early();

    H264Options options_;
    pid_t ffmpeg_ = 0;
    int pipe_ = -1;
    File coded_, said_;
    std::size_t pushed_ = 0;  // since the last key picture
    std::deque<CodedPicture> ready_;
};

// The access units of a byte stream of H.264 whose access units begin with delimiters (ITU-T H.264, annex B): NAL units
// that say how the picture is decoded, each behind its size in four bytes. Units of other kinds, such as delimiters and
// what a coder says of itself, are left out.
std::vector<CodedPicture> h264_access_units(std::span<const std::uint8_t> byte_stream);

}  // namespace htvm::app
