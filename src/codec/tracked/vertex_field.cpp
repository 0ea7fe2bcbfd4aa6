#include "codec/tracked/vertex_field.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "codec/tracked/vertex_field_walk.h"
#include "entropy/range_coder.h"

namespace htvm::internal {

namespace {

// The axes of a turned field, in 1/65536: the mean, red less blue, green less the other two; orthonormal.
constexpr std::int64_t third = 37837, half = 46341, sixth = 26755;  // 1/sqrt(3), 1/sqrt(2), 1/sqrt(6)

}  // namespace

std::int64_t root_step(std::uint32_t step, std::size_t vertex_count) {
    const double root = std::sqrt(static_cast<double>(std::max<std::size_t>(vertex_count, 1)));
    return std::max<std::int64_t>(1, static_cast<std::int64_t>(step / root));
}

namespace {

// The difference of each node's two children as the slopes of `means` (by node of this level) say, of N components side
// by side: most of the time goes into the walk over the neighbours.
template <std::size_t N>
void predict_splits(const HierarchyLevel& level, const std::array<std::span<const std::int32_t>, N>& means,
                    const std::array<std::span<std::int32_t>, N>& splits) {
    constexpr std::int64_t most = std::int64_t{2} * most_mean;
    const std::span<const std::uint32_t> second = level.second, first_neighbour = level.first_neighbour,
                                         neighbours = level.neighbours;
    const std::span<const std::int32_t> slopes = level.slopes;
    for (std::size_t p = 0; p < second.size(); ++p) {
        std::array<std::int64_t, N> sum{};
        std::int64_t of_own = 0;  // how much the node's own mean takes off, in all together
        if (second[p] != no_node) {
            const std::uint32_t end = first_neighbour[p + 1];
            for (std::uint32_t i = first_neighbour[p]; i < end; ++i) {
                const std::int64_t slope = slopes[i];
                of_own += slope;
                for (std::size_t c = 0; c < N; ++c) sum[c] += slope * means[c][neighbours[i]];
            }
        }
        for (std::size_t c = 0; c < N; ++c)
            splits[c][p] =
                static_cast<std::int32_t>(std::clamp((sum[c] - of_own * means[c][p]) >> slope_bits, -most, most));
    }
}

}  // namespace

// In 32 bits where all that is mixed is small, as on every common mesh: several nodes at once.
void LevelPrediction::choose(const LevelMode& mode) {
    const std::size_t nodes = now.size();
    chosen.resize(nodes);
    const bool with_before = mode.before > 0 && !before.empty();
    constexpr std::int32_t small = 1 << 24;
    std::int32_t bits = 0;  // of all, negative ones turned over
    for (const auto x : now) bits |= x ^ (x >> 31);
    if (with_before)
        for (std::size_t p = 0; p < nodes; ++p)
            bits |= (before[p] ^ (before[p] >> 31)) | (slope_before[p] ^ (slope_before[p] >> 31));
    if (bits >= small) {
        for (std::size_t p = 0; p < nodes; ++p) chosen[p] = of(p, mode);
        return;
    }
    const auto slope = static_cast<std::int32_t>(mode.slope), weight = static_cast<std::int32_t>(mode.before);
    if (with_before)
        for (std::size_t p = 0; p < nodes; ++p)
            chosen[p] = (slope * now[p] + weight * before[p] - ((slope * weight * slope_before[p]) >> 2) + 2) >> 2;
    else
        for (std::size_t p = 0; p < nodes; ++p) chosen[p] = (slope * now[p] + 2) >> 2;
}

void split_level(const HierarchyLevel& level, std::span<const std::int32_t> means,
                 std::span<const std::int32_t> predicted, std::uint32_t step, std::span<const std::int32_t> rests,
                 std::vector<std::int32_t>& finer) {
    const std::span<const std::uint32_t> first = level.first, second = level.second, second_share = level.second_share;
    const std::span<std::int32_t> out = finer;
    for (std::size_t p = 0; p < second.size(); ++p) {
        if (second[p] == no_node) {
            out[first[p]] = means[p];
            continue;
        }
        std::int64_t difference = predicted[p];
        if (rests[p] != 0) difference += rests[p] * split_step(step, level.split_scale[p]);
        const SplitMeans children = split_mean(means[p], difference, second_share[p]);
        out[first[p]] = children.first;
        out[second[p]] = children.second;
    }
}

namespace {

// The magnitudes of `above` by node of the finer level, from those of the coarser: a node that was joined to none takes
// over what is above it.
void pass_down(const HierarchyLevel& coarser, std::span<const std::uint8_t> own, std::span<const std::uint8_t> above,
               std::vector<std::uint8_t>& below) {
    const std::span<const std::uint32_t> first = coarser.first, second = coarser.second;
    const std::span<std::uint8_t> out = below;
    for (std::size_t p = 0; p < first.size(); ++p) {
        const bool single = second[p] == no_node;
        out[first[p]] = single ? above[p] : own[p];
        if (!single) out[second[p]] = own[p];
    }
}

}  // namespace

FieldWalk::FieldWalk(const VertexHierarchy& mesh, const FieldSteps& steps, std::size_t count,
                     const FieldHistory* before)
    : hierarchy(mesh), has_history(before != nullptr), components(count) {
    const std::size_t levels = hierarchy.levels.size();
    for (std::size_t c = 0; c < count; ++c) {
        ComponentWalk& component = components[c];
        component.before = before ? &before->planes[c] : nullptr;
        component.step = steps.step[c];
        component.last = first_mode(has_history);
        component.above.assign(1, 0);
        FieldPlane& plane = component.plane;
        plane.mean.resize(levels + 1);
        plane.mean[0].resize(hierarchy.vertex_count);
        plane.slope.resize(levels);
        plane.magnitude.resize(levels);
        component.rests.resize(levels);
        for (std::size_t k = 0; k < levels; ++k) {
            const std::size_t nodes = hierarchy.levels[k].size();
            plane.mean[k + 1].resize(nodes);
            plane.slope[k].resize(nodes);
            plane.magnitude[k].resize(nodes);
            component.rests[k].resize(nodes);
        }
    }
}

void FieldWalk::begin_level(std::size_t k, std::size_t c) {
    FieldPlane& plane = components[c].plane;
    predict_splits<1>(hierarchy.levels[k], {plane.mean[k + 1]}, {plane.slope[k]});
    prepare_level(k, c);
}

void FieldWalk::begin_level(std::size_t k) {
    const bool all = std::all_of(components.begin(), components.end(), [](const auto& c) { return c.step != 0; });
    if (components.size() != 3 || !all) {
        for (std::size_t c = 0; c < components.size(); ++c)
            if (components[c].step != 0) begin_level(k, c);
        return;
    }
    FieldPlane &a = components[0].plane, &b = components[1].plane, &c = components[2].plane;
    predict_splits<3>(hierarchy.levels[k], {a.mean[k + 1], b.mean[k + 1], c.mean[k + 1]},
                      {a.slope[k], b.slope[k], c.slope[k]});
    for (std::size_t i = 0; i < components.size(); ++i) prepare_level(k, i);
}

void FieldWalk::prepare_level(std::size_t k, std::size_t c) {
    const HierarchyLevel& level = hierarchy.levels[k];
    ComponentWalk& component = components[c];
    component.active.resize(level.size());
    LevelPrediction& prediction = component.prediction;
    prediction.now = component.plane.slope[k];
    if (!component.before) return;
    prediction.slope_before = component.before->slope[k];
    const auto& means = component.before->mean[k];
    prediction.before.assign(level.size(), 0);
    for (std::size_t p = 0; p < level.size(); ++p)
        if (level.second[p] != no_node) prediction.before[p] = means[level.first[p]] - means[level.second[p]];
}

void FieldWalk::end_level(std::size_t k, std::size_t c, const LevelMode& mode) {
    const HierarchyLevel& level = hierarchy.levels[k];
    ComponentWalk& component = components[c];
    FieldPlane& plane = component.plane;
    if (!mode.coded) component.prediction.choose(mode);
    split_level(level, plane.mean[k + 1], component.prediction.chosen, component.step, component.rests[k],
                plane.mean[k]);
    if (k == 0) return;
    std::vector<std::uint8_t> below(hierarchy.levels[k - 1].size(), 0);
    pass_down(level, plane.magnitude[k], component.above, below);
    component.above = std::move(below);
}

void FieldWalk::find_contexts(std::size_t k, std::size_t c) {
    using C = SplitContext;
    ComponentWalk& component = components[c];
    const std::size_t nodes = hierarchy.levels[k].size();
    const auto three = [](std::uint8_t magnitude) { return std::min<std::uint8_t>(magnitude, C::magnitudes - 1); };
    const std::span<std::uint8_t> active = component.active;
    component.activity.assign(nodes, 0);
    auto& contexts = component.contexts;
    contexts.by_level.resize(nodes);
    contexts.by_before.assign(nodes, 0);
    contexts.by_other.assign(nodes, 0);
    const std::span<std::uint8_t> by_level = contexts.by_level, by_before = contexts.by_before,
                                  by_other = contexts.by_other;
    const auto add_other = [&](const std::vector<std::uint8_t>& magnitude, int weight) {
        const std::span<const std::uint8_t> of = magnitude;
        for (std::size_t p = 0; p < nodes; ++p)
            by_other[p] = static_cast<std::uint8_t>(by_other[p] + weight * three(of[p]));
    };
    constexpr int magnitudes = C::magnitudes;
    if (c > 0) add_other(components[c - 1].plane.magnitude[k], magnitudes * magnitudes * magnitudes);
    if (c > 1) add_other(components[c - 2].plane.magnitude[k], magnitudes * magnitudes);
    add_other(component.above, magnitudes);
    if (component.before) {
        add_other(component.before->magnitude[k], 1);
        const std::span<const std::uint8_t> before = component.before->magnitude[k];
        for (std::size_t p = 0; p < nodes; ++p)
            by_before[p] = static_cast<std::uint8_t>(static_cast<int>(C::activities) * three(before[p]));
    }
    const std::span<const std::uint8_t> above = component.above;
    for (std::size_t p = 0; p < nodes; ++p) {
        by_level[p] = static_cast<std::uint8_t>(static_cast<int>(C::activities) * three(above[p]));
        active[p] = activity_above(above[p]);
    }
}

FieldHistory history_of(FieldWalk& walk, bool turned) {
    FieldHistory out{.turned = turned, .planes = {}};
    for (auto& component : walk.components) out.planes.push_back(std::move(component.plane));
    return out;
}

std::vector<std::int32_t> field_values(const std::vector<FieldPlane>& planes, std::size_t vertex_count, bool turned) {
    const std::size_t components = planes.size();
    std::vector<std::int32_t> values(vertex_count * components);
    if (!turned) {
        for (std::size_t c = 0; c < components; ++c)
            for (std::size_t v = 0; v < vertex_count; ++v)
                values[v * components + c] = (planes[c].mean[0][v] + field_one / 2) >> field_bits;
        return values;
    }
    constexpr int shift = 16 + field_bits;
    constexpr std::int64_t rounding = std::int64_t{1} << (shift - 1);
    for (std::size_t v = 0; v < vertex_count; ++v) {
        const std::int64_t a = third * planes[0].mean[0][v], b = half * planes[1].mean[0][v];
        const std::int64_t s = sixth * planes[2].mean[0][v];
        values[v * 3 + 0] = static_cast<std::int32_t>((a + b - s + rounding) >> shift);
        values[v * 3 + 1] = static_cast<std::int32_t>((a + 2 * s + rounding) >> shift);
        values[v * 3 + 2] = static_cast<std::int32_t>((a - b - s + rounding) >> shift);
    }
    return values;
}

bool history_fits(const FieldHistory& history, const VertexHierarchy& hierarchy, std::size_t components, bool turned) {
    if (history.planes.size() != components || history.turned != turned) return false;
    const std::size_t levels = hierarchy.levels.size();
    for (const FieldPlane& plane : history.planes) {
        if (plane.mean.size() != levels + 1 || plane.slope.size() != levels || plane.magnitude.size() != levels)
            return false;
        if (plane.mean[0].size() != hierarchy.vertex_count) return false;
        for (std::size_t k = 0; k < levels; ++k)
            if (plane.mean[k + 1].size() != hierarchy.levels[k].size() ||
                plane.slope[k].size() != hierarchy.levels[k].size() ||
                plane.magnitude[k].size() != hierarchy.levels[k].size())
                return false;
    }
    return true;
}

namespace {

struct FieldReader {
    RangeDecoder& decoder;
    bool bit(BinaryModel& model, bool) { return decoder.bit(model); }
    std::uint32_t raw(std::uint32_t, int n) { return decoder.raw(n); }
};

void read_field(FieldWalk& walk, FieldReader& reader) {
    for (auto& component : walk.components)
        if (component.step != 0) code_root(reader, component, walk.hierarchy.vertex_count, 0);
    for (std::size_t k = walk.hierarchy.levels.size(); k-- > 0;) {
        walk.begin_level(k);
        for (std::size_t c = 0; c < walk.components.size(); ++c) {
            if (walk.components[c].step == 0) continue;
            const LevelMode mode = code_mode(reader, walk, walk.components[c].last, {});
            if (mode.coded)
                code_level(reader, walk, k, c, mode, [](auto, auto, auto, const auto&, const auto&) { return 0; });
            walk.end_level(k, c, mode);
        }
    }
}

}  // namespace

Result<DecodedField> decode_field(RangeDecoder& decoder, const FieldSteps& steps, const VertexHierarchy& hierarchy,
                                  std::size_t components, const FieldHistory* before) {
    if (components == 0 || components > most_field_components)
        return fail(ErrorKind::bad_input, "vertex field: there must be one to three components");
    if (steps.turned && components != 3)
        return fail(ErrorKind::bad_input, "vertex field: only three components can be turned");
    for (const auto step : steps.step)
        if (step > FieldSteps::most) return fail(ErrorKind::bad_input, "vertex field: a step is out of range");
    if (before && !history_fits(*before, hierarchy, components, steps.turned))
        return fail(ErrorKind::bad_input, "vertex field: the frame before is of another mesh or another kind of field");
    FieldWalk walk(hierarchy, steps, components, before);
    FieldReader reader{decoder};
    if (hierarchy.vertex_count > 0) read_field(walk, reader);
    if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "vertex field: its run ends too early");
    DecodedField out;
    out.history = history_of(walk, steps.turned);
    out.values = field_values(out.history.planes, hierarchy.vertex_count, steps.turned);
    return out;
}

}  // namespace htvm::internal
