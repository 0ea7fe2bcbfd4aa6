// In place of image_png.cpp, image_jpeg.cpp and image_webp.cpp where there are no libpng, libjpeg-turbo and libwebp.
#include "io/image_file.h"
#include "io/image_jpeg.h"
#include "io/image_png.h"
#include "io/image_webp.h"

namespace htvm {
namespace {

tl::unexpected<Error> without(const std::string& what) {
    return fail(ErrorKind::unsupported, "this htvm was built without PNG, JPEG and WebP images, so it cannot " + what);
}

}  // namespace

namespace internal {

Result<Image> read_png_image(std::span<const std::uint8_t>, int, std::string*) { return without("read this PNG"); }
Result<Image> read_jpeg_image(std::span<const std::uint8_t>, int, std::string*) { return without("read this JPEG"); }
Result<Image> read_webp_image(std::span<const std::uint8_t>, int) { return without("read this WebP image"); }

}  // namespace internal

Result<std::vector<std::uint8_t>> write_png_image(const Image&) { return without("write a PNG"); }
Result<std::vector<std::uint8_t>> write_jpeg_image(const Image&, int) { return without("write a JPEG"); }

}  // namespace htvm
