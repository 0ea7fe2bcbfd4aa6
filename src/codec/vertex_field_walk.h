// What encoder and decoder of a vertex field share: the walk over the hierarchy from coarse to fine, the prediction of
// each difference and its contexts. Integers throughout; means and differences are in 1/256 of the values' unit.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "codec/vertex_field.h"
#include "codec/vertex_field_models.h"
#include "core/lattice.h"

namespace htvm {

inline constexpr int field_bits = 8;  // of the fraction of means, differences and steps
inline constexpr std::int32_t field_one = 1 << field_bits;
inline constexpr std::int32_t most_mean = 1 << 29;
inline constexpr std::uint32_t most_step = 1u << 28;

// What the layer says beside the differences.
struct FieldHeader {
    bool turned = false, has_history = false;
    std::array<std::uint32_t, most_field_components> step{};  // 0: not coded
};

// How the differences of a level and component are coded.
struct LevelMode {
    bool coded = false;        // false: all as predicted
    std::uint32_t slope = 0;   // the weight of the predicted difference in quarters, 0..7
    std::uint32_t before = 0;  // the weight of the frame before in quarters, 0..4
    bool operator==(const LevelMode&) const = default;
};

// The quantisation step of the difference at a node.
inline std::int64_t split_step(std::uint32_t step, std::uint32_t scale) {
    return std::max<std::int64_t>(1, (std::int64_t{step} * scale) >> split_scale_bits);
}

// The quantisation step of the mean of all: the whole mesh's error as one vertex's.
std::int64_t root_step(std::uint32_t step, std::size_t vertex_count);

// The difference of each node's two children: as the slopes of `means` (by node of this level) say.
void predict_splits(const HierarchyLevel& level, std::span<const std::int32_t> means,
                    std::vector<std::int32_t>& splits);

// The differences of one level and component, ready to be coded.
struct LevelPrediction {
    std::vector<std::int32_t> now, slope_before, before;  // by node; the last two empty without a history

