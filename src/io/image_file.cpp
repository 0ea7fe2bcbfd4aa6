#include "io/image_file.h"

#include <png.h>
#include <turbojpeg.h>
#include <webp/decode.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <string>

#include "io/mesh_file.h"

namespace htvm {

namespace {

tl::unexpected<Error> damaged(const char* format, const std::string& why) {
    return fail(ErrorKind::bad_input,
                std::string("the ") + format + " image is damaged or cut off (" + why + "); save it or copy it again");
}

tl::unexpected<Error> not_read(const std::string& what) {
    return fail(ErrorKind::unsupported, "the image " + what +
                                            ", which is not read; save it with 8 bits a channel, as "
                                            "red, green and blue");
}

std::size_t bytes_of(int width, int height, std::size_t channels) {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * channels;
}

// Nothing is allocated before.
Result<void> check_size(std::uint64_t width, std::uint64_t height, int largest_side) {
    const auto most = static_cast<std::uint64_t>(largest_side);
    if (width <= most && height <= most) return {};
    return fail(ErrorKind::limit, "the image has " + std::to_string(width) + " x " + std::to_string(height) +
                                      " pixels, more than " + std::to_string(most) + " x " + std::to_string(most) +
                                      "; make it smaller");
}

// Leaves out the fourth channel.
Image without_alpha(int width, int height, const std::vector<std::uint8_t>& rgba) {
    Image out{width, height, std::vector<std::uint8_t>(rgba.size() / 4 * 3)};
    for (std::size_t p = 0; 4 * p < rgba.size(); ++p) std::memcpy(&out.rgb[3 * p], &rgba[4 * p], 3);
    return out;
}

constexpr std::uint8_t png_signature[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};

bool begins_with(std::span<const std::uint8_t> bytes, std::span<const std::uint8_t> what) {
    return bytes.size() >= what.size() && std::equal(what.begin(), what.end(), bytes.begin());
}

Result<Image> read_png(std::span<const std::uint8_t> bytes, int largest_side) {
    png_image png;
    std::memset(&png, 0, sizeof png);
    png.version = PNG_IMAGE_VERSION;
    const auto failed = [&] {
        const std::string why = png.message;
        png_image_free(&png);
        return damaged("PNG", why);
    };
    if (!png_image_begin_read_from_memory(&png, bytes.data(), bytes.size())) return failed();
    constexpr std::size_t depth_at = 24;  // within the first chunk, IHDR, which has been read
    auto ok = check_size(png.width, png.height, largest_side);
    if (ok && bytes[depth_at] > 8) ok = not_read("has 16 bits a channel");
    if (!ok) {
        png_image_free(&png);
        return tl::unexpected(ok.error());
    }
    png.format = PNG_FORMAT_RGBA;
    const int width = static_cast<int>(png.width), height = static_cast<int>(png.height);
    std::vector<std::uint8_t> rgba(bytes_of(width, height, 4));
    if (!png_image_finish_read(&png, nullptr, rgba.data(), 0, nullptr)) return failed();
    png_image_free(&png);
    return without_alpha(width, height, rgba);
}

struct Destroy {
    void operator()(void* handle) const { tjDestroy(handle); }
};
using TurboJpeg = std::unique_ptr<void, Destroy>;

Result<Image> read_jpeg(std::span<const std::uint8_t> bytes, int largest_side) {
    const TurboJpeg jpeg(tjInitDecompress());
    if (!jpeg) return fail(ErrorKind::limit, "there is no memory for reading a JPEG image");
    const auto size = static_cast<unsigned long>(bytes.size());
    int width = 0, height = 0, subsampling = 0, colours = 0;
    if (tjDecompressHeader3(jpeg.get(), bytes.data(), size, &width, &height, &subsampling, &colours) != 0)
        return damaged("JPEG", tjGetErrorStr2(jpeg.get()));
    if (width < 1 || height < 1) return damaged("JPEG", "it ends within its header");
    if (auto ok = check_size(static_cast<std::uint64_t>(width), static_cast<std::uint64_t>(height), largest_side); !ok)
        return tl::unexpected(ok.error());
    if (colours == TJCS_CMYK || colours == TJCS_YCCK) return not_read("has the colours of printing (CMYK)");
    Image out{width, height, std::vector<std::uint8_t>(bytes_of(width, height, 3))};
    // A file that is cut off only warns, and so does one with many more scans than a picture needs.
    constexpr int flags = TJFLAG_ACCURATEDCT | TJFLAG_STOPONWARNING | TJFLAG_LIMITSCANS;
    if (tjDecompress2(jpeg.get(), bytes.data(), size, out.rgb.data(), width, 3 * width, height, TJPF_RGB, flags) != 0)
        return damaged("JPEG", tjGetErrorStr2(jpeg.get()));
    return out;
}

bool is_webp(std::span<const std::uint8_t> bytes) {
    return bytes.size() >= 12 && std::memcmp(bytes.data(), "RIFF", 4) == 0 &&
           std::memcmp(bytes.data() + 8, "WEBP", 4) == 0;
}

Result<Image> read_webp(std::span<const std::uint8_t> bytes, int largest_side) {
    WebPBitstreamFeatures features;
    if (WebPGetFeatures(bytes.data(), bytes.size(), &features) != VP8_STATUS_OK)
        return damaged("WebP", "its header cannot be read");
    if (auto ok = check_size(static_cast<std::uint64_t>(features.width), static_cast<std::uint64_t>(features.height),
                             largest_side);
        !ok)
        return tl::unexpected(ok.error());
    if (features.has_animation) return not_read("is an animation");
    std::vector<std::uint8_t> rgba(bytes_of(features.width, features.height, 4));
    if (!WebPDecodeRGBAInto(bytes.data(), bytes.size(), rgba.data(), rgba.size(), 4 * features.width))
        return damaged("WebP", "its pixels cannot be read");
    return without_alpha(features.width, features.height, rgba);
}

}  // namespace

Result<Image> read_image(std::span<const std::uint8_t> bytes, int largest_side) {
    constexpr std::uint8_t jpeg_begins[] = {0xff, 0xd8, 0xff};
    if (begins_with(bytes, png_signature)) return read_png(bytes, largest_side);
    if (begins_with(bytes, jpeg_begins)) return read_jpeg(bytes, largest_side);
    if (is_webp(bytes)) return read_webp(bytes, largest_side);
    if (bytes.empty()) return fail(ErrorKind::bad_input, "the image is empty; save it or copy it again");
    return fail(ErrorKind::bad_input, "this is no PNG, JPEG or WebP image; save it as one of them");
}

Result<Image> read_image_file(const std::filesystem::path& path) {
    constexpr std::uint64_t most_bytes = std::uint64_t{1} << 28;
    const auto bytes = read_file(path, most_bytes);
    if (!bytes) return tl::unexpected(bytes.error());
    auto image = read_image(*bytes);
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
