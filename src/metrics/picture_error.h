// M3: the picture metric of the paper (section VI-A3): both meshes are drawn by the same cameras, and the PSNR of the
// pictures is taken over all views and frames: squared differences are summed first.
//     PSNR = 10 log10(255^2 / (squared difference / (3 * pixels)))
// over all pixels, and over the foreground: the pixels that either mesh covers. The background adds no difference, so
// the PSNR of the full picture depends on how large the body is in it; the foreground's hardly does.
#pragma once

#include <cstdint>
#include <vector>

#include "core/thread.h"
#include "metrics/render.h"

namespace htvm {

// Sums over views and frames; they add up.
struct PictureErrorSums {
    std::uint64_t pixels = 0;             // of the full pictures
    std::uint64_t foreground_pixels = 0;  // covered in either picture
    std::uint64_t outline_pixels = 0;     // covered in one of the two only
    std::uint64_t squared = 0;            // squared differences of red, green and blue, exact
};
PictureErrorSums& operator+=(PictureErrorSums& sums, const PictureErrorSums& more);

// Of two pictures of the same size.
PictureErrorSums picture_error(const Picture& original, const Picture& decoded);

// Where two pictures of the same size differ: white where they do not, darker by `gain` times the largest difference of
// a pixel's three channels.
Picture difference_picture(const Picture& original, const Picture& decoded, int gain = 4);

// Draws both meshes from every camera and sums up. The same for any number of threads.
PictureErrorSums compare_views(const DrawableMesh& original, const DrawableMesh& decoded,
                               const std::vector<Camera>& cameras, internal::Threads threads = {});

// dB; infinity where there is no difference, also where there are no pixels.
double psnr_foreground(const PictureErrorSums& sums);
double psnr_full(const PictureErrorSums& sums);

}  // namespace htvm
