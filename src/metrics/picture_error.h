// M3: the picture metric of the paper (section VI-A3). Both meshes are drawn by the same cameras, and the PSNR of the
// pictures is taken over all views and frames; squared differences are summed first.
//     PSNR = 10 log10(255^2 / (squared difference / (3 * pixels)))
//
// It is computed over all pixels, and over the foreground: the pixels that either mesh covers. The background adds no
// difference, so the PSNR of the full picture depends on how large the body is in it; that of the foreground hardly
// does.
//
// Lit pictures show the shape more than the colours: the same pictures without shading (Shading::unlit), "unlit M3",
// see texture. And a PSNR hardly sees blur: the SSIM of the same pictures is taken beside it.
#pragma once

#include <cstdint>
#include <vector>

#include "core/thread.h"
#include "metrics/render.h"
#include "metrics/structural_similarity.h"

namespace htvm {

// Sums over views and frames; several can be added up.
struct PictureErrorSums {
    std::uint64_t pixels = 0;             // in the full pictures
    std::uint64_t foreground_pixels = 0;  // covered in either picture
    std::uint64_t outline_pixels = 0;     // covered in only one of the two
    std::uint64_t squared = 0;            // exact sum of the squared differences of red, green and blue
    SimilaritySums similarity;
};
PictureErrorSums& operator+=(PictureErrorSums& sums, const PictureErrorSums& more);

// For two pictures of the same size.
PictureErrorSums picture_error(const Picture& original, const Picture& decoded);

// The difference of two pictures of the same size: white where they are equal, darker by `gain` times the largest
// difference of a pixel's three channels.
Picture difference_picture(const Picture& original, const Picture& decoded, int gain = 4);

// Draws both meshes from every camera and adds up the errors. The same for any number of threads.
PictureErrorSums compare_views(const DrawableMesh& original, const DrawableMesh& decoded,
                               const std::vector<Camera>& cameras, internal::Threads threads = {});

// dB; infinity if there is no difference, or no pixel.
double psnr_foreground(const PictureErrorSums& sums);
double psnr_full(const PictureErrorSums& sums);

}  // namespace htvm
