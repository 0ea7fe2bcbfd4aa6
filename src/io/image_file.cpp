#include "io/image_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "io/image_bitmap.h"
#include "io/image_dds.h"
#include "io/image_format.h"
#include "io/image_jpeg.h"
#include "io/image_png.h"
#include "io/image_webp.h"
#include "io/mesh_file.h"

namespace htvm {

using namespace internal;

namespace internal {

tl::unexpected<Error> damaged_image(const char* format, const std::string& why) {
    return fail(ErrorKind::bad_input,
                std::string("the ") + format + " image is damaged or cut off (" + why + "); save it or copy it again");
}

tl::unexpected<Error> image_not_read(const std::string& what) {
    return fail(ErrorKind::unsupported, "the image " + what +
                                            ", which is not read; save it with 8 bits a channel, as "
                                            "red, green and blue");
}

Result<void> check_image_size(std::uint64_t width, std::uint64_t height, int largest_side) {
    const auto most = static_cast<std::uint64_t>(largest_side);
    if (width == 0 || height == 0) return fail(ErrorKind::bad_input, "the image has no pixels; save it again");
    if (width <= most && height <= most) return {};
    return fail(ErrorKind::limit, "the image has " + std::to_string(width) + " x " + std::to_string(height) +
                                      " pixels, more than " + std::to_string(most) + " x " + std::to_string(most) +
                                      "; make it smaller");
}

double share_missing(const Image& image, std::size_t channels, const BlockSize& block, std::uint8_t level) {
    const auto width = static_cast<std::size_t>(image.width);
    const auto is_missing = [&](int left, int top) {
        const int right = std::min(left + block.width, image.width) - block.border;
        const int bottom = std::min(top + block.height, image.height) - block.border;
        for (int y = top + block.border; y < bottom; ++y)
            for (int x = left + block.border; x < right; ++x) {
                const auto at = channels * (width * static_cast<std::size_t>(y) + static_cast<std::size_t>(x));
                for (std::size_t c = 0; c < channels; ++c)
                    if (image.rgb[at + c] != level) return false;
            }
        return true;
    };
    const int across = (image.width - 1) / block.width + 1, down = (image.height - 1) / block.height + 1;
    std::int64_t last = std::int64_t{across} * down;
    const std::int64_t all = last;
    while (last > 0 && is_missing(static_cast<int>((last - 1) % across) * block.width,
                                  static_cast<int>((last - 1) / across) * block.height))
        --last;
    return static_cast<double>(all - last) / static_cast<double>(all);
}

Result<std::string> damage_of(const char* format, double missing, const std::string& why) {
    if (missing > 0.5) return damaged_image(format, why);
    if (missing == 0) return "is damaged (" + why + ") and shows that";
    const auto percent = std::max(1L, std::lround(100 * missing));
    return "is cut off: the last " + std::to_string(percent) + " % of it are grey or black";
}

Image without_alpha(int width, int height, std::vector<std::uint8_t> rgba) {
    for (std::size_t p = 0; 4 * p < rgba.size(); ++p) std::memmove(&rgba[3 * p], &rgba[4 * p], 3);
    rgba.resize(rgba.size() / 4 * 3);
    return {width, height, std::move(rgba)};
}

}  // namespace internal

namespace {

constexpr std::uint8_t png_signature[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};

bool begins_with(std::span<const std::uint8_t> bytes, std::span<const std::uint8_t> what) {
    return bytes.size() >= what.size() && std::equal(what.begin(), what.end(), bytes.begin());
}

bool is_webp(std::span<const std::uint8_t> bytes) {
    return bytes.size() >= 12 && std::memcmp(bytes.data(), "RIFF", 4) == 0 &&
           std::memcmp(bytes.data() + 8, "WEBP", 4) == 0;
}

}  // namespace

Result<Image> read_image(std::span<const std::uint8_t> bytes, int largest_side, std::string* damage) {
    constexpr std::uint8_t jpeg_begins[] = {0xff, 0xd8, 0xff};
    if (damage) damage->clear();
    if (begins_with(bytes, png_signature)) return read_png_image(bytes, largest_side, damage);
    if (begins_with(bytes, jpeg_begins)) return read_jpeg_image(bytes, largest_side, damage);
    if (is_webp(bytes)) return read_webp_image(bytes, largest_side);
    if (is_dds(bytes)) return read_dds_image(bytes, largest_side);
    if (is_bmp(bytes)) return read_bmp_image(bytes, largest_side);
    if (bytes.empty()) return fail(ErrorKind::bad_input, "the image is empty; save it or copy it again");
    if (const auto format = unread_format(bytes); !format.empty())
        return fail(ErrorKind::unsupported, "this is " + format + ", which is not read; save it as PNG or JPEG");
    if (is_tga(bytes)) return read_tga_image(bytes, largest_side);
    return fail(ErrorKind::bad_input, "this is no PNG, JPEG or WebP image; save it as one of them");
}

Result<Image> read_image_file(const std::filesystem::path& path, int largest_side, std::string* damage) {
    constexpr std::uint64_t most_bytes = std::uint64_t{1} << 31;  // a bitmap of the largest size has half of that
    const auto bytes = read_file(path, most_bytes);
    if (!bytes) return tl::unexpected(bytes.error());
    auto image = read_image(*bytes, largest_side, damage);
    if (!image) return fail(image.error().kind, path.string() + ": " + image.error().message);
    return image;
}

}  // namespace htvm
