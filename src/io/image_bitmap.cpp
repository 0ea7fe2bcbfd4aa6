#include "io/image_bitmap.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "io/image_file.h"
#include "io/image_masks.h"

namespace htvm::internal {

namespace {

using Bytes = std::span<const std::uint8_t>;

std::vector<std::uint8_t> room_for(int width, int height) {
    return std::vector<std::uint8_t>(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
}

bool is_one_of(std::size_t value, std::initializer_list<std::size_t> values) {
    return std::find(values.begin(), values.end(), value) != values.end();
}

// Turns over what was read from the last row to the first.
void turn_over(Image& image) {
    const auto row = 3 * static_cast<std::ptrdiff_t>(image.width);
    for (auto upper = image.rgb.begin(), lower = image.rgb.end() - row; upper < lower; upper += row, lower -= row)
        std::swap_ranges(upper, upper + row, lower);
}

// ---- BMP ------------------------------------------------------------------------------------------------------------

constexpr std::size_t bmp_file_header = 14;

enum class BmpCoding : std::uint32_t { plain = 0, runs_of_8 = 1, runs_of_4 = 2, masks = 3, masks_and_alpha = 6 };

struct Bmp {
    int width = 0, height = 0;
    bool from_top = false;
    std::size_t bits = 0;
    BmpCoding coding = BmpCoding::plain;
    std::array<std::uint32_t, 3> masks{};
    std::vector<Colour> palette;
    std::size_t pixels_at = 0;
};

tl::unexpected<Error> cut_off(const char* format) { return damaged_image(format, "it ends too early"); }

// The palette behind the header, as many colours as there are bytes and indices for.
void read_bmp_palette(Bytes bytes, std::size_t at, std::size_t count, std::size_t entry, Bmp& out) {
    for (std::size_t i = 0; i < count && at + 3 <= bytes.size(); ++i, at += entry)
        out.palette.push_back({bytes[at + 2], bytes[at + 1], bytes[at]});
}

Result<Bmp> read_bmp_header(Bytes bytes, int largest_side) {
    const auto number = [&](std::size_t at, std::size_t count) { return little_endian(bytes, at, count); };
    constexpr std::size_t old_header = 12, plain_header = 40;
    if (bytes.size() < bmp_file_header + old_header) return cut_off("BMP");
    Bmp out;
    out.pixels_at = number(10, 4);
    const std::size_t header = number(14, 4);
    const bool is_old = header == old_header;
    if (bytes.size() < bmp_file_header + (is_old ? old_header : plain_header)) return cut_off("BMP");
    if (!is_old && header < plain_header) return damaged_image("BMP", "its header has an unknown size");
    const auto width = is_old ? std::int64_t{number(18, 2)} : std::bit_cast<std::int32_t>(number(18, 4));
    const auto height = is_old ? std::int64_t{number(20, 2)} : std::bit_cast<std::int32_t>(number(22, 4));
    out.from_top = height < 0;
    if (width < 0) return damaged_image("BMP", "its width is below 0");
    if (auto ok = check_image_size(static_cast<std::uint64_t>(width),
                                   static_cast<std::uint64_t>(height < 0 ? -height : height), largest_side);
        !ok)
        return tl::unexpected(ok.error());
    out.width = static_cast<int>(width);
    out.height = static_cast<int>(height < 0 ? -height : height);
    out.bits = number(is_old ? 24 : 28, 2);
    const auto coding = is_old ? 0 : number(30, 4);
    out.coding = static_cast<BmpCoding>(coding);
    if ((coding > 3 && out.coding != BmpCoding::masks_and_alpha) || !is_one_of(out.bits, {1, 4, 8, 16, 24, 32}))
        return image_not_read("is a BMP of " + std::to_string(out.bits) + " bits a pixel and of coding " +
                              std::to_string(coding));
    if (out.coding == BmpCoding::masks || out.coding == BmpCoding::masks_and_alpha) {
        if (bytes.size() < 66) return cut_off("BMP");
        for (std::size_t c = 0; c < 3; ++c) out.masks[c] = number(54 + 4 * c, 4);
    } else if (out.bits == 16) {
        out.masks = {0x7c00, 0x03e0, 0x001f};
    } else {
        out.masks = {0xff0000, 0xff00, 0xff};
    }
    const std::size_t most = out.bits <= 8 ? std::size_t{1} << out.bits : 0, said = is_old ? 0 : number(46, 4);
    read_bmp_palette(bytes, bmp_file_header + header, said == 0 ? most : std::min(said, most), is_old ? 3 : 4, out);
    return out;
}

void put(Image& image, int x, int row, const Colour& colour) {
    const auto at = static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x);
    std::copy(colour.begin(), colour.end(), image.rgb.begin() + static_cast<std::ptrdiff_t>(3 * at));
}

Colour of_palette(const Bmp& bmp, std::size_t index) {
    return index < bmp.palette.size() ? bmp.palette[index] : Colour{};
}

// Runs of one index, or of two in turn; what is passed over stays black.
Result<void> read_bmp_runs(const Bmp& bmp, Bytes bytes, Image& out) {
    const bool is_half = bmp.coding == BmpCoding::runs_of_4;
    int x = 0, y = 0;
    const auto add = [&](std::size_t index) {
        if (x < out.width && y < out.height) put(out, x, y, of_palette(bmp, index));
        x = std::min(x + 1, out.width);
    };
    constexpr std::uint8_t end_of_row = 0, end_of_image = 1, step = 2;
    for (std::size_t at = bmp.pixels_at; at + 2 <= bytes.size() && y < out.height;) {
        const std::uint8_t count = bytes[at], value = bytes[at + 1];
        at += 2;
        if (count > 0) {
            for (std::size_t i = 0; i < count; ++i)
                add(!is_half ? value : i % 2 == 0 ? std::size_t{value} >> 4 : std::size_t{value} & 15);
        } else if (value == end_of_row) {
            x = 0;
            ++y;
        } else if (value == end_of_image) {
            return {};
        } else if (value == step) {
            if (at + 2 > bytes.size()) break;
            x = std::min(x + bytes[at], out.width);
            y = std::min(y + bytes[at + 1], out.height);
            at += 2;
        } else {
            const std::size_t size = is_half ? (std::size_t{value} + 1) / 2 : value;
            if (at + size > bytes.size()) break;
            for (std::size_t i = 0; i < value; ++i) {
                const std::size_t byte = bytes[at + (is_half ? i / 2 : i)];
                add(!is_half ? byte : i % 2 == 0 ? byte >> 4 : byte & 15);
            }
            at += size + size % 2;
        }
    }
    if (y + 1 < out.height || (y < out.height && x < out.width)) return cut_off("BMP");
    return {};
}

void read_bmp_row(const Bmp& bmp, Bytes row, int y, Image& out) {
    for (int x = 0; x < bmp.width; ++x) {
        const std::size_t bit = static_cast<std::size_t>(x) * bmp.bits;
        if (bmp.bits > 8) {
            const auto pixel = little_endian(row, bit / 8, bmp.bits / 8);
            put(out, x, y,
                {masked_level(pixel, bmp.masks[0]), masked_level(pixel, bmp.masks[1]),
                 masked_level(pixel, bmp.masks[2])});
            continue;
        }
        const std::size_t shift = 8 - bmp.bits - bit % 8, most = (std::size_t{1} << bmp.bits) - 1;
        put(out, x, y, of_palette(bmp, (row[bit / 8] >> shift) & most));
    }
}

// ---- TGA ------------------------------------------------------------------------------------------------------------

constexpr std::size_t tga_header = 18;
constexpr std::string_view tga_mark("TRUEVISION-XFILE.\0", 18);

struct Tga {
    int width = 0, height = 0;
    bool has_runs = false, is_grey = false, has_palette = false;
    std::size_t bytes_a_pixel = 0;
    std::size_t palette_first = 0, palette_count = 0, palette_bytes = 0;
    std::size_t palette_at = 0, pixels_at = 0;
    bool from_top = false, from_right = false;
};

constexpr std::uint8_t tga_palette = 1, tga_colours = 2, tga_greys = 3, tga_runs = 8;

bool has_tga_mark(Bytes bytes) {
    return bytes.size() >= tga_header + tga_mark.size() &&
           std::memcmp(bytes.data() + bytes.size() - tga_mark.size(), tga_mark.data(), tga_mark.size()) == 0;
}

// Whether everything in the header is possible.
bool is_tga_header(Bytes bytes) {
    if (bytes.size() < tga_header) return false;
    const std::size_t kind = bytes[2] & ~std::size_t{tga_runs}, bits = bytes[16];
    const bool has_palette = bytes[1] == 1;
    if (bytes[1] > 1 || bytes[2] > (tga_runs | tga_greys) || !is_one_of(kind, {1, 2, 3})) return false;
    if (kind == tga_palette && (!has_palette || bits != 8)) return false;
    if (kind == tga_greys && bits != 8 && bits != 16) return false;
    if (kind == tga_colours && !is_one_of(bits, {15, 16, 24, 32})) return false;
    if (has_palette ? !is_one_of(bytes[7], {15, 16, 24, 32}) : little_endian(bytes, 5, 3) != 0) return false;
    return little_endian(bytes, 12, 2) > 0 && little_endian(bytes, 14, 2) > 0 && (bytes[17] & 0xc0) == 0;
}

Result<Tga> read_tga_header(Bytes bytes, int largest_side) {
    if (!is_tga_header(bytes)) return image_not_read("is a TGA of a rare kind");
    Tga out;
    const auto width = little_endian(bytes, 12, 2), height = little_endian(bytes, 14, 2);
    if (auto ok = check_image_size(width, height, largest_side); !ok) return tl::unexpected(ok.error());
    out.width = static_cast<int>(width);
    out.height = static_cast<int>(height);
    out.has_runs = (bytes[2] & tga_runs) != 0;
    out.has_palette = (bytes[2] & ~tga_runs) == tga_palette;
    out.is_grey = (bytes[2] & ~tga_runs) == tga_greys;
    out.bytes_a_pixel = (std::size_t{bytes[16]} + 7) / 8;
    out.palette_first = little_endian(bytes, 3, 2);
    out.palette_count = little_endian(bytes, 5, 2);
    out.palette_bytes = (std::size_t{bytes[7]} + 7) / 8;
    out.palette_at = tga_header + bytes[0];
    out.pixels_at = out.palette_at + (bytes[1] == 1 ? out.palette_count * out.palette_bytes : 0);
    out.from_right = (bytes[17] & 0x10) != 0;
    out.from_top = (bytes[17] & 0x20) != 0;
    return out;
}

Colour tga_colour(Bytes bytes, std::size_t at, std::size_t count) {
    if (count >= 3) return {bytes[at + 2], bytes[at + 1], bytes[at]};
    const auto pixel = little_endian(bytes, at, 2);
    return {masked_level(pixel, 0x7c00), masked_level(pixel, 0x03e0), masked_level(pixel, 0x001f)};
}

// The pixel at that place in the file, all of which is there.
Colour tga_pixel(const Tga& tga, Bytes bytes, std::size_t at) {
    if (tga.is_grey) return {bytes[at], bytes[at], bytes[at]};
    if (!tga.has_palette) return tga_colour(bytes, at, tga.bytes_a_pixel);
    const std::size_t index = bytes[at];
    if (index < tga.palette_first || index - tga.palette_first >= tga.palette_count) return {};
    return tga_colour(bytes, tga.palette_at + (index - tga.palette_first) * tga.palette_bytes, tga.palette_bytes);
}

}  // namespace

bool is_bmp(Bytes bytes) {
    if (bytes.size() < bmp_file_header + 4 || bytes[0] != 'B' || bytes[1] != 'M') return false;
    const auto header = little_endian(bytes, bmp_file_header, 4);
    return header == 12 || (header >= 40 && header <= 256);
}

Result<Image> read_bmp_image(Bytes bytes, int largest_side) {
    const auto bmp = read_bmp_header(bytes, largest_side);
    if (!bmp) return tl::unexpected(bmp.error());
    const bool has_runs = bmp->coding == BmpCoding::runs_of_4 || bmp->coding == BmpCoding::runs_of_8;
    const std::size_t row = (static_cast<std::size_t>(bmp->width) * bmp->bits + 31) / 32 * 4;
    const std::size_t used = (static_cast<std::size_t>(bmp->width) * bmp->bits + 7) / 8;  // the last row may end here
    const auto rows = static_cast<std::size_t>(bmp->height);
    if (!has_runs && (bytes.size() < bmp->pixels_at || bytes.size() - bmp->pixels_at < row * (rows - 1) + used))
        return cut_off("BMP");
    if (has_runs && bmp->bits != (bmp->coding == BmpCoding::runs_of_4 ? 4u : 8u))
        return damaged_image("BMP", "its pixels have other bits than its runs");
    Image out{bmp->width, bmp->height, room_for(bmp->width, bmp->height)};
    if (has_runs) {
        if (auto ok = read_bmp_runs(*bmp, bytes, out); !ok) return tl::unexpected(ok.error());
    } else {
        for (int y = 0; y < bmp->height; ++y)
            read_bmp_row(*bmp, bytes.subspan(bmp->pixels_at + row * static_cast<std::size_t>(y), used), y, out);
    }
    if (!bmp->from_top) turn_over(out);
    return out;
}

bool is_tga(Bytes bytes) { return has_tga_mark(bytes) || is_tga_header(bytes); }

Result<Image> read_tga_image(Bytes bytes, int largest_side) {
    const auto tga = read_tga_header(bytes, largest_side);
    if (!tga) return tl::unexpected(tga.error());
    if (!tga->from_top && !has_tga_mark(bytes))
        return fail(ErrorKind::unsupported,
                    "this is a TGA image that could be upside down: it says that its rows come from the bottom, which "
                    "programs write of rows from the top too; save it as PNG");
    const std::size_t pixels = static_cast<std::size_t>(tga->width) * static_cast<std::size_t>(tga->height);
    // A run takes a byte and a pixel for at most 128.
    const std::size_t size =
        tga->has_runs ? (pixels + 127) / 128 * (1 + tga->bytes_a_pixel) : pixels * tga->bytes_a_pixel;
    if (bytes.size() < tga->pixels_at || bytes.size() - tga->pixels_at < size) return cut_off("TGA");
    Image out{tga->width, tga->height, room_for(tga->width, tga->height)};
    std::size_t at = tga->pixels_at;
    std::size_t left_of_run = 0;
    bool is_same = false;  // the run repeats one pixel
    for (std::size_t p = 0; p < pixels; ++p) {
        bool is_first = true;
        if (tga->has_runs && left_of_run == 0) {
            if (at >= bytes.size()) return cut_off("TGA");
            is_same = (bytes[at] & 0x80) != 0;
            left_of_run = 1 + (bytes[at++] & 0x7f);
        } else {
            is_first = false;
        }
        // Behind the first pixel of a run of one pixel the place is behind it.
        const std::size_t from = is_same && !is_first ? at - tga->bytes_a_pixel : at;
        if (from + tga->bytes_a_pixel > bytes.size()) return cut_off("TGA");
        const auto colour = tga_pixel(*tga, bytes, from);
        std::copy(colour.begin(), colour.end(), out.rgb.begin() + static_cast<std::ptrdiff_t>(3 * p));
        at = from + tga->bytes_a_pixel;
        if (tga->has_runs) --left_of_run;
    }
    if (tga->from_right)
        for (int y = 0; y < tga->height; ++y)
            for (int l = 0, r = tga->width - 1; l < r; ++l, --r) {
                const auto row = static_cast<std::size_t>(y) * static_cast<std::size_t>(tga->width);
                std::swap_ranges(&out.rgb[3 * (row + static_cast<std::size_t>(l))],
                                 &out.rgb[3 * (row + static_cast<std::size_t>(l))] + 3,
                                 &out.rgb[3 * (row + static_cast<std::size_t>(r))]);
            }
    if (!tga->from_top) turn_over(out);
    return out;
}

}  // namespace htvm::internal
