#include "metrics/picture_error.h"

#include <algorithm>
#include <cstdlib>

#include "core/parallel.h"
#include "metrics/cloud_psnr.h"

namespace htvm {

using namespace internal;

PictureErrorSums& operator+=(PictureErrorSums& sums, const PictureErrorSums& more) {
    sums.pixels += more.pixels;
    sums.foreground_pixels += more.foreground_pixels;
    sums.outline_pixels += more.outline_pixels;
    sums.squared += more.squared;
    sums.similarity += more.similarity;
    return sums;
}

PictureErrorSums picture_error(const Picture& original, const Picture& decoded) {
    PictureErrorSums sums;
    sums.pixels = original.covered.size();
    for (std::size_t i = 0; i < original.covered.size(); ++i) {
        if (!(original.covered[i] | decoded.covered[i])) continue;
        ++sums.foreground_pixels;
        sums.outline_pixels += original.covered[i] ^ decoded.covered[i];
        std::uint32_t squared = 0;
        for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) {
            const int d = int{original.rgb[c]} - int{decoded.rgb[c]};
            squared += static_cast<std::uint32_t>(d * d);
        }
        sums.squared += squared;
    }
    sums.similarity = structural_similarity(original, decoded);
    return sums;
}

Picture difference_picture(const Picture& original, const Picture& decoded, int gain) {
    Picture out = original;
    for (std::size_t i = 0; i < original.covered.size(); ++i) {
        int largest = 0;
        for (std::size_t c = 3 * i; c < 3 * i + 3; ++c)
            largest = std::max(largest, std::abs(int{original.rgb[c]} - int{decoded.rgb[c]}));
        const auto grey = static_cast<std::uint8_t>(255 - std::min(255, gain * largest));
        for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) out.rgb[c] = grey;
        out.covered[i] = original.covered[i] | decoded.covered[i];
    }
    return out;
}

PictureErrorSums compare_views(const DrawableMesh& original, const DrawableMesh& decoded,
                               const std::vector<Camera>& cameras, Threads threads) {
    std::vector<PictureErrorSums> views(cameras.size());
    parallel_for(cameras.size(), threads, 1, [&](std::size_t begin, std::size_t end) {
        Canvas first, second;
        for (std::size_t i = begin; i < end; ++i) {
            draw(original, cameras[i], first);
            draw(decoded, cameras[i], second);
            views[i] = picture_error(first.picture, second.picture);
        }
    });
    PictureErrorSums sums;
    for (const auto& view : views) sums += view;
    return sums;
}

namespace {

double psnr_over(const PictureErrorSums& sums, std::uint64_t pixels) {
    return psnr(255, pixels > 0 ? static_cast<double>(sums.squared) / (3.0 * static_cast<double>(pixels)) : 0);
}

}  // namespace

double psnr_foreground(const PictureErrorSums& sums) { return psnr_over(sums, sums.foreground_pixels); }
double psnr_full(const PictureErrorSums& sums) { return psnr_over(sums, sums.pixels); }

}  // namespace htvm
