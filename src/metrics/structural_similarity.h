// SSIM: how alike two pictures are in structure, 1 for equal ones (Wang, Bovik, Sheikh and Simoncelli: Image quality
// assessment: from error visibility to structural similarity, IEEE Transactions on Image Processing 13(4), 2004). It
// sees what a PSNR hardly does: texture that is blurred or gone.
//
// It compares the luma Y = 0.299 R + 0.587 G + 0.114 B (0..255), in a window of 11 x 11 pixels with Gaussian weights
// (sigma 1.5, sum 1) around each pixel; with mean m, variance v and covariance c of the two windows, C1 = (0.01 *
// 255)^2 and C2 = (0.03 * 255)^2:
//     SSIM = (2 m1 m2 + C1) (2 c + C2) / ((m1^2 + m2^2 + C1) (v1 + v2 + C2))
// It is taken at the pixels that either picture covers: their windows may reach into the background, which alone would
// be alike everywhere. Pixels whose window leaves the picture, within 5 of its edge, are left out.
#pragma once

#include <cstdint>

#include "metrics/render.h"

namespace htvm {

// Sums over pixels, views and frames; several can be added up.
struct SimilaritySums {
    double similarity = 0;     // each pixel's SSIM
    std::uint64_t pixels = 0;  // that it was taken at
};
SimilaritySums& operator+=(SimilaritySums& sums, const SimilaritySums& more);

// For two pictures of the same size.
SimilaritySums structural_similarity(const Picture& first, const Picture& second);

// -1..1; 1 if there is no pixel.
double mean_similarity(const SimilaritySums& sums);

}  // namespace htvm
