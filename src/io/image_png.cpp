#include "io/image_png.h"

#include <png.h>

#include <cstring>
#include <utility>
#include <vector>

#include "io/image_file.h"

namespace htvm {
namespace internal {

Result<Image> read_png_image(std::span<const std::uint8_t> bytes, int largest_side, std::string* damage) {
    png_image png;
    std::memset(&png, 0, sizeof png);
    png.version = PNG_IMAGE_VERSION;
    if (!png_image_begin_read_from_memory(&png, bytes.data(), bytes.size())) {
        const std::string why = png.message;
        png_image_free(&png);
        return damaged_image("PNG", why);
    }
    if (auto ok = check_image_size(png.width, png.height, largest_side); !ok) {
        png_image_free(&png);
        return tl::unexpected(ok.error());
    }
    png.format = PNG_FORMAT_RGBA;
    png.flags |= PNG_IMAGE_FLAG_16BIT_sRGB;    // where the file says no gamma
    constexpr std::size_t interlaced_at = 28;  // within the first chunk, IHDR, which has been read
    const bool is_interlaced = bytes[interlaced_at] != 0;
    const int width = static_cast<int>(png.width), height = static_cast<int>(png.height);
    Image rgba{width, height,
               std::vector<std::uint8_t>(4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))};
    if (!png_image_finish_read(&png, nullptr, rgba.rgb.data(), 0, nullptr)) {
        const std::string why = png.message;
        // Rows that were read are there, up to the last one; those of an interlaced image have holes.
        const double missing = is_interlaced ? 1 : share_missing(rgba, 4, {width, 1}, 0);
        auto said = damage_of("PNG", missing, why);
        if (!said) return tl::unexpected(said.error());
        if (damage && missing > 0) *damage = std::move(*said);
    }
    png_image_free(&png);
    return without_alpha(width, height, std::move(rgba.rgb));
}

}  // namespace internal

Result<std::vector<std::uint8_t>> write_png_image(const Image& image) {
    png_image png;
    std::memset(&png, 0, sizeof png);
    png.version = PNG_IMAGE_VERSION;
    png.width = static_cast<png_uint_32>(image.width);
    png.height = static_cast<png_uint_32>(image.height);
    png.format = PNG_FORMAT_RGB;
    png.flags = PNG_IMAGE_FLAG_FAST;
    std::vector<std::uint8_t> out(PNG_IMAGE_PNG_SIZE_MAX(png));
    png_alloc_size_t size = out.size();
    if (!png_image_write_to_memory(&png, out.data(), &size, 0, image.rgb.data(), 0, nullptr))
        return fail(ErrorKind::bad_input, "the image cannot be written: " + std::string(png.message));
    out.resize(size);
    return out;
}

}  // namespace htvm
