// A video as the texture of a capture: its pictures one after the other, decoded by the program ffmpeg.
//
// For untrusted files: ffmpeg is kept to this one file, and what it says of sizes is compared with the limit before
// anything is allocated.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "core/image.h"
#include "htvm/result.hpp"

namespace htvm {

inline constexpr const char* video_extensions[] = {".mp4",  ".m4v", ".mov", ".mkv",
                                                   ".webm", ".avi", ".mpg", ".y4m"};  // lower case

// Whether a file with this name is taken for a video.
bool is_video_file_name(const std::filesystem::path& path);

class TextureVideo {
public:
    // Decodes the first picture, for the size of all. Fails with unsupported if there is no such program, bad_input if
    // it makes no picture of the file, limit if the pictures are too large.
    static Result<TextureVideo> open(const std::filesystem::path& path, const std::string& ffmpeg = "ffmpeg");
    // A copy decodes by itself, from the first picture on.
    TextureVideo(const TextureVideo& other);
    TextureVideo(TextureVideo&& other) noexcept;
    TextureVideo& operator=(TextureVideo other) noexcept;
    ~TextureVideo();

    // The picture of this number, from 0. Those between it and the one before are passed over; an earlier one takes
    // decoding from the start. Fails (bad_input) behind the last one, at one that is damaged or of another size, and
    // for all that follow.
    Result<Image> picture(std::size_t number);
    const std::filesystem::path& path() const { return path_; }

private:
    class Decoding;
    TextureVideo() = default;
    Result<void> begin();
    Error end_of(Decoding& decoding) const;

    std::filesystem::path path_;
    std::string ffmpeg_;
    int width_ = 0, height_ = 0;
    std::unique_ptr<Decoding> decoding_;  // null: not begun, or at its end
    struct End {
        std::size_t number = 0;  // the first picture that cannot be had
        Error why;
    };
    std::optional<End> end_ = {};
};

}  // namespace htvm
