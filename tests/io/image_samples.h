// Images that the tests of textures share.
#pragma once

#include <png.h>
#include <turbojpeg.h>
#include <webp/encode.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/image.h"
#include "io/image_file.h"

namespace htvm::samples {

// Every channel of every pixel differs from its neighbours'.
inline Image gradient(int width, int height) {
    Image image{width, height, {}};
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (const int value : {20 + 5 * x, 30 + 4 * y, 200 - 3 * x - 2 * y})
                image.rgb.push_back(static_cast<std::uint8_t>(value));
    return image;
}

inline Image plain(int width, int height, const Colour& colour) {
    Image image{width, height, {}};
    for (int p = 0; p < width * height; ++p) image.rgb.insert(image.rgb.end(), colour.begin(), colour.end());
    return image;
}

// What reading the bytes fails with; no error if it does not.
inline Error error_of(std::span<const std::uint8_t> bytes) {
    const auto read = read_image(bytes);
    return read ? Error{} : read.error();
}

// So many bytes of a value, the least significant first.
inline void append(std::vector<std::uint8_t>& bytes, std::uint32_t value, int count) {
    for (int i = 0; i < count; ++i)
        bytes.push_back(i < 4 ? static_cast<std::uint8_t>(value >> (8 * i)) : std::uint8_t{0});
}

inline std::vector<std::uint8_t> webp_of(const Image& image) {
    std::uint8_t* bytes = nullptr;
    const auto size = WebPEncodeLosslessRGB(image.rgb.data(), image.width, image.height, 3 * image.width, &bytes);
    const std::vector<std::uint8_t> out(bytes, bytes + size);
    WebPFree(bytes);
    return out;
}

// pixels: in that format of libpng's, row by row.
inline std::vector<std::uint8_t> png_of(int width, int height, png_uint_32 format, const void* pixels) {
    png_image png;
    std::memset(&png, 0, sizeof png);
    png.version = PNG_IMAGE_VERSION;
    png.width = static_cast<png_uint_32>(width);
    png.height = static_cast<png_uint_32>(height);
    png.format = format;
    png_alloc_size_t size = 1 << 20;
    std::vector<std::uint8_t> out(size);
    if (!png_image_write_to_memory(&png, out.data(), &size, 0, pixels, 0, nullptr)) return {};
    out.resize(size);
    return out;
}

inline void write_bytes(const std::filesystem::path& path, const std::vector<std::uint8_t>& bytes) {
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

inline void write_text(const std::filesystem::path& path, const std::string& text) { std::ofstream(path) << text; }

}  // namespace htvm::samples
