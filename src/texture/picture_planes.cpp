// Conversion between red, green, blue and the planes of video, in whole numbers of 2^-16.
//
// Limited range is what is written: it is what every decoder and every browser shows rightly by default, and what its
// coarser levels cost is far below what the coder does at any rate that we use.
#include "htvm/picture_planes.hpp"

#include <algorithm>
#include <cmath>

namespace htvm {
namespace {

constexpr int fixed_bits = 16;

std::int32_t fixed(double x) { return static_cast<std::int32_t>(std::lround(std::ldexp(x, fixed_bits))); }

// What a matrix and range mean: luma = black + luma_levels * (weights . rgb), chroma = 128 + chroma_levels * (...).
struct Colours {
    double red, green, blue;  // weights of luma
    double black, luma_levels, chroma_levels;
    Colours(ColourMatrix matrix, bool full_range)
        : red(matrix == ColourMatrix::bt601 ? 0.299 : 0.2126),
          green(0),
          blue(matrix == ColourMatrix::bt601 ? 0.114 : 0.0722),
          black(full_range ? 0 : 16),
          luma_levels((full_range ? 255.0 : 219.0) / 255),
          chroma_levels((full_range ? 255.0 : 224.0) / 255) {
        green = 1 - red - blue;
    }
};

std::uint8_t to_byte(std::int32_t fixed_value) {
    return static_cast<std::uint8_t>(std::clamp(fixed_value >> fixed_bits, 0, 255));
}

using Weights = std::array<std::int32_t, 3>;

std::int32_t weighted(const Weights& weights, std::int32_t r, std::int32_t g, std::int32_t b) {
    return weights[0] * r + weights[1] * g + weights[2] * b;
}

}  // namespace

OwnPlanes::OwnPlanes(const Image& image, ColourMatrix matrix, bool full_range) {
    shape_.width = static_cast<std::uint32_t>(image.width);
    shape_.height = static_cast<std::uint32_t>(image.height);
    shape_.matrix = matrix;
    shape_.full_range = full_range;
    const auto width = static_cast<std::size_t>(image.width), height = static_cast<std::size_t>(image.height);
    const auto half_width = (width + 1) / 2, half_height = (height + 1) / 2;
    shape_.strides = {static_cast<std::ptrdiff_t>(width), static_cast<std::ptrdiff_t>(half_width),
                      static_cast<std::ptrdiff_t>(half_width)};
    samples_ = {std::vector<std::uint8_t>(width * height), std::vector<std::uint8_t>(half_width * half_height),
                std::vector<std::uint8_t>(half_width * half_height)};

    const Colours c(matrix, full_range);
    const double l = c.luma_levels;
    const Weights luma = {fixed(l * c.red), fixed(l * c.green), fixed(l * c.blue)};
    // The weights of a sum of four pixels. Those of each plane add up to nothing, so that grey has no colour.
    const double b = c.chroma_levels / (2 * (1 - c.blue)) / 4, r = c.chroma_levels / (2 * (1 - c.red)) / 4;
    Weights blue = {fixed(-b * c.red), fixed(-b * c.green), 0}, red = {0, fixed(-r * c.green), fixed(-r * c.blue)};
    blue[2] = -blue[0] - blue[1];
    red[0] = -red[1] - red[2];
    const std::int32_t black = fixed(c.black + 0.5), middle = fixed(128.5);

    for (std::size_t y = 0; y < height; ++y) {
        const auto* row = &image.rgb[3 * y * width];
        auto* out = &samples_[0][y * width];
        for (std::size_t x = 0; x < width; ++x, row += 3)
            out[x] = to_byte(black + weighted(luma, row[0], row[1], row[2]));
    }
    for (std::size_t y = 0; y < half_height; ++y) {
        const auto* upper = &image.rgb[3 * (2 * y) * width];
        const auto* lower = &image.rgb[3 * std::min(2 * y + 1, height - 1) * width];
        for (std::size_t x = 0; x < half_width; ++x) {
            const auto left = 3 * (2 * x), right = 3 * std::min(2 * x + 1, width - 1);
            std::array<std::int32_t, 3> sum{};
            for (std::size_t k = 0; k < 3; ++k)
                sum[k] = upper[left + k] + upper[right + k] + lower[left + k] + lower[right + k];
            samples_[1][y * half_width + x] = to_byte(middle + weighted(blue, sum[0], sum[1], sum[2]));
            samples_[2][y * half_width + x] = to_byte(middle + weighted(red, sum[0], sum[1], sum[2]));
        }
    }
}

PicturePlanes OwnPlanes::view() const {
    auto out = shape_;
    for (std::size_t k = 0; k < 3; ++k) out.samples[k] = samples_[k].data();
    return out;
}

Image image_of(const PicturePlanes& planes, const std::array<std::uint16_t, 3>& gains) {
    Image out;
    out.width = static_cast<int>(planes.width);
    out.height = static_cast<int>(planes.height);
    const std::size_t width = planes.width, height = planes.height;
    const std::size_t half_width = (width + 1) / 2, half_height = (height + 1) / 2;
    out.rgb.resize(3 * width * height);

    // Each channel is luma, and so much of the differences, which are summed up sixteenfold; with its gain.
    const Colours c(planes.matrix, planes.full_range);
    struct Channel {
        std::int64_t luma, blue, red;
    };
    const double blue_to_blue = 2 * (1 - c.blue), red_to_red = 2 * (1 - c.red);
    const std::array<std::array<double, 2>, 3> differences = {
        {{0, red_to_red}, {-blue_to_blue * c.blue / c.green, -red_to_red * c.red / c.green}, {blue_to_blue, 0}}};
    std::array<Channel, 3> channels{};
    for (std::size_t k = 0; k < 3; ++k) {
        const double gain = static_cast<double>(gains[k]) / picture_gain_one;
        channels[k] = {fixed(gain / c.luma_levels), fixed(gain * differences[k][0] / c.chroma_levels / 16),
                       fixed(gain * differences[k][1] / c.chroma_levels / 16)};
    }
    const auto black = static_cast<std::int64_t>(c.black);
    constexpr std::int64_t half = std::int64_t{1} << (fixed_bits - 1);

    // For a row of pixels: three times the samples of the nearest row, and once those of the next nearest.
    std::vector<std::int32_t> blue(half_width), red(half_width);
    for (std::size_t y = 0; y < height; ++y) {
        const auto near = static_cast<std::ptrdiff_t>(y / 2);
        const auto far = std::clamp<std::ptrdiff_t>(y % 2 == 0 ? near - 1 : near + 1, 0,
                                                    static_cast<std::ptrdiff_t>(half_height) - 1);
        for (std::size_t k = 1; k < 3; ++k) {
            auto& sums = k == 1 ? blue : red;
            const auto* nearer = planes.samples[k] + near * planes.strides[k];
            const auto* farther = planes.samples[k] + far * planes.strides[k];
            for (std::size_t x = 0; x < half_width; ++x) sums[x] = 3 * nearer[x] + farther[x] - 4 * 128;
        }
        const auto* luma = planes.samples[0] + static_cast<std::ptrdiff_t>(y) * planes.strides[0];
        auto* pixel = &out.rgb[3 * y * width];
        for (std::size_t x = 0; x < width; ++x, pixel += 3) {
            const std::size_t at = x / 2;
            const std::size_t beside = x % 2 == 0 ? (at == 0 ? 0 : at - 1) : std::min(at + 1, half_width - 1);
            const std::int64_t b = 3 * blue[at] + blue[beside], r = 3 * red[at] + red[beside];
            const std::int64_t l = luma[x] - black;
            for (std::size_t k = 0; k < 3; ++k) {
                const auto value =
                    (channels[k].luma * l + channels[k].blue * b + channels[k].red * r + half) >> fixed_bits;
                pixel[k] = static_cast<std::uint8_t>(std::clamp<std::int64_t>(value, 0, 255));
            }
        }
    }
    return out;
}

}  // namespace htvm
