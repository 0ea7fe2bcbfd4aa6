#include "picture_pace.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>

#include "htvm/picture_encoder.hpp"
#include "texture/film_picture.h"
#include "texture/texture_baking.h"

namespace htvm::app {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double of_a_frame = 0.5;  // that pictures may take

double milliseconds_since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// The picture, so many pixels further to the left, as of somebody who moves.
Image moved(const Image& picture, int pixels) {
    Image out = picture;
    for (auto at = out.rgb.begin(); at != out.rgb.end(); at += 3 * picture.width)
        std::rotate(at, at + 3 * (pixels % picture.width), at + 3 * picture.width);
    return out;
}

// The mean of some behind a key picture, of which there are few.
std::optional<double> coding(const Image& picture, const TexturePictureOptions& given, double quality,
                             unsigned threads) {
    PictureEncoderOptions options;
    options.coder = given.codec.value_or(PictureCoder::av1);
    options.width = static_cast<std::uint32_t>(picture.width);
    options.height = static_cast<std::uint32_t>(picture.height);
    options.quantiser = quantiser_of(options.coder, given.quality.value_or(quality));
    options.threads = threads;
    auto encoder = PictureEncoder::create(options);
    if (!encoder) return std::nullopt;
    constexpr int counted = 3;
    auto start = Clock::now();
    for (int k = 0; k <= counted; ++k) {
        const auto image = moved(picture, k);
        if (k == 1) start = Clock::now();
        if (!encoder->encode(OwnPlanes(image).view())) return std::nullopt;
    }
    return milliseconds_since(start) / counted;
}

}  // namespace

std::optional<double> milliseconds_a_picture(const TexturedMesh& first, TextureAs use,
                                             const TexturePictureOptions& options, double quality, unsigned threads) {
    if (!first.texture || first.mesh.triangles.empty()) return std::nullopt;
    if (use == TextureAs::projection) {
        const auto window = first_window(first);
        const auto size = options.size > 0 ? film_size_of(window, options.size) : film_size_at(window, quality);
        auto picture = film_picture(first, window, size.width, size.height);
        const auto start = Clock::now();
        picture = film_picture(first, window, size.width, size.height);
        const double drawing = milliseconds_since(start);
        const auto coded = coding(picture, options, quality, threads);
        return coded ? std::optional(drawing + *coded) : std::nullopt;
    }
    // The captured mesh stands in for the decoded one: it has as much surface, and a layout. What is done once for a
    // layout is left out, so the second time counts.
    TextureBakingOptions baking;
    baking.width = baking.height = options.size > 0 ? options.size : picture_side_of(picture_side_for(first), quality);
    TextureBaker baker(baking);
    if (!baker.bake(first, first.mesh, {})) return std::nullopt;
    const auto start = Clock::now();
    const auto drawn = baker.bake(first, first.mesh, {});
    const double drawing = milliseconds_since(start);
    if (!drawn) return std::nullopt;
    const auto coded = coding(drawn->picture, options, quality, threads);
    return coded ? std::optional(drawing + *coded) : std::nullopt;
}

std::string too_slow(double milliseconds_a_picture, double milliseconds_a_frame) {
    if (milliseconds_a_picture <= of_a_frame * milliseconds_a_frame) return {};
    return fmt::format(
        "drawing and coding a picture took {:.0f} ms when it was tried, and frames that come every {:.0f} ms leave "
        "{:.0f} "
        "ms for it; --texture-as picture sends pictures all the same",
        milliseconds_a_picture, milliseconds_a_frame, of_a_frame * milliseconds_a_frame);
}

std::function<std::string(const TexturedMesh&, TextureAs, double)> pictures_too_slow(const PicturePace& pace) {
    return [pace](const TexturedMesh& first, TextureAs use, double milliseconds_a_frame) {
        double of_all = 0;
        for (const double quality : pace.qualities) {
            const auto each = milliseconds_a_picture(first, use, pace.options, quality, pace.threads);
            if (!each) return std::string();
            of_all += *each;
        }
        const bool limited = pace.deadline > 0 && pace.deadline < milliseconds_a_frame;
        return too_slow(of_all, limited ? pace.deadline : milliseconds_a_frame);
    };
}

}  // namespace htvm::app
