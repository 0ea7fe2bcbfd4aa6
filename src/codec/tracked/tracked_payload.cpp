#include "codec/tracked/tracked_payload.h"

#include <algorithm>
#include <bit>
#include <cstdint>

#include "entropy/models.h"

namespace htvm::internal {
namespace {

constexpr std::int64_t most_captured = 0x7FFFFFFF;

std::int64_t within_captured(std::int64_t count) { return std::clamp<std::int64_t>(count, 0, most_captured); }

// A count, relative to what is expected.
template <class Coder>
std::uint32_t code_count(Coder& coder, std::uint32_t wanted, std::int64_t expected) {
    SignedModel model;
    expected = within_captured(expected);
    const auto difference = coder.signed_number(model, static_cast<std::int32_t>(within_captured(wanted) - expected));
    return static_cast<std::uint32_t>(within_captured(expected + difference));
}

// Once around a closed surface there are two triangles for each vertex.
template <class Coder>
CapturedCounts code_captured(Coder& coder, CapturedCounts wanted, CapturedCounts before) {
    CapturedCounts out;
    out.vertices = code_count(coder, wanted.vertices, before.vertices);
    out.triangles = code_count(coder, wanted.triangles,
                               before.triangles + 2 * (std::int64_t{out.vertices} - std::int64_t{before.vertices}));
    return out;
}

template <class Coder>
bool code_flag(Coder& coder, bool wanted) {
    return coder.raw(wanted ? 1 : 0, 1) != 0;
}

// Below 2^31.
template <class Coder>
std::uint32_t code_number(Coder& coder, std::uint32_t wanted) {
    const auto width = coder.raw(static_cast<std::uint32_t>(std::bit_width(wanted)), 5);
    if (width == 0) return 0;
    const std::uint32_t top = 1u << (width - 1);
    return top | coder.raw(wanted & (top - 1), static_cast<int>(width) - 1);
}

template <class Coder>
NodeMotionSteps code_steps(Coder& coder, const NodeMotionSteps& wanted, const NodeMotionSteps* before) {
    if (before && code_flag(coder, wanted == *before)) return *before;
    NodeMotionSteps out;
    out.rotation_exponent = static_cast<int>(coder.raw(static_cast<std::uint32_t>(wanted.rotation_exponent), 4));
    out.shift_exponent = static_cast<int>(coder.raw(static_cast<std::uint32_t>(wanted.shift_exponent), 5));
    return out;
}

template <class Coder>
FieldSteps code_steps(Coder& coder, const FieldSteps& wanted, const FieldSteps* before, std::size_t components) {
    if (before && code_flag(coder, wanted == *before)) return *before;
    FieldSteps out;
    if (components == 3) out.turned = before ? before->turned : code_flag(coder, wanted.turned);
    for (std::size_t c = 0; c < components; ++c) {
        const bool same = c > 0 && code_flag(coder, wanted.step[c] == wanted.step[c - 1]);
        out.step[c] = same ? out.step[c - 1] : code_number(coder, wanted.step[c]);
    }
    return out;
}

template <class Coder>
FilmProjection code_projection(Coder& coder, const FilmProjection& wanted, const FilmProjection& before) {
    if (code_flag(coder, wanted == before)) return before;
    FilmProjection out;
    for (std::size_t i = 0; i < out.rows.size(); ++i)
        out.rows[i] = std::bit_cast<float>(coder.raw(std::bit_cast<std::uint32_t>(wanted.rows[i]), 32));
    return out;
}

template <class Coder>
TrackedHead code_head(Coder& coder, const TrackedHead& wanted, const KnownOfHead& known) {
    const auto* before = known.before;
    TrackedHead out;
    out.captured = code_captured(coder, wanted.captured, before ? before->captured : known.of_intra);
    out.motion = code_steps(coder, wanted.motion, before ? &before->motion : nullptr);
    out.displacement = code_steps(coder, wanted.displacement, before ? &before->displacement : nullptr, 1);
    if (known.projection)
        out.projection = code_projection(coder, wanted.projection, before ? before->projection : *known.projection);
    if (!known.colours) return out;
    out.colour = code_steps(coder, wanted.colour, before ? &before->colour : nullptr, 3);
    if (code_flag(coder, wanted.colour_run > 0)) out.colour_run = code_number(coder, wanted.colour_run);
    return out;
}

bool in_range(const FieldSteps& steps) {
    return std::all_of(steps.step.begin(), steps.step.end(), [](auto step) { return step <= FieldSteps::most; });
}

}  // namespace

void write_tracked_head(RangeEncoder& encoder, const TrackedHead& head, const KnownOfHead& known) {
    WritingCoder<RangeEncoder> coder{encoder};
    code_head(coder, head, known);
}

Result<TrackedHead> read_tracked_head(RangeDecoder& decoder, const KnownOfHead& known) {
    ReadingCoder<RangeDecoder> coder{decoder};
    const auto out = code_head(coder, {}, known);
    if (out.motion.rotation_exponent > NodeMotionSteps::most_rotation ||
        out.motion.shift_exponent > NodeMotionSteps::most_shift || !in_range(out.displacement) || !in_range(out.colour))
        return fail(ErrorKind::corrupt_stream, "tracked frame: its steps are out of range");
    if (!is_finite(out.projection))
        return fail(ErrorKind::corrupt_stream, "tracked frame: a number of its projection is not finite");
    return out;
}

LayerBytes layer_shares(const TrackedRunEnds& ends, std::size_t bytes, std::size_t colour_run) {
    LayerBytes out;
    const std::size_t first_run = bytes - colour_run;
    std::size_t at = std::min(ends.head, first_run);
    const auto give = [&](Layer layer, std::size_t end) {
        end = std::min(end, first_run);
        out[layer] = end - at;
        at = end;
    };
    if (ends.presence > 0) give(Layer::presence, ends.presence);
    give(Layer::transforms, ends.motion);
    give(Layer::geometry, ends.displacement);
    if (colour_run == 0) give(Layer::colour, ends.colour);
    out[Layer::colour] += colour_run;
    return out;
}

}  // namespace htvm::internal
