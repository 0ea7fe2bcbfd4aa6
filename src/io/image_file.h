// Image files: PNG, JPEG and WebP, read by libpng, libjpeg-turbo and libwebp; BMP and TGA (image_bitmap.h); DDS
// (image_dds.h). What comes out is 8 bits a channel, red, green and blue, as browsers show the image: grey ones become
// coloured, 16 bits are rounded, the gamma of a PNG is applied unless it is that of sRGB, and the inks of a CMYK JPEG
// become light. Two things are other than there: an alpha channel is left out, since what lies below it is the colour
// that a texture means, and the orientation that a camera notes beside the pixels (EXIF) is passed over, since texture
// coordinates are about the pixels as they lie in the file.
//
// For untrusted files: the size in the header is compared with the limit before anything is allocated for it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/image.h"
#include "htvm/result.hpp"

namespace htvm {

// The largest side of an image that a texture may be made from: photogrammetry writes 8192 and 16384.
inline constexpr int largest_image_side_read = 16384;

// The content decides the format, whatever the file is called. A JPEG or PNG that is cut off is read as long as more
// than half of it is there, the rest grey or black; a JPEG that is damaged otherwise is read as far as it goes;
// `damage` then takes a clause that says so ("is cut off: ..."), and is empty otherwise. Errors: bad_input if the image
// is too damaged or of no known format; unsupported, naming it, for a format or kind that is not read; limit if a side
// is longer than `largest_side`.
Result<Image> read_image(std::span<const std::uint8_t> bytes, int largest_side = largest_image_side,
                         std::string* damage = nullptr);

// The same of a file. Every error message begins with its name.
Result<Image> read_image_file(const std::filesystem::path& path, int largest_side = largest_image_side,
                              std::string* damage = nullptr);

// The extensions that images are looked for under, best first, in lower case.
inline constexpr const char* image_extensions[] = {".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tga", ".dds"};

// Files of an image; quality: 1..100. The image must not be empty. Fails (bad_input) with what the library says.
Result<std::vector<std::uint8_t>> write_png_image(const Image& image);
Result<std::vector<std::uint8_t>> write_jpeg_image(const Image& image, int quality = 92);

// ---- For the readers of single formats ------------------------------------------------------------------------------

namespace internal {

tl::unexpected<Error> damaged_image(const char* format, const std::string& why);
// what: "has 32 bits a channel".
tl::unexpected<Error> image_not_read(const std::string& what);
// Nothing is allocated before. Fails (limit) above, (bad_input) for an image without pixels.
Result<void> check_image_size(std::uint64_t width, std::uint64_t height, int largest_side);
// How much of an image was never decoded, 0..1, as it comes in blocks from the upper left: those at its end of which
// all channels of all pixels have that level.
struct BlockSize {
    int width = 1, height = 1;
    int border = 0;  // pixels at the edges of a block that neighbours reach into
};
double share_missing(const Image& image, std::size_t channels, const BlockSize& block, std::uint8_t level);
// What `damage` says of an image that lacks so much. Fails (bad_input) if that is more than half.
Result<std::string> damage_of(const char* format, double missing, const std::string& why);
// Leaves out the fourth channel, in place: of a large image there is no room for two.
Image without_alpha(int width, int height, std::vector<std::uint8_t> rgba);

}  // namespace internal
}  // namespace htvm
