#include "io/image_dds.h"

#include <array>
#include <cstring>
#include <string>
#include <vector>

#include "io/image_file.h"
#include "io/image_masks.h"

namespace htvm::internal {

namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t plain_header = 128, header_of_10 = 20;
constexpr std::size_t height_at = 12, width_at = 16, flags_at = 80, kind_at = 84, bits_at = 88, masks_at = 92;
constexpr std::size_t block_side = 4;

struct Dds {
    std::size_t block_bytes = 0;  // of compressed ones, 8 or 16, in the last 8 of which the colours are; else 0
    std::size_t pixel_bytes = 0;  // of uncompressed ones
    std::array<std::uint32_t, 3> masks{};  // of these
    std::size_t pixels_at = plain_header;
};

// The kinds of DXGI_FORMAT that are read, by their numbers.
Result<Dds> kind_of_10(std::uint32_t number) {
    Dds out;
    out.pixels_at = plain_header + header_of_10;
    const auto is_within = [&](std::uint32_t first, std::uint32_t last) { return number >= first && number <= last; };
    if (is_within(70, 72)) {  // BC1
        out.block_bytes = 8;
    } else if (is_within(73, 78)) {  // BC2, BC3
        out.block_bytes = 16;
    } else if (is_within(27, 29)) {  // R8G8B8A8
        out.pixel_bytes = 4;
        out.masks = {0xff, 0xff00, 0xff0000};
    } else if (is_within(87, 88) || is_within(90, 93)) {  // B8G8R8A8, B8G8R8X8
        out.pixel_bytes = 4;
        out.masks = {0xff0000, 0xff00, 0xff};
    } else if (is_within(60, 61)) {  // R8
        out.pixel_bytes = 1;
        out.masks = {0xff, 0xff, 0xff};
    } else {
        return image_not_read("is a DDS of the DXGI format " + std::to_string(number) + ", such as BC7");
    }
    return out;
}

Result<Dds> read_header(Bytes bytes) {
    constexpr std::uint32_t compressed = 4, coloured = 0x40, grey = 0x20000;
    const auto flags = little_endian(bytes, flags_at, 4);
    const std::string kind(reinterpret_cast<const char*>(bytes.data() + kind_at), 4);
    Dds out;
    if ((flags & compressed) != 0) {
        if (kind == "DX10" && bytes.size() >= plain_header + header_of_10)
            return kind_of_10(little_endian(bytes, plain_header, 4));
        const bool is_block = kind == "DXT1" || kind == "DXT2" || kind == "DXT3" || kind == "DXT4" || kind == "DXT5";
        std::string shown;
        for (const char c : kind) shown += c >= ' ' && c <= '~' ? c : '?';
        if (!is_block) return image_not_read("is a DDS of the kind " + shown);
        out.block_bytes = kind == "DXT1" ? 8 : 16;
        return out;
    }
    const auto bits = little_endian(bytes, bits_at, 4);
    if ((flags & (coloured | grey)) == 0 || bits == 0 || bits > 32 || bits % 8 != 0)
        return image_not_read("is a DDS of a rare kind");
    out.pixel_bytes = bits / 8;
    for (std::size_t c = 0; c < 3; ++c)
        out.masks[c] = little_endian(bytes, masks_at + ((flags & grey) != 0 ? 0 : 4 * c), 4);
    return out;
}

Colour colour_of_565(std::uint32_t pixel) {
    return {masked_level(pixel, 0xf800), masked_level(pixel, 0x07e0), masked_level(pixel, 0x001f)};
}

// The four colours of a block: two, and two between them, or one between them and black.
std::array<Colour, 4> colours_of(Bytes block, bool is_plain) {
    const auto first = little_endian(block, 0, 2), second = little_endian(block, 2, 2);
    std::array<Colour, 4> out{colour_of_565(first), colour_of_565(second), Colour{}, Colour{}};
    for (std::size_t c = 0; c < 3; ++c) {
        const int a = out[0][c], b = out[1][c];
        if (first > second || !is_plain) {
            out[2][c] = static_cast<std::uint8_t>((2 * a + b + 1) / 3);
            out[3][c] = static_cast<std::uint8_t>((a + 2 * b + 1) / 3);
        } else {
            out[2][c] = static_cast<std::uint8_t>((a + b) / 2);
        }
    }
    return out;
}

void read_block(Bytes block, bool is_plain, std::size_t left, std::size_t top, Image& out) {
    const auto colours = colours_of(block, is_plain);
    const auto choices = little_endian(block, 4, 4);
    const auto width = static_cast<std::size_t>(out.width), height = static_cast<std::size_t>(out.height);
    for (std::size_t i = 0; i < block_side * block_side; ++i) {
        const std::size_t x = left + i % block_side, y = top + i / block_side;
        if (x >= width || y >= height) continue;
        const Colour& colour = colours[(choices >> (2 * i)) & 3];
        for (std::size_t c = 0; c < 3; ++c) out.rgb[3 * (y * width + x) + c] = colour[c];
    }
}

}  // namespace

bool is_dds(Bytes bytes) { return bytes.size() >= 4 && std::memcmp(bytes.data(), "DDS ", 4) == 0; }

Result<Image> read_dds_image(Bytes bytes, int largest_side) {
    if (bytes.size() < plain_header) return damaged_image("DDS", "it ends within its header");
    const std::size_t width = little_endian(bytes, width_at, 4), height = little_endian(bytes, height_at, 4);
    if (auto ok = check_image_size(width, height, largest_side); !ok) return tl::unexpected(ok.error());
    const auto dds = read_header(bytes);
    if (!dds) return tl::unexpected(dds.error());
    const std::size_t across = (width + block_side - 1) / block_side, down = (height + block_side - 1) / block_side;
    const std::size_t size =
        dds->block_bytes > 0 ? across * down * dds->block_bytes : width * height * dds->pixel_bytes;
    if (bytes.size() < dds->pixels_at || bytes.size() - dds->pixels_at < size)
        return damaged_image("DDS", "it ends too early");
    Image out{static_cast<int>(width), static_cast<int>(height), std::vector<std::uint8_t>(3 * width * height)};
    const Bytes pixels = bytes.subspan(dds->pixels_at, size);
    if (dds->block_bytes > 0) {
        const bool is_plain = dds->block_bytes == 8;
        for (std::size_t b = 0; b < across * down; ++b)
            read_block(pixels.subspan((b + 1) * dds->block_bytes - 8, 8), is_plain, b % across * block_side,
                       b / across * block_side, out);
        return out;
    }
    for (std::size_t p = 0; p < width * height; ++p) {
        const auto pixel = little_endian(pixels, p * dds->pixel_bytes, dds->pixel_bytes);
        for (std::size_t c = 0; c < 3; ++c) out.rgb[3 * p + c] = masked_level(pixel, dds->masks[c]);
    }
    return out;
}

}  // namespace htvm::internal
