#include "io/image_file.h"

#include <png.h>
#include <turbojpeg.h>
#include <webp/decode.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <utility>

#include "io/image_bitmap.h"
#include "io/image_dds.h"
#include "io/image_format.h"
#include "io/image_jpeg.h"
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

}  // namespace internal

namespace {

std::size_t bytes_of(int width, int height, std::size_t channels) {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * channels;
}

// Leaves out the fourth channel, in place: of a large image there is no room for two.
Image without_alpha(int width, int height, std::vector<std::uint8_t> rgba) {
    for (std::size_t p = 0; 4 * p < rgba.size(); ++p) std::memmove(&rgba[3 * p], &rgba[4 * p], 3);
    rgba.resize(rgba.size() / 4 * 3);
    return {width, height, std::move(rgba)};
}

constexpr std::uint8_t png_signature[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};

bool begins_with(std::span<const std::uint8_t> bytes, std::span<const std::uint8_t> what) {
    return bytes.size() >= what.size() && std::equal(what.begin(), what.end(), bytes.begin());
}

Result<Image> read_png(std::span<const std::uint8_t> bytes, int largest_side, std::string* damage) {
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
    Image rgba{width, height, std::vector<std::uint8_t>(bytes_of(width, height, 4))};
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

struct Destroy {
    void operator()(void* handle) const { tjDestroy(handle); }
};
using TurboJpeg = std::unique_ptr<void, Destroy>;

bool is_webp(std::span<const std::uint8_t> bytes) {
    return bytes.size() >= 12 && std::memcmp(bytes.data(), "RIFF", 4) == 0 &&
           std::memcmp(bytes.data() + 8, "WEBP", 4) == 0;
}

Result<Image> read_webp(std::span<const std::uint8_t> bytes, int largest_side) {
    WebPBitstreamFeatures features;
    if (WebPGetFeatures(bytes.data(), bytes.size(), &features) != VP8_STATUS_OK)
        return damaged_image("WebP", "its header cannot be read");
    if (auto ok = check_image_size(static_cast<std::uint64_t>(features.width),
                                   static_cast<std::uint64_t>(features.height), largest_side);
        !ok)
        return tl::unexpected(ok.error());
    if (features.has_animation) return image_not_read("is an animation");
    std::vector<std::uint8_t> rgba(bytes_of(features.width, features.height, 4));
    if (!WebPDecodeRGBAInto(bytes.data(), bytes.size(), rgba.data(), rgba.size(), 4 * features.width))
        return damaged_image("WebP", "its pixels cannot be read");
    return without_alpha(features.width, features.height, std::move(rgba));
}

}  // namespace

Result<Image> read_image(std::span<const std::uint8_t> bytes, int largest_side, std::string* damage) {
    constexpr std::uint8_t jpeg_begins[] = {0xff, 0xd8, 0xff};
    if (damage) damage->clear();
    if (begins_with(bytes, png_signature)) return read_png(bytes, largest_side, damage);
    if (begins_with(bytes, jpeg_begins)) return read_jpeg_image(bytes, largest_side, damage);
    if (is_webp(bytes)) return read_webp(bytes, largest_side);
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

Result<std::vector<std::uint8_t>> write_jpeg_image(const Image& image, int quality) {
    const TurboJpeg jpeg(tjInitCompress());
    std::vector<std::uint8_t> out(tjBufSize(image.width, image.height, TJSAMP_420));
    unsigned long size = static_cast<unsigned long>(out.size());
    unsigned char* to = out.data();
    if (!jpeg || tjCompress2(jpeg.get(), image.rgb.data(), image.width, 3 * image.width, image.height, TJPF_RGB, &to,
                             &size, TJSAMP_420, quality, TJFLAG_ACCURATEDCT | TJFLAG_NOREALLOC) != 0)
        return fail(ErrorKind::bad_input,
                    "the image cannot be written: " +
                        std::string(jpeg ? tjGetErrorStr2(jpeg.get()) : "there is no memory for it"));
    out.resize(size);
    return out;
}

}  // namespace htvm
