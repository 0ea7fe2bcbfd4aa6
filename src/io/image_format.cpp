#include "io/image_format.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace htvm::internal {

namespace {

using namespace std::string_view_literals;

struct Mark {
    std::size_t at;
    std::string_view bytes;
    std::string_view name;
};
constexpr std::array marks = {
    Mark{0, "II*\0"sv, "a TIFF image"},
    Mark{0, "MM\0*"sv, "a TIFF image"},
    Mark{0, "II+\0"sv, "a TIFF image"},
    Mark{0, "MM\0+"sv, "a TIFF image"},
    Mark{0, "GIF8"sv, "a GIF image"},
    Mark{0, "\xabKTX"sv, "a KTX image"},
    Mark{0, "sB\x13\0"sv, "a Basis image"},
    Mark{0, "\x13\xab\xa1\x5c"sv, "an ASTC image"},
    Mark{0, "PVR\x03"sv, "a PVR image"},
    Mark{0, "8BPS"sv, "a Photoshop image (PSD)"},
    Mark{0, "\x76\x2f\x31\x01"sv, "an OpenEXR image"},
    Mark{0, "#?RADIANCE"sv, "a Radiance image (HDR)"},
    Mark{0, "#?RGBE"sv, "a Radiance image (HDR)"},
    Mark{0, "\xff\x0a"sv, "a JPEG XL image"},
    Mark{0, "\0\0\0\x0cJXL "sv, "a JPEG XL image"},
    Mark{0, "\0\0\0\x0cjP  "sv, "a JPEG 2000 image"},
    Mark{0, "\xff\x4f\xff\x51"sv, "a JPEG 2000 image"},
    Mark{0, "II\xbc\x01"sv, "a JPEG XR image"},
    Mark{4, "ftypavif"sv, "an AVIF image"},
    Mark{4, "ftypavis"sv, "an AVIF image"},
    Mark{4, "ftyphei"sv, "an HEIC image"},
    Mark{4, "ftyphev"sv, "an HEIC image"},
    Mark{4, "ftypmif1"sv, "an HEIF image"},
    Mark{4, "ftypmsf1"sv, "an HEIF image"},
    Mark{4, "ftyp"sv, "a video"},
    Mark{0, "\0\0\1\0"sv, "a Windows icon"},
    Mark{0, "%PDF"sv, "a PDF document"},
    Mark{0, "<svg"sv, "an SVG drawing"},
    Mark{0, "version https://git-lfs"sv, "a pointer of Git LFS, not the image itself"},
};

// PPM and its like: P1 to P7 and a blank.
bool is_netpbm(std::string_view text) {
    return text.size() > 2 && text[0] == 'P' && text[1] >= '1' && text[1] <= '7' &&
           (text[2] == '\n' || text[2] == ' ' || text[2] == '\r' || text[2] == '\t');
}

}  // namespace

std::string unread_format(std::span<const std::uint8_t> bytes) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    for (const auto& mark : marks)
        if (text.size() > mark.at && text.substr(mark.at).starts_with(mark.bytes)) return std::string(mark.name);
    return is_netpbm(text) ? "a Netpbm image" : "";
}

}  // namespace htvm::internal
