// In place of texture_video.cpp where images are left out: pictures of a video come from the program ffmpeg as images
// do.
#include "io/texture_video.h"

namespace htvm {
namespace {

tl::unexpected<Error> without_video(const std::filesystem::path& path) {
    return fail(ErrorKind::unsupported,
                path.string() + ": this htvm was built without image files, so it cannot read videos");
}

}  // namespace

class TextureVideo::Decoding {};

Result<TextureVideo> TextureVideo::open(const std::filesystem::path& path, const std::string&) {
    return without_video(path);
}
TextureVideo::TextureVideo(const TextureVideo& other) : path_(other.path_), ffmpeg_(other.ffmpeg_) {}
TextureVideo::TextureVideo(TextureVideo&&) noexcept = default;
TextureVideo& TextureVideo::operator=(TextureVideo other) noexcept {
    std::swap(path_, other.path_);
    return *this;
}
TextureVideo::~TextureVideo() = default;
Result<Image> TextureVideo::picture(std::size_t) { return without_video(path_); }

}  // namespace htvm
