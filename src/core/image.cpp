#include "core/image.h"

#include <algorithm>
#include <cmath>

namespace htvm {
namespace {

// Which pixels of a side of so many make up each of those of another, and how much of each: shares add up to 1.
struct Share {
    std::size_t pixel;
    float share;
};
std::vector<std::vector<Share>> shares(int from, int to) {
    std::vector<std::vector<Share>> out(static_cast<std::size_t>(to));
    const double size = static_cast<double>(from) / to;
    for (int i = 0; i < to; ++i) {
        const double begin = i * size, end = (i + 1) * size;
        for (int pixel = static_cast<int>(begin); pixel < std::min(from, static_cast<int>(std::ceil(end))); ++pixel) {
            const double covered = std::min(end, pixel + 1.0) - std::max(begin, static_cast<double>(pixel));
            if (covered > 0)
                out[static_cast<std::size_t>(i)].push_back(
                    {static_cast<std::size_t>(pixel), static_cast<float>(covered / size)});
        }
    }
    return out;
}

}  // namespace

Image resized(const Image& image, int width, int height) {
    const auto columns = shares(image.width, width), rows = shares(image.height, height);
    const auto from_width = 3 * static_cast<std::size_t>(image.width);
    Image out{width, height, {}};
    out.rgb.reserve(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    std::vector<float> row(from_width);
    for (const auto& of_row : rows) {
        std::fill(row.begin(), row.end(), 0.0f);
        for (const auto& [y, share] : of_row)
            for (std::size_t i = 0; i < from_width; ++i)
                row[i] += share * static_cast<float>(image.rgb[y * from_width + i]);
        for (const auto& of_column : columns)
            for (std::size_t c = 0; c < 3; ++c) {
                float sum = 0.5f;
                for (const auto& [x, share] : of_column) sum += share * row[3 * x + c];
                out.rgb.push_back(static_cast<std::uint8_t>(std::min(sum, 255.0f)));
            }
    }
    return out;
}

}  // namespace htvm

namespace htvm::internal {

namespace {

// Half as large: each pixel is the mean of four.
Image halved(const Image& image) {
    Image out;
    out.width = (image.width + 1) / 2;
    out.height = (image.height + 1) / 2;
    out.rgb.reserve(3 * static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height));
    const auto row = [&](int y) {
        return &image.rgb[3 * static_cast<std::size_t>(std::min(y, image.height - 1)) *
                          static_cast<std::size_t>(image.width)];
    };
    for (int y = 0; y < out.height; ++y) {
        const std::uint8_t *upper = row(2 * y), *lower = row(2 * y + 1);
        for (int x = 0; x < out.width; ++x) {
            const auto left = static_cast<std::size_t>(6 * x);
            const auto right = static_cast<std::size_t>(3 * std::min(2 * x + 1, image.width - 1));
            for (std::size_t c = 0; c < 3; ++c)
                out.rgb.push_back(static_cast<std::uint8_t>(
                    (upper[left + c] + upper[right + c] + lower[left + c] + lower[right + c] + 2) / 4));
        }
    }
    return out;
}

// 0..1 stays; beyond, the part behind the whole number.
double repeated(float coordinate) {
    const auto x = static_cast<double>(coordinate);
    return x >= 0 && x <= 1 ? x : x - std::floor(x);
}

struct Between {
    std::size_t low, high;  // neighbouring texels
    float share;            // of the higher one
};

Between texels_beside(double place, int count) {
    const double centred = std::clamp(place * count - 0.5, 0.0, static_cast<double>(count - 1));
    const auto low = static_cast<std::size_t>(centred);
    return {low, std::min(low + 1, static_cast<std::size_t>(count - 1)),
            static_cast<float>(centred - static_cast<double>(low))};
}

}  // namespace

ImagePyramid::ImagePyramid(const Image& image) : image_(&image) {
    for (const Image* last = image_; last->width > 1 || last->height > 1; last = &smaller_.back())
        smaller_.push_back(halved(*last));
}

std::size_t ImagePyramid::level_for(double texels) const {
    std::size_t level = 0;
    for (double size = std::sqrt(2.0); texels > size && level + 1 < levels(); size *= 2) ++level;
    return level;
}

std::array<float, 3> ImagePyramid::at(float u, float v, std::size_t level) const {
    const Image& image = level == 0 ? *image_ : smaller_[level - 1];
    const Between x = texels_beside(repeated(u), image.width);
    const Between y = texels_beside(1 - repeated(v), image.height);
    const std::uint8_t* upper = &image.rgb[3 * y.low * static_cast<std::size_t>(image.width)];
    const std::uint8_t* lower = &image.rgb[3 * y.high * static_cast<std::size_t>(image.width)];
    std::array<float, 3> out;
    for (std::size_t c = 0; c < 3; ++c) {
        const auto along = [&](const std::uint8_t* row) {
            const float left = row[3 * x.low + c], right = row[3 * x.high + c];
            return left + (right - left) * x.share;
        };
        const float above = along(upper), below = along(lower);
        out[c] = above + (below - above) * y.share;
    }
    return out;
}

}  // namespace htvm::internal
