#include "io/image_webp.h"

#include <webp/decode.h>

#include <utility>
#include <vector>

#include "io/image_file.h"

namespace htvm::internal {

Result<Image> read_webp_image(std::span<const std::uint8_t> bytes, int largest_side) {
    WebPBitstreamFeatures features;
    if (WebPGetFeatures(bytes.data(), bytes.size(), &features) != VP8_STATUS_OK)
        return damaged_image("WebP", "its header cannot be read");
    if (auto ok = check_image_size(static_cast<std::uint64_t>(features.width),
                                   static_cast<std::uint64_t>(features.height), largest_side);
        !ok)
        return tl::unexpected(ok.error());
    if (features.has_animation) return image_not_read("is an animation");
    std::vector<std::uint8_t> rgba(4 * static_cast<std::size_t>(features.width) *
                                   static_cast<std::size_t>(features.height));
    if (!WebPDecodeRGBAInto(bytes.data(), bytes.size(), rgba.data(), rgba.size(), 4 * features.width))
        return damaged_image("WebP", "its pixels cannot be read");
    return without_alpha(features.width, features.height, std::move(rgba));
}

}  // namespace htvm::internal