    std::int32_t of(std::size_t node, const LevelMode& mode) const {
        std::int64_t sum = std::int64_t{mode.slope} * now[node];
        if (mode.before > 0 && !before.empty())
            sum += std::int64_t{mode.before} * before[node] -
                   (((std::int64_t{mode.slope} * mode.before) * slope_before[node]) >> 2);
        return static_cast<std::int32_t>(std::clamp<std::int64_t>((sum + 2) >> 2, -2 * most_mean, 2 * most_mean));
    }
};

// means: by node of level k. before: the frame before, or null.
void predict_level(const VertexHierarchy& hierarchy, std::size_t k, std::span<const std::int32_t> means,
                   const FieldPlane* before, LevelPrediction& out);

// The two means that a node's own mean and the difference between them give.
struct SplitMeans {
    std::int32_t first, second;
};
inline SplitMeans split_mean(std::int32_t mean, std::int64_t difference, std::uint32_t second_share) {
    difference = std::clamp<std::int64_t>(difference, -2 * most_mean, 2 * most_mean);
    const std::int64_t part = (difference * second_share + (std::int64_t{1} << (share_bits - 1))) >> share_bits;
    const std::int64_t first = mean + part;
    auto kept = [](std::int64_t m) {
        return static_cast<std::int32_t>(std::clamp<std::int64_t>(m, -most_mean, most_mean));
    };
    return {kept(first), kept(first - difference)};
}

// Sets the means of the finer level from the level's quantised rests.
void split_level(const HierarchyLevel& level, std::span<const std::int32_t> means, const LevelPrediction& prediction,
                 const LevelMode& mode, std::uint32_t step, std::span<const std::int32_t> rests,
                 std::vector<std::int32_t>& finer);

// The magnitudes from which contexts are made, by node of one level.
struct LevelMagnitudes {
    std::span<const std::uint8_t> above;         // of the coarser level's difference that made the node
    std::span<const std::uint8_t> before;        // of the frame before; may be empty
    std::span<const std::int32_t> other, third;  // the same level's rests in the components before; may be empty
    std::span<const std::uint8_t> own;           // filled as the level is coded
};

inline std::uint8_t magnitude_of(std::int32_t rest) {
    return static_cast<std::uint8_t>(std::min<std::uint32_t>(static_cast<std::uint32_t>(std::abs(rest)), 255));
}

inline SplitContext split_context(const HierarchyLevel& level, std::size_t k, std::size_t node,
                                  const LevelMagnitudes& magnitudes, std::int32_t predicted, std::int64_t step) {
    SplitContext c;
    auto three = [](std::size_t magnitude) { return std::min<std::size_t>(magnitude, 2); };
    c.level = std::min(k, SplitContext::levels - 1);
    c.up = three(magnitudes.above[node]);
    std::size_t activity = 0;
    for (std::uint32_t i = level.first_neighbour[node]; i < level.first_neighbour[node + 1]; ++i) {
        const std::uint32_t n = level.neighbours[i];
        activity +=
            n < node ? 2 * std::min<std::size_t>(magnitudes.own[n], 4) : std::min<std::size_t>(magnitudes.above[n], 4);
    }
    c.activity = activity < 8 ? activity : std::min<std::size_t>(8 + (activity - 8) / 6, SplitContext::activities - 1);
    if (!magnitudes.before.empty()) c.before = three(magnitudes.before[node]);
    if (!magnitudes.other.empty()) {
        c.other = three(static_cast<std::size_t>(std::abs(magnitudes.other[node])));
        c.sign = magnitudes.other[node] == 0 ? 0 : magnitudes.other[node] > 0 ? 1 : 2;
    }
    if (!magnitudes.third.empty()) c.third = three(static_cast<std::size_t>(std::abs(magnitudes.third[node])));
    const auto steep = static_cast<std::uint64_t>(8 * std::abs(std::int64_t{predicted}) / step);
    c.steep = std::min<std::size_t>(static_cast<std::size_t>(std::bit_width(steep)), SplitContext::steeps - 1);
    c.slope = c.steep == 0 ? 0 : predicted > 0 ? 1 : 2;
    return c;
}

// The models of a field. Of each component, the mode of the level above, which most levels repeat.
struct FieldModels {
    std::array<SplitModels, most_field_components> splits;
    std::array<BinaryModel, 2> coded;  // by whether the level above was
    BinaryModel same;
    std::array<LevelMode, most_field_components> last;
};

// Codes the differences of one level and component into `rests` and `own`. choose(node, predicted, step, context) gives
// the rest that is wanted; decoding, anything.
template <class Coder, class Choose>
void code_level(Coder& coder, SplitModels& models, const HierarchyLevel& level, std::size_t k,
                const LevelPrediction& prediction, const LevelMode& mode, std::uint32_t step,
                const LevelMagnitudes& magnitudes, std::span<std::int32_t> rests, std::span<std::uint8_t> own,
                const Choose& choose) {
    for (std::size_t p = 0; p < level.size(); ++p) {
        if (level.second[p] == no_node) continue;
        const std::int32_t predicted = prediction.of(p, mode);
        const std::int64_t unit = split_step(step, level.split_scale[p]);
        const SplitContext context = split_context(level, k, p, magnitudes, predicted, unit);
        rests[p] = code_split(coder, models, context, choose(p, predicted, unit, context));
        own[p] = magnitude_of(rests[p]);
    }
}

// Codes how the differences of a level and component are coded.
template <class Coder>
LevelMode code_mode(Coder& coder, FieldModels& models, std::size_t c, bool has_history, const LevelMode& wanted) {
    LevelMode& mode = models.last[c];
    mode.coded = coder.bit(models.coded[mode.coded], wanted.coded);
    if (coder.bit(models.same, wanted.slope == mode.slope && wanted.before == mode.before)) return mode;
    mode.slope = coder.raw(wanted.slope, 3);
    if (has_history) mode.before = std::min(coder.raw(wanted.before, 3), 4u);
    return mode;
}

// The magnitudes of `above` by node of level k, from those of the level above: a node that was joined to none takes
// over what is above it.
void pass_down(const HierarchyLevel& coarser, std::span<const std::uint8_t> own, std::span<const std::uint8_t> above,
               std::vector<std::uint8_t>& below);

// Everything that is known of a field while its levels are coded, from the top to level k.
struct FieldWalk {
    FieldWalk(const VertexHierarchy& hierarchy, const FieldHeader& header, std::size_t components,
              const FieldHistory* before);

