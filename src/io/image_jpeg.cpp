#include "io/image_jpeg.h"

#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string_view>
#include <vector>

#include "io/image_file.h"

namespace htvm {
namespace internal {

namespace {

struct Destroy {
    void operator()(void* handle) const { tjDestroy(handle); }
};
using TurboJpeg = std::unique_ptr<void, Destroy>;

bool says(std::string_view message, std::string_view part) { return message.find(part) != message.npos; }

// The first warning is the one that is told.
bool is_harmless(std::string_view warning) {
    return says(warning, "extraneous bytes") || says(warning, "JFIF") || says(warning, "Adobe");
}

constexpr std::array<std::uint8_t, 2> scan_marker{0xff, 0xda}, end_marker{0xff, 0xd9};

bool has_end_marker(std::span<const std::uint8_t> bytes) {
    const auto last_scan = std::find_end(bytes.begin(), bytes.end(), scan_marker.begin(), scan_marker.end());
    return std::search(last_scan, bytes.end(), end_marker.begin(), end_marker.end()) != bytes.end();
}

// Four inks become light: Adobe's programs, and with them all others, store how much of each is missing.
std::vector<std::uint8_t> light_of_inks(const std::vector<std::uint8_t>& inks) {
    std::vector<std::uint8_t> out(inks.size() / 4 * 3);
    for (std::size_t p = 0; 4 * p < inks.size(); ++p)
        for (std::size_t c = 0; c < 3; ++c)
            out[3 * p + c] = static_cast<std::uint8_t>((inks[4 * p + c] * inks[4 * p + 3] + 127) / 255);
    return out;
}

Error error_of(void* jpeg) {
    const std::string why = tjGetErrorStr2(jpeg);
    if (says(why, "nsupported") || says(why, "precision"))
        return image_not_read("is a JPEG of a rare kind (" + why + ")").value();
    return damaged_image("JPEG", why).value();
}

}  // namespace

Result<Image> read_jpeg_image(std::span<const std::uint8_t> bytes, int largest_side, std::string* damage) {
    const TurboJpeg jpeg(tjInitDecompress());
    if (!jpeg) return fail(ErrorKind::limit, "there is no memory for reading a JPEG image");
    // With the marker there, a warning tells whether anything else is missing.
    const bool had_end = has_end_marker(bytes);
    std::vector<std::uint8_t> ended;
    if (!had_end) {
        ended.assign(bytes.begin(), bytes.end());
        ended.insert(ended.end(), end_marker.begin(), end_marker.end());
        bytes = ended;
    }
    const auto size = static_cast<unsigned long>(bytes.size());
    int width = 0, height = 0, subsampling = 0, colours = 0;
    if (tjDecompressHeader3(jpeg.get(), bytes.data(), size, &width, &height, &subsampling, &colours) != 0 &&
        (tjGetErrorCode(jpeg.get()) != TJERR_WARNING || width < 1 || height < 1))
        return tl::unexpected(error_of(jpeg.get()));
    if (width < 1 || height < 1) return damaged_image("JPEG", "it ends within its header");
    if (auto ok = check_image_size(static_cast<std::uint64_t>(width), static_cast<std::uint64_t>(height), largest_side);
        !ok)
        return tl::unexpected(ok.error());
    const bool has_inks = colours == TJCS_CMYK || colours == TJCS_YCCK;
    const int channels = has_inks ? 4 : 3;
    Image out{width, height,
              std::vector<std::uint8_t>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                                        static_cast<std::size_t>(channels))};
    // Many more scans than a picture needs, which take long to decode, are an error.
    constexpr int flags = TJFLAG_ACCURATEDCT | TJFLAG_LIMITSCANS;
    const int result = tjDecompress2(jpeg.get(), bytes.data(), size, out.rgb.data(), width, channels * width, height,
                                     has_inks ? TJPF_CMYK : TJPF_RGB, flags);
    if (result != 0 && tjGetErrorCode(jpeg.get()) != TJERR_WARNING) return tl::unexpected(error_of(jpeg.get()));
    const std::string warning = result != 0 ? tjGetErrorStr2(jpeg.get()) : "";
    if (!warning.empty() && !(is_harmless(warning) && had_end)) {
        constexpr std::uint8_t middle = 128;  // what is not there is decoded as if all coefficients were 0
        const double missing = share_missing(out, static_cast<std::size_t>(channels), {16, 16, 2}, middle);
        auto said = damage_of("JPEG", missing, warning);
        if (!said) return tl::unexpected(said.error());
        if (damage && !(is_harmless(warning) && missing == 0)) *damage = std::move(*said);
    }
    if (has_inks) out.rgb = light_of_inks(out.rgb);
    return out;
}

}  // namespace internal

Result<std::vector<std::uint8_t>> write_jpeg_image(const Image& image, int quality) {
    const internal::TurboJpeg jpeg(tjInitCompress());
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
