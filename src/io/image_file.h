// Image files: PNG, JPEG and WebP, with 8 bits a channel, read by libpng, libjpeg-turbo and libwebp. Grey ones become
// coloured; an alpha channel is left out, since what lies below it is the colour that a texture means.
//
// For untrusted files: the size in the header is compared with the limit before anything is allocated for it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "core/image.h"
#include "htvm/result.hpp"

namespace htvm {

// The first bytes decide the format, whatever the file is called. Errors: bad_input if the image is damaged, cut off or
// of another format; unsupported for 16 bits, CMYK and animations; limit if a side is longer than `largest_side`.
Result<Image> read_image(std::span<const std::uint8_t> bytes, int largest_side = largest_image_side);

// The same of a file. Every error message begins with its name.
Result<Image> read_image_file(const std::filesystem::path& path);

// The extensions that images are looked for under, best first, in lower case.
inline constexpr const char* image_extensions[] = {".png", ".jpg", ".jpeg", ".webp"};

// Files of an image; quality: 1..100. The image must not be empty. Fails (bad_input) with what the library says.
Result<std::vector<std::uint8_t>> write_png_image(const Image& image);
Result<std::vector<std::uint8_t>> write_jpeg_image(const Image& image, int quality = 92);

}  // namespace htvm
