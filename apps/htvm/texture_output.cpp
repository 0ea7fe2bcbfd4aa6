#include "texture_output.h"

#include <fmt/core.h>

#include <algorithm>

#include "command_line/terminal.h"
#include "htvm/texture.hpp"
#include "io/image_file.h"

namespace htvm::app {

PictureDecoder picture_decoder() {
    PictureDecoderOptions options;
    options.threads = 0;
    options.read_image_file = [](std::span<const std::uint8_t> bytes) { return read_image(bytes); };
    return PictureDecoder(std::move(options));
}

void TextureOutput::begin_sequence() {
    decoder_.reset();
    file_ = {};
    stale_ = false;
}

void TextureOutput::take(const Packet& packet) {
    if (const auto taken = decoder_.decode(packet); !taken) {
        ++lost_;
        if (!std::exchange(told_, true))
            warn(fmt::format("the picture of frame {} is lost: {}; the one before is shown", packet.frame,
                             taken.error().message));
        return;
    }
    told_ = false;
    stale_ = true;
    const auto picture = read_texture_picture(packet);
    const auto& gains = picture->gains;
    const bool as_it_is = !is_video(picture->coder) && picture->coder != PictureCoder::webp &&
                          std::count(gains.begin(), gains.end(), picture_gain_one) == 3;
    if (!as_it_is) return;
    file_.bytes = std::make_shared<const std::vector<std::uint8_t>>(picture->coded.begin(), picture->coded.end());
    file_.extension = picture->coder == PictureCoder::png ? ".png" : ".jpg";
    stale_ = false;
}

Result<ImageFile> TextureOutput::image() {
    if (!std::exchange(stale_, false)) return file_;
    const auto image = decoder_.image();
    auto bytes = format_ == ImageFormat::jpeg ? write_jpeg_image(*image) : write_png_image(*image);
    if (!bytes) return tl::unexpected(bytes.error());
    file_.bytes = std::make_shared<const std::vector<std::uint8_t>>(std::move(*bytes));
    file_.extension = format_ == ImageFormat::jpeg ? ".jpg" : ".png";
    return file_;
}

}  // namespace htvm::app
