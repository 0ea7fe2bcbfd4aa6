#include "encode_settings.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "codec/format/sequence.h"
#include "command_line/terminal.h"
#include "io/mesh_file.h"
#include "metrics/front.h"

namespace htvm::app {
namespace {

Result<std::vector<double>> read_radii(const std::string& path, std::size_t bones) {
    const auto bytes = read_file(path);
    if (!bytes) return tl::unexpected(bytes.error());
    const auto json = nlohmann::json::parse(bytes->begin(), bytes->end(), nullptr, false);
    if (!json.is_object() || !json.contains("radii") || !json["radii"].is_array())
        return fail(ErrorKind::bad_input,
                    path + " is not a calibration: it has no list \"radii\" (see htvm calibrate)");
    std::vector<double> radii;
    for (const auto& value : json["radii"]) {
        if (!value.is_number()) return fail(ErrorKind::bad_input, path + ": a radius is not a number");
        radii.push_back(value.get<double>());
    }
    if (radii.size() != bones)
        return fail(ErrorKind::bad_input,
                    fmt::format("{} has {} radii, but the skeleton has {} bones", path, radii.size(), bones));
    return radii;
}

Result<void> set_skeleton(const EncodePlan& plan, const Capture& capture, EncoderOptions& settings) {
    settings.skeleton = capture.skeleton();
    settings.radii = capture.radii();
    if (plan.radii_file.empty()) return {};
    if (capture.skeleton().bones.empty())
        return fail(ErrorKind::bad_input, "--radii needs a skeleton (see --skeleton)");
    auto radii = read_radii(plan.radii_file, capture.skeleton().bones.size());
    if (!radii) return tl::unexpected(radii.error());
    settings.radii = std::move(*radii);
    return {};
}

// What the sequence header says of a capture's pictures.
Result<void> set_texture(const EncodePlan& plan, const Capture& capture, EncoderOptions& settings) {
    const auto use = plan.capture.texture_as;
    const char* about_pictures = plan.pictures.size > 0  ? "--texture-size"
                                 : plan.pictures.codec   ? "--texture-codec"
                                 : plan.pictures.quality ? "--texture-quality"
                                                         : nullptr;
    if (!keeps_pictures(use)) {
        if (about_pictures)
            note(fmt::format("no pictures go into the stream, so there is nothing to do for {}", about_pictures));
        return {};
    }
    const auto* first = capture.first_textured();
    if (!first) return fail(ErrorKind::bad_input, "the capture's first mesh has no texture");
    const bool bake = use == TextureAs::picture, film = use == TextureAs::projection;
    settings.texture.layout = bake ? TextureLayout::charts : film ? TextureLayout::projection : TextureLayout::captured;
    const auto& image = *first->texture;
    const int size = use == TextureAs::keep ? 0 : plan.pictures.size;
    constexpr long least = 16;
    if (bake) {
        settings.tracked.access_interval = plan.access_interval_with_pictures;
        settings.texture.width = settings.texture.height =
            size > 0 ? size : picture_side_of(picture_side_for(*first), plan.encoder.quality);
        note(fmt::format("pictures have {0} x {0} pixels{1}", settings.texture.width,
                         size > 0 ? "" : "; --texture-size sets others"));
    } else if (film) {
        if (!plan.film)
            return fail(ErrorKind::bad_input,
                        "--texture-as projection: the first mesh's texture coordinates are not one camera's "
                        "projection; --texture-as picture takes any");
        settings.tracked.access_interval = plan.access_interval_with_pictures;
        const auto pictures =
            size > 0 ? film_size_of(*plan.film, size) : film_size_at(*plan.film, plan.encoder.quality);
        settings.texture.width = pictures.width;
        settings.texture.height = pictures.height;
        note(fmt::format("pictures have {} x {} pixels, of {} x {} of the film{}", settings.texture.width,
                         settings.texture.height, plan.film->width, plan.film->height,
                         size > 0 ? "" : "; --texture-size sets others"));
    } else {
        const double scale = size > 0 ? static_cast<double>(size) / std::max(image.width, image.height) : 1;
        settings.texture.width = static_cast<int>(std::max(least, std::lround(scale * image.width)));
        settings.texture.height = static_cast<int>(std::max(least, std::lround(scale * image.height)));
    }
    return {};
}

// What a shift takes off a coordinate on the axis that is up, mm.
double shift_along(UpAxis up, const GlobalShift& shift) {
    if (up == UpAxis::unknown) return 0;
    return static_cast<double>(shift[internal::axis_of(up)]);
}

}  // namespace

std::optional<FilmWindow> film_of(const Capture& capture) {
    const auto* first = capture.first_textured();
    if (capture.texture_as() != TextureAs::projection || !first || !is_film(*first)) return std::nullopt;
    return first_window(*first);
}

Result<EncoderOptions> settings_for(const EncodePlan& plan, const Capture& capture) {
    auto out = plan.encoder;
    // In its lowest terms, so that 30 frames a second are the library's default, 30 / 1, however they were given.
    const auto rate = capture.frame_rate();
    const auto divisor = std::max(std::gcd(rate.numerator, rate.denominator), 1u);
    out.fps_numerator = rate.numerator / divisor;
    out.fps_denominator = rate.denominator / divisor;
    out.unit_micrometres =
        static_cast<std::uint32_t>(std::clamp(std::round(capture.millimetres_per_unit() * 1000), 1.0, 4294967295.0));
    out.up = capture.up();
    out.global_shift = capture.global_shift();
    if (plan.floor.is_lowest)
        out.floor = capture.lowest();
    else if (plan.floor.metres)
        out.floor = 1000 * *plan.floor.metres - shift_along(out.up, capture.global_shift());
    if (plan.front) out.metadata.push_back(front_entry(direction_at(capture.first_azimuth() + *plan.front, out.up)));
    if (auto set = set_skeleton(plan, capture, out); !set) return tl::unexpected(set.error());
    if (auto set = set_texture(plan, capture, out); !set) return tl::unexpected(set.error());
    return out;
}

}  // namespace htvm::app
