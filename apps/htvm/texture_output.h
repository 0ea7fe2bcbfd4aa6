// The pictures of a textured stream as image files beside its meshes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "htvm/packet.hpp"
#include "htvm/picture_decoder.hpp"
#include "htvm/result.hpp"

namespace htvm::app {

// A decoder of pictures that reads image files too, with as many threads as there are cores.
PictureDecoder picture_decoder();

// The picture that a frame shows, as a file.
struct ImageFile {
    std::shared_ptr<const std::vector<std::uint8_t>> bytes;  // the same memory while the picture is the same
    const char* extension = ".png";
};

enum class ImageFormat : std::uint8_t { png, jpeg };

class TextureOutput {
public:
    // format: of pictures that are no image files already.
    explicit TextureOutput(ImageFormat format = ImageFormat::png) : format_(format), decoder_(picture_decoder()) {}
    // A packet of a picture, or the sequence header of another sequence. What cannot be decoded is told as a warning,
    // once in a row; the last picture stays.
    void take(const Packet& packet);
    void begin_sequence();
    // The last picture; bytes are null before the first. Made when it is asked for.
    Result<ImageFile> image();
    // How many could not be decoded.
    std::size_t lost() const { return lost_; }

private:
    ImageFormat format_;
    PictureDecoder decoder_;
    ImageFile file_;
    bool stale_ = false;  // there is a newer picture than file_ has
    bool told_ = false;
    std::size_t lost_ = 0;
};

}  // namespace htvm::app
