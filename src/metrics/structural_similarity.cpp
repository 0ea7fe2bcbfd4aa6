#include "metrics/structural_similarity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace htvm {
namespace {

constexpr int reach = 5;  // of the window, to each side
using Weights = std::array<double, 2 * reach + 1>;

// The window is the product of these along both axes.
Weights gaussian_weights() {
    Weights weights{};
    double sum = 0;
    for (int i = -reach; i <= reach; ++i) sum += weights[i + reach] = std::exp(-i * i / (2 * 1.5 * 1.5));
    for (double& weight : weights) weight /= sum;
    return weights;
}

std::vector<float> luma_of(const Picture& picture) {
    std::vector<float> luma(picture.covered.size());
    for (std::size_t i = 0; i < luma.size(); ++i)
        luma[i] = 0.299f * picture.rgb[3 * i] + 0.587f * picture.rgb[3 * i + 1] + 0.114f * picture.rgb[3 * i + 2];
    return luma;
}

// Weighted means of the values of both pictures, of their squares, and of their product.
struct Moments {
    double first = 0, second = 0, first_squared = 0, second_squared = 0, product = 0;
    void add(double weight, const Moments& of) {
        first += weight * of.first;
        second += weight * of.second;
        first_squared += weight * of.first_squared;
        second_squared += weight * of.second_squared;
        product += weight * of.product;
    }
};

double similarity_of(const Moments& m) {
    constexpr double c1 = 0.01 * 255 * 0.01 * 255, c2 = 0.03 * 255 * 0.03 * 255;
    const double means = m.first * m.second, squares = m.first * m.first + m.second * m.second;
    const double variances = m.first_squared + m.second_squared - squares;
    return (2 * means + c1) * (2 * (m.product - means) + c2) / ((squares + c1) * (variances + c2));
}

}  // namespace

SimilaritySums& operator+=(SimilaritySums& sums, const SimilaritySums& more) {
    sums.similarity += more.similarity;
    sums.pixels += more.pixels;
    return sums;
}

SimilaritySums structural_similarity(const Picture& first, const Picture& second) {
    static const Weights weights = gaussian_weights();
    const auto a = luma_of(first), b = luma_of(second);
    const auto width = static_cast<std::size_t>(first.width), height = static_cast<std::size_t>(first.height);
    SimilaritySums sums;
    std::vector<Moments> columns(width);
    for (std::size_t y = reach; y + reach < height; ++y) {
        const auto covered = [&](std::size_t x) {
            return first.covered[y * width + x] | second.covered[y * width + x];
        };
        std::size_t begin = reach, end = width > reach ? width - reach : 0;
        while (begin < end && !covered(begin)) ++begin;
        while (begin < end && !covered(end - 1)) --end;
        if (begin >= end) continue;
        std::fill(columns.begin() + static_cast<std::ptrdiff_t>(begin - reach),
                  columns.begin() + static_cast<std::ptrdiff_t>(end + reach), Moments{});
        for (std::size_t i = 0; i < weights.size(); ++i) {
            const std::size_t row = (y + i - reach) * width;
            for (std::size_t x = begin - reach; x < end + reach; ++x) {
                const double p = a[row + x], q = b[row + x];
                columns[x].add(weights[i], {p, q, p * p, q * q, p * q});
            }
        }
        for (std::size_t x = begin; x < end; ++x) {
            if (!covered(x)) continue;
            Moments window;
            for (std::size_t i = 0; i < weights.size(); ++i) window.add(weights[i], columns[x + i - reach]);
            sums.similarity += similarity_of(window);
            ++sums.pixels;
        }
    }
    return sums;
}

double mean_similarity(const SimilaritySums& sums) {
    return sums.pixels > 0 ? sums.similarity / static_cast<double>(sums.pixels) : 1;
}

}  // namespace htvm