    const VertexHierarchy& hierarchy;
    FieldHeader header;
    const FieldHistory* before;
    FieldModels models;
    std::vector<FieldPlane> planes;
    std::vector<std::vector<std::uint8_t>> above;  // by component, by node of the level at hand
    std::vector<std::vector<std::int32_t>> rests;  // likewise
    LevelPrediction prediction;

    const FieldPlane* plane_before(std::size_t c) const { return before ? &before->planes[c] : nullptr; }
    void begin_level(std::size_t k);                                          // makes room for the rests of the level
    void begin_component(std::size_t k, std::size_t c);                       // predicts its differences
    void end_component(std::size_t k, std::size_t c, const LevelMode& mode);  // sets the means of the finer level
    LevelMagnitudes magnitudes(std::size_t k, std::size_t c) const;
    void end_level(std::size_t k);
};

// Codes the mean of all of component c.
template <class Coder>
void code_root(FieldWalk& walk, Coder& coder, std::size_t c, std::int32_t wanted) {
    const std::int64_t unit = root_step(walk.header.step[c], walk.hierarchy.vertex_count);
    const std::int64_t from = walk.before ? walk.before->planes[c].mean.back()[0] : 0;
    constexpr SplitContext context{.level = SplitContext::levels - 1};
    const std::int32_t quantised = code_split(coder, walk.models.splits[c], context, wanted);
    walk.planes[c].mean.back()[0] =
        static_cast<std::int32_t>(std::clamp<std::int64_t>(from + quantised * unit, -most_mean, most_mean));
}

// Codes the whole field. source gives what is wanted: root(c), mode(k, c), rest(k, c, node); decoding, anything.
template <class Coder, class Source>
void walk_field(FieldWalk& walk, Coder& coder, const Source& source) {
    const auto& levels = walk.hierarchy.levels;
    for (std::size_t c = 0; c < walk.planes.size(); ++c)
        if (walk.header.step[c] != 0) code_root(walk, coder, c, source.root(c));
    for (std::size_t k = levels.size(); k-- > 0;) {
        walk.begin_level(k);
        for (std::size_t c = 0; c < walk.planes.size(); ++c) {
            if (walk.header.step[c] == 0) continue;
            walk.begin_component(k, c);
            const LevelMode mode = code_mode(coder, walk.models, c, walk.before != nullptr, source.mode(k, c));
            if (mode.coded)
                code_level(coder, walk.models.splits[c], levels[k], k, walk.prediction, mode, walk.header.step[c],
                           walk.magnitudes(k, c), walk.rests[c], walk.planes[c].magnitude[k],
                           [&](std::size_t p, auto, auto, const auto&) { return source.rest(k, c, p); });
            walk.end_component(k, c, mode);
        }
        walk.end_level(k);
    }
}

// The values that planes stand for: rounded, turned back.
std::vector<std::int32_t> field_values(const std::vector<FieldPlane>& planes, std::size_t vertex_count, bool turned);

// True where the history is one of this hierarchy and as many components.
bool history_fits(const FieldHistory& history, const VertexHierarchy& hierarchy, std::size_t components, bool turned);

}  // namespace htvm
