// Pictures as PNG, by libpng.
#include <png.h>

#include <cstring>
#include <string>

#include "metrics/render.h"
#include "metrics/smooth_picture.h"

namespace htvm {

Result<void> write_png(const Picture& picture, const std::string& path) {
    png_image image;
    std::memset(&image, 0, sizeof image);
    image.version = PNG_IMAGE_VERSION;
    image.width = static_cast<png_uint_32>(picture.width);
    image.height = static_cast<png_uint_32>(picture.height);
    image.format = PNG_FORMAT_RGB;
    image.flags = PNG_IMAGE_FLAG_FAST;
    if (!png_image_write_to_file(&image, path.c_str(), 0, picture.rgb.data(), 0, nullptr))
        return fail(ErrorKind::bad_input, "Cannot write the picture " + path + ": " + image.message + ".");
    return {};
}

Result<std::vector<std::uint8_t>> png_of(const SmoothPicture& picture, const std::optional<Colour>& background) {
    const auto pixels = background ? on_background(picture, *background) : picture.rgba;
    png_image image;
    std::memset(&image, 0, sizeof image);
    image.version = PNG_IMAGE_VERSION;
    image.width = static_cast<png_uint_32>(picture.width);
    image.height = static_cast<png_uint_32>(picture.height);
    image.format = background ? PNG_FORMAT_RGB : PNG_FORMAT_RGBA;
    png_alloc_size_t size = 0;
    std::vector<std::uint8_t> out;
    const auto write = [&](void* to) {
        return png_image_write_to_memory(&image, to, &size, 0, pixels.data(), 0, nullptr) != 0;
    };
    bool written = write(nullptr);
    if (written) {
        out.resize(size);
        written = write(out.data());
    }
    if (!written) return fail(ErrorKind::bad_input, "the picture cannot be made: " + std::string(image.message));
    out.resize(size);
    return out;
}

}  // namespace htvm
