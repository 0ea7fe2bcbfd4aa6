// PNG, JPEG, WebP, BMP, TGA and DDS images: must give all pixels of an image within the limit, or an error. Written and
// read again, a PNG is the same.
#include <string>

#include "fuzz_input.h"
#include "io/image_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    constexpr int largest_side = 256;  // small ones decode fast
    std::string damage;
    const auto image = read_image({data, size}, largest_side, &damage);
    if (!image) return 0;
    fuzz::require(
        image->width > 0 && image->height > 0 && image->width <= largest_side && image->height <= largest_side,
        "an image is within the limit");
    fuzz::require(
        image->rgb.size() == 3 * static_cast<std::size_t>(image->width) * static_cast<std::size_t>(image->height),
        "an image has all of its pixels");
    const auto written = write_png_image(*image);
    fuzz::require(written.has_value(), "what was read can be written");
    const auto again = read_image(*written, largest_side);
    fuzz::require(again && again->rgb == image->rgb, "what was written reads back");
    return 0;
}
