#include "metrics/flicker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>
#include <vector>

#include "core/parallel.h"

namespace htvm {

using namespace internal;
namespace {

// In this order: the frame before, this frame.
using TwoFrames = std::array<const Picture*, 2>;

ChangeSums change_between(const TwoFrames& original, const TwoFrames& decoded) {
    ChangeSums sums;
    for (std::size_t i = 0; i < original[0]->covered.size(); ++i) {
        if (!(original[0]->covered[i] | original[1]->covered[i] | decoded[0]->covered[i] | decoded[1]->covered[i]))
            continue;
        ++sums.pixels;
        bool still = (original[0]->covered[i] & original[1]->covered[i]) != 0;
        std::uint32_t of_decoded = 0;
        for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) {
            const int o = int{original[1]->rgb[c]} - int{original[0]->rgb[c]};
            const int d = int{decoded[1]->rgb[c]} - int{decoded[0]->rgb[c]};
            still = still && std::abs(o) <= still_levels;
            sums.original += static_cast<std::uint32_t>(o * o);
            of_decoded += static_cast<std::uint32_t>(d * d);
        }
        sums.decoded += of_decoded;
        if (!still) continue;
        ++sums.still_pixels;
        sums.decoded_still += of_decoded;
    }
    return sums;
}

// meshes: the original frame before, the original frame, the decoded frame before, the decoded frame.
ChangeSums change_in_views(const std::array<const TexturedMesh*, 4>& meshes, const std::vector<Camera>& cameras,
                           const RenderOptions& render, Threads threads) {
    std::array<DrawableMesh, 4> drawables;
    for (std::size_t i = 0; i < meshes.size(); ++i) drawables[i] = make_drawable(*meshes[i], render);
    std::vector<ChangeSums> views(cameras.size());
    parallel_for(cameras.size(), threads, 1, [&](std::size_t begin, std::size_t end) {
        std::array<Canvas, 4> canvases;
        for (std::size_t view = begin; view < end; ++view) {
            for (std::size_t i = 0; i < meshes.size(); ++i) draw(drawables[i], cameras[view], canvases[i]);
            views[view] = change_between({&canvases[0].picture, &canvases[1].picture},
                                         {&canvases[2].picture, &canvases[3].picture});
        }
    });
    ChangeSums sums;
    for (const auto& view : views) sums += view;
    return sums;
}

double rms(std::uint64_t squared, std::uint64_t pixels) {
    return pixels > 0 ? std::sqrt(static_cast<double>(squared) / (3.0 * static_cast<double>(pixels))) : 0;
}

}  // namespace

ChangeSums& operator+=(ChangeSums& sums, const ChangeSums& more) {
    sums.pixels += more.pixels;
    sums.still_pixels += more.still_pixels;
    sums.original += more.original;
    sums.decoded += more.decoded;
    sums.decoded_still += more.decoded_still;
    return sums;
}

double original_change(const ChangeSums& sums) { return rms(sums.original, sums.pixels); }
double decoded_change(const ChangeSums& sums) { return rms(sums.decoded, sums.pixels); }
double still_change(const ChangeSums& sums) { return rms(sums.decoded_still, sums.still_pixels); }

double flicker_ratio(const ChangeSums& sums) {
    if (sums.original == 0) return sums.decoded == 0 ? 1 : std::numeric_limits<double>::infinity();
    return std::sqrt(static_cast<double>(sums.decoded) / static_cast<double>(sums.original));
}

Result<std::optional<FrameFlicker>> FlickerMeter::add(TexturedMesh original, TexturedMesh decoded) {
    if (const auto ok = check_measurable(original.mesh, "original"); !ok) return tl::unexpected(ok.error());
    if (const auto ok = check_measurable(decoded.mesh, "decoded mesh"); !ok) return tl::unexpected(ok.error());
    const auto before = std::exchange(before_, std::make_unique<Pair>(Pair{std::move(original), std::move(decoded)}));
    if (!before) return std::optional<FrameFlicker>{};
    const std::array meshes{&before->original, &before_->original, &before->decoded, &before_->decoded};
    Box box = bounding_box(meshes[0]->mesh);
    extend(box, bounding_box(meshes[1]->mesh));
    const auto cameras = cameras_round(options_.view_box.value_or(box), options_.views);
    if (!cameras) return tl::unexpected(cameras.error());
    RenderOptions render = options_.render;
    render.colours = render.colours &&
                     std::ranges::all_of(meshes, [](const TexturedMesh* m) { return ShownMesh(*m).has_colours(); });
    FrameFlicker out;
    out.lit = change_in_views(meshes, *cameras, render, options_.threads);
    if (render.colours) {
        render.shading = Shading::unlit;
        out.unlit = change_in_views(meshes, *cameras, render, options_.threads);
    }
    return out;
}

std::optional<double> flicker_beside_tracked(std::span<const FrameType> kinds, std::span<const double> values,
                                             std::size_t frame) {
    constexpr std::size_t reach = 6, each_side = 2;
    if (!std::isfinite(values[frame])) return std::nullopt;
    const auto serves = [&](std::size_t i) { return kinds[i] == FrameType::tracked && std::isfinite(values[i]); };
    std::vector<double> beside;
    for (std::size_t i = frame; i-- > 0 && frame - i <= reach && beside.size() < each_side;)
        if (serves(i)) beside.push_back(values[i]);
    const std::size_t before = beside.size();
    for (std::size_t i = frame + 1; i < values.size() && i - frame <= reach && beside.size() < before + each_side; ++i)
        if (serves(i)) beside.push_back(values[i]);
    if (beside.empty()) return std::nullopt;
    std::ranges::sort(beside);
    const std::size_t middle = beside.size() / 2;
    const double median = beside.size() % 2 == 1 ? beside[middle] : (beside[middle - 1] + beside[middle]) / 2;
    return median > 0 ? std::optional(values[frame] / median) : std::nullopt;
}

}  // namespace htvm
