#include "codec/intra/level_colours.h"

#include <algorithm>
#include <cstdlib>
#include <memory>

#include "core/bytes.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

std::uint64_t size_of(const ColourDifference& d) {
    std::uint64_t out = 0;
    for (const auto c : d) out += static_cast<std::uint64_t>(std::min(std::abs(c), 64));
    return out;
}

template <std::size_t N>
std::size_t class_of(std::uint64_t value, const std::array<std::uint64_t, N>& above) {
    std::size_t out = 0;
    for (const auto threshold : above) out += value > threshold;
    return out;
}

}  // namespace

LevelColourContext level_colour_context(const SubdivisionLevel& level, std::size_t i,
                                        std::span<const ColourDifference> differences, std::span<const Colour> colours,
                                        std::int32_t step) {
    const auto& s = level.stencils[i];
    LevelColourContext out;
    std::uint64_t contrast = 0;
    for (std::size_t c = 0; c < 3; ++c)
        contrast += static_cast<std::uint64_t>(std::abs(colours[s.a][c] - colours[s.b][c]));
    out.contrast = class_of(4 * contrast / static_cast<std::uint64_t>(step),
                            std::array<std::uint64_t, LevelColourModels::contrasts - 1>{3, 7, 13, 22, 36, 60, 110});
    std::uint64_t sum = 0, count = 0;
    for (const auto v : level.beside[i]) {
        if (v == no_element) break;
        ++count;
        sum += size_of(differences[v]);
    }
    if (count > 0)
        out.beside =
            1 + class_of(4 * sum / count, std::array<std::uint64_t, LevelColourModels::besides - 2>{0, 4, 10, 24});
    out.above = class_of(size_of(differences[s.a]) + size_of(differences[s.b]),
                         std::array<std::uint64_t, LevelColourModels::aboves - 1>{0, 2, 6});
    return out;
}

std::array<std::int32_t, 3> levels_of(const ColourDifference& difference, std::int32_t step) {
    // More than all levels is as good as these; nothing overflows.
    const auto levels = [&](std::int64_t steps) {
        return static_cast<std::int32_t>(std::clamp<std::int64_t>(steps * step, -255, 255));
    };
    const std::int64_t green = difference[0];
    return {levels(green + difference[1]), levels(green), levels(green + difference[2])};
}

Colour level_colour(const EdgeStencil& stencil, std::span<const Colour> colours, const ColourDifference& difference,
                    std::int32_t step) {
    return off_mean(colours[stencil.a], colours[stencil.b], levels_of(difference, step));
}

std::vector<std::uint8_t> write_level_colours(std::span<const std::vector<std::uint8_t>> runs) {
    ByteWriter out;
    for (const auto& run : runs) out.varint(run.size());
    for (const auto& run : runs) out.bytes(run);
    return out.take();
}

Result<LevelColourRuns> level_colour_runs(std::span<const std::uint8_t> layer, std::size_t coded) {
    LevelColourRuns out;
    ByteReader in(layer);
    for (std::size_t k = 0; k < coded; ++k) out.sizes[k] = in.varint();
    if (!in.ok()) return fail(ErrorKind::corrupt_stream, "colours of levels: the layer is cut off");
    out.first = in.position();
    return out;
}

Result<void> decode_level_colours(std::span<const std::uint8_t> layer, std::span<const Colour> colours,
                                  std::int32_t step, std::size_t coded, SurfaceDetail& detail) {
    if (step < 1 || step > 255)
        return fail(ErrorKind::corrupt_stream, "colours of levels: the colour step is not within 1..255");
    const auto runs = level_colour_runs(layer, coded);
    if (!runs) return tl::unexpected(runs.error());
    const auto& sizes = runs->sizes;
    std::size_t begin = runs->first;
    LevelColours known(colours);
    const auto models = std::make_unique<LevelColourModels>();
    for (std::size_t k = 0; k < coded; ++k) {
        if (sizes[k] > layer.size() - begin)
            return fail(ErrorKind::corrupt_stream, "colours of levels: a run is cut off");
        RangeDecoder decoder(layer.subspan(begin, static_cast<std::size_t>(sizes[k])));
        begin += static_cast<std::size_t>(sizes[k]);
        ReadingCoder<RangeDecoder> coder{decoder};
        code_level_colours(coder, *models, k, step, known, detail,
                           [](const EdgeStencil&, const LevelColourContext&) { return ColourDifference{}; });
        if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "colours of levels: a run ends too early");
    }
    if (begin != layer.size()) return fail(ErrorKind::corrupt_stream, "colours of levels: bytes follow the last run");
    return {};
}

}  // namespace htvm::internal
