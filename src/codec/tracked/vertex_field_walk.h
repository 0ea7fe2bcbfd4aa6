// What encoder and decoder of a vertex field share: the walk over the hierarchy from coarse to fine, the prediction of
// each difference and its contexts. Integers throughout; means and differences are in 1/256 of the values' unit.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "codec/tracked/vertex_field.h"
#include "core/lattice.h"
#include "entropy/mixing.h"
#include "entropy/models.h"
#include "entropy/range_coder.h"

namespace htvm::internal {

// What is known round a difference before it is coded, as the models that it selects. They follow from classes, each
// from 0 to below its limit.
struct SplitContext {
    static constexpr std::size_t levels = 6, magnitudes = 3, activities = 12, steeps = 8, signs = 3;
    std::size_t level = 0;  // of the hierarchy, the finest is 0
    // How large the differences round it are; for one that is not coded yet, the one above it counts.
    std::size_t activity = 0;
    // By level, the magnitude of the difference above (0, 1, more) and the activity.
    std::size_t by_level = level * magnitudes * activities;
    // By the magnitude of the same difference in the frame before and the activity.
    std::size_t by_before = 0;
    // By the magnitudes of the same difference in the component before and in the one before that, of the difference
    // above, and of the same in the frame before.
    std::size_t by_other = 0;
    // By level and the magnitude of the predicted difference over the step.
    std::size_t by_steep = level * steeps;
};
// The same for its sign.
struct SignContext {
    std::size_t by_slope = 0;  // the predicted difference's sign (0 none, 1 positive, 2 negative) and magnitude
    std::size_t by_sign = 0;   // the sign of the same difference in the component before, and that of the predicted one
};

// The models of one component.
struct SplitModels {
    template <std::size_t N>
    using Models = std::array<BinaryModel, N>;
    using C = SplitContext;

    // Whether other than zero.
    Models<C::levels * C::magnitudes * C::activities> by_level{};
    Models<C::magnitudes * C::activities> by_before{};
    Models<C::magnitudes * C::magnitudes * C::magnitudes * C::magnitudes> by_other{};
    Models<C::steeps * C::levels> by_steep{};
    std::array<Mixer<4>, C::levels> nonzero_mixer{};
    // Whether negative.
    Models<C::signs * C::steeps> by_slope{};
    Models<C::signs * C::signs> by_sign{};
    Mixer<2> sign_mixer{};
    // The magnitude less one: in unary, from `unary` on as an exponential Golomb code.
    static constexpr std::size_t unary = 6;
    std::array<Models<unary>, C::activities> more_by_activity{};
    std::array<Models<unary>, C::magnitudes * C::magnitudes> more_by_before{};
    std::array<Mixer<2>, unary> more_mixer{};
    Models<32> top{}, next{};
};

namespace split_detail {

inline std::array<BinaryModel*, 4> nonzero(SplitModels& m, const SplitContext& c) {
    return {&m.by_level[c.by_level], &m.by_before[c.by_before], &m.by_other[c.by_other], &m.by_steep[c.by_steep]};
}

inline std::array<BinaryModel*, 2> negative(SplitModels& m, const SignContext& c) {
    return {&m.by_slope[c.by_slope], &m.by_sign[c.by_sign]};
}

inline std::array<BinaryModel*, 2> more(SplitModels& m, const SplitContext& c, std::size_t i) {
    constexpr std::size_t above_and_before = SplitContext::magnitudes * SplitContext::magnitudes;
    return {&m.more_by_activity[c.activity][i], &m.more_by_before[c.by_other % above_and_before][i]};
}

}  // namespace split_detail

inline constexpr std::int32_t most_split = 1 << 30;  // of a quantised difference's magnitude

// Codes the sign and the magnitude of a quantised difference that is not zero. Contexts are passed as values, so that
// they are in memory only where this is called, which is seldom.
template <class Coder>
std::int32_t code_nonzero(Coder& coder, SplitModels& m, SplitContext c, SignContext sign, std::int32_t wanted) {
    const bool negative = code_mixed(coder, m.sign_mixer, split_detail::negative(m, sign), wanted < 0);
    const auto rest = static_cast<std::uint32_t>(std::max(std::abs(wanted), 1) - 1);
    std::uint32_t coded = 0;
    while (coded < SplitModels::unary &&
           code_mixed(coder, m.more_mixer[coded], split_detail::more(m, c, coded), rest > coded))
        ++coded;
    if (coded == SplitModels::unary) {
        const std::uint32_t left = std::max(rest, coded) - coded + 1;
        const int width = static_cast<int>(std::bit_width(left)) - 1;
        int top = 0;
        while (top < 30 && coder.bit(m.top[static_cast<std::size_t>(top)], top < width)) ++top;
        std::uint32_t value = 1;
        if (top > 0) value = 2 + coder.bit(m.next[static_cast<std::size_t>(top)], (left >> std::max(width - 1, 0)) & 1);
        if (top > 1) value = (value << (top - 1)) | coder.raw(left & ((1u << (top - 1)) - 1), top - 1);
        coded += value - 1;
    }
    const auto magnitude = static_cast<std::int32_t>(std::min(coded, static_cast<std::uint32_t>(most_split) - 1)) + 1;
    return negative ? -magnitude : magnitude;
}

// Codes one quantised difference. Coder::bit(BinaryModel&, bool) and raw(std::uint32_t, int) put what is wanted into
// the stream, or, decoding, ignore it, and return what the stream says. Most are zero, so that this is done where it is
// called, and what follows elsewhere. sign() gives the context of the sign.
template <class Coder, class Sign>
[[gnu::always_inline]] inline std::int32_t code_split(Coder& coder, SplitModels& m, const SplitContext& c,
                                                      const Sign& sign, std::int32_t wanted) {
    if (!code_mixed(coder, m.nonzero_mixer[c.level], split_detail::nonzero(m, c), wanted != 0)) return 0;
    return code_nonzero(coder, m, c, sign(), wanted);
}

inline constexpr int field_bits = 8;  // of the fraction of means, differences and steps
inline constexpr std::int32_t field_one = 1 << field_bits;
inline constexpr std::int32_t most_mean = 1 << 29;

// How the differences of a level and component are coded.
struct LevelMode {
    bool coded = false;        // false: all as predicted
    std::uint32_t slope = 0;   // the weight of the predicted difference in quarters, 0..7
    std::uint32_t before = 0;  // the weight of the frame before in quarters, 0..4
    bool operator==(const LevelMode&) const = default;
};
// What stands for the mode of the level above at the top.
inline LevelMode first_mode(bool has_history) { return {.coded = true, .slope = 4, .before = has_history ? 4u : 0u}; }

// The quantisation step of the difference at a node.
inline std::int64_t split_step(std::uint32_t step, std::uint32_t scale) {
    return std::max<std::int64_t>(1, (std::int64_t{step} * scale) >> split_scale_bits);
}

// The quantisation step of the mean of all: the whole mesh's error as one vertex's.
std::int64_t root_step(std::uint32_t step, std::size_t vertex_count);

// The differences of one level and component, ready to be coded.
struct LevelPrediction {
    std::span<const std::int32_t> now, slope_before;  // by node, as the slopes say: of this frame and of the one before
    std::vector<std::int32_t> before;                 // by node, in the frame before; like the one above empty without
    std::vector<std::int32_t> chosen;                 // by node, as the mode mixes them

    std::int32_t of(std::size_t node, const LevelMode& mode) const {
        std::int64_t sum = std::int64_t{mode.slope} * now[node];
        if (mode.before > 0 && !before.empty())
            sum += std::int64_t{mode.before} * before[node] -
                   (((std::int64_t{mode.slope} * mode.before) * slope_before[node]) >> 2);
        return static_cast<std::int32_t>(std::clamp<std::int64_t>((sum + 2) >> 2, -2 * most_mean, 2 * most_mean));
    }
    void choose(const LevelMode& mode);
};

// The two means that a node's own mean and the difference between them give.
struct SplitMeans {
    std::int32_t first, second;
};
inline SplitMeans split_mean(std::int32_t mean, std::int64_t difference, std::uint32_t second_share) {
    // Seldom: every sum of the small is small.
    const auto beyond = [](std::int64_t x, std::int64_t most) {
        return static_cast<std::uint64_t>(x + most) > 2 * static_cast<std::uint64_t>(most);
    };
    constexpr std::int64_t most_difference = std::int64_t{2} * most_mean;
    if (beyond(difference, most_difference)) difference = difference < 0 ? -most_difference : most_difference;
    const std::int64_t part = (difference * second_share + (std::int64_t{1} << (share_bits - 1))) >> share_bits;
    const std::int64_t first = mean + part;
    auto kept = [&](std::int64_t m) {
        if (beyond(m, most_mean)) m = m < 0 ? -most_mean : most_mean;
        return static_cast<std::int32_t>(m);
    };
    return {kept(first), kept(first - difference)};
}

// Sets the means of the finer level from the level's predicted differences and quantised rests.
void split_level(const HierarchyLevel& level, std::span<const std::int32_t> means,
                 std::span<const std::int32_t> predicted, std::uint32_t step, std::span<const std::int32_t> rests,
                 std::vector<std::int32_t>& finer);

inline std::uint8_t magnitude_of(std::int32_t rest) {
    return static_cast<std::uint8_t>(std::min<std::uint32_t>(static_cast<std::uint32_t>(std::abs(rest)), 255));
}

// How much a node adds to the activity round its neighbours: by what is above it until its difference is coded.
constexpr std::uint8_t activity_above(std::uint8_t above) { return std::min<std::uint8_t>(above, 4); }
constexpr std::uint8_t activity_coded(std::uint8_t own) { return static_cast<std::uint8_t>(2 * std::min<int>(own, 4)); }

// The class of a sum of activities: exact up to 8, then by sixths.
inline constexpr auto activity_classes = [] {
    std::array<std::uint8_t, hierarchy_row_limit * activity_coded(255) + 1> classes{};
    for (std::size_t a = 0; a < classes.size(); ++a)
        classes[a] = static_cast<std::uint8_t>(a < 8 ? a : std::min(8 + (a - 8) / 6, SplitContext::activities - 1));
    return classes;
}();

// The magnitude's class of the predicted difference over the step: the bits of 8 * |predicted| / step, without
// dividing.
inline std::size_t steep_class(std::int32_t predicted, std::int64_t step) {
    const auto steep = static_cast<std::uint64_t>(8 * std::abs(std::int64_t{predicted}));
    const auto unit = static_cast<std::uint64_t>(step);
    // Neither width is that of zero, which is another case, and where it matters neither changes.
    const int bits = static_cast<int>(std::bit_width(steep | 1)) - static_cast<int>(std::bit_width(unit | 1));
    if (bits < 0) return 0;
    return std::min(static_cast<std::size_t>(bits) + (steep >= unit << bits), SplitContext::steeps - 1);
}

inline SignContext sign_context(std::int32_t predicted, std::size_t steep, std::int32_t other) {
    using C = SplitContext;
    const std::size_t slope = steep == 0 ? 0 : predicted > 0 ? 1 : 2;
    const std::size_t sign = other == 0 ? 0 : other > 0 ? 1 : 2;
    return {.by_slope = slope * C::steeps + steep, .by_sign = sign * C::signs + slope};
}

// The parts of a level's contexts that are known before the first of its differences is coded, by node.
struct LevelContexts {
    std::vector<std::uint8_t> by_level, by_before;  // without the level and the activity
    std::vector<std::uint8_t> by_other;
};

// One component of a field while its levels are coded, from the top to the finest. Components know of each other what
// the contexts need: the rests of those before at the same level.
struct ComponentWalk {
    const FieldPlane* before = nullptr;
    std::uint32_t step = 0;
    FieldPlane plane;
    SplitModels models;
    LevelMode last;                                // of the level above, which most levels repeat
    std::vector<std::uint8_t> above;               // magnitudes by node of the level at hand
    std::vector<std::vector<std::int32_t>> rests;  // by level and node
    std::vector<std::uint8_t> active;              // of the level at hand, what each node adds to the activity
    std::vector<std::uint16_t> activity;           // around each node, where the level is mutual
    LevelContexts contexts;
    LevelPrediction prediction;
};

// Everything that is known of a field while it is coded.
struct FieldWalk {
    FieldWalk(const VertexHierarchy& hierarchy, const FieldSteps& steps, std::size_t components,
              const FieldHistory* before);

    const VertexHierarchy& hierarchy;
    bool has_history;
    std::array<BinaryModel, 2> coded;  // whether a level is, by whether the level above was
    BinaryModel same;                  // whether its mode is that of the level above
    std::vector<ComponentWalk> components;

    void begin_level(std::size_t k, std::size_t c);                       // predicts its differences
    void begin_level(std::size_t k);                                      // of all components, which is faster
    void end_level(std::size_t k, std::size_t c, const LevelMode& mode);  // sets the means of the finer level
    void find_contexts(std::size_t k, std::size_t c);                     // before its differences are coded

private:
    void prepare_level(std::size_t k, std::size_t c);
};

// Codes the differences of one level and component into its rests and magnitudes, which are zero. choose(node,
// predicted, step, context, sign) gives the rest that is wanted; decoding, anything.
template <class Coder, class Choose>
void code_level(Coder& coder, FieldWalk& walk, std::size_t k, std::size_t c, const LevelMode& mode,
                const Choose& choose) {
    using C = SplitContext;
    const HierarchyLevel& level = walk.hierarchy.levels[k];
    ComponentWalk& component = walk.components[c];
    component.prediction.choose(mode);
    walk.find_contexts(k, c);
    // Bytes are written here, which could be part of anything that is not a copy.
    const std::span<const std::int32_t> chosen = component.prediction.chosen;
    const std::span<std::uint8_t> own = component.plane.magnitude[k], active = component.active;
    const std::span<const std::uint8_t> by_level = component.contexts.by_level, by_other = component.contexts.by_other,
                                        by_before = component.contexts.by_before;
    const std::span<std::int32_t> rests = component.rests[k];
    const std::span<const std::int32_t> other =
        c > 0 ? std::span<const std::int32_t>(walk.components[c - 1].rests[k]) : std::span<const std::int32_t>();
    const std::span<const std::uint32_t> second = level.second, first_neighbour = level.first_neighbour;
    const std::span<const std::uint32_t> neighbours = level.neighbours;
    const std::span<const std::uint16_t> split_scale = level.split_scale;
    const std::uint32_t step = component.step;
    const std::size_t depth = std::min(k, C::levels - 1);
    const std::size_t first_by_level = depth * C::magnitudes * C::activities, first_by_steep = depth * C::steeps;
    // Most nodes add nothing, so that it is faster to add what a node does to its neighbours than to ask them.
    const bool mutual = level.mutual;
    const std::span<std::uint16_t> activities = component.activity;
    const auto add_around = [&](std::size_t p, int change) {
        for (std::uint32_t i = first_neighbour[p]; i < first_neighbour[p + 1]; ++i)
            activities[neighbours[i]] = static_cast<std::uint16_t>(activities[neighbours[i]] + change);
    };
    if (mutual)
        for (std::size_t p = 0; p < second.size(); ++p)
            if (active[p] != 0) add_around(p, active[p]);
    for (std::size_t p = 0; p < second.size(); ++p) {
        std::int32_t rest = 0;
        if (second[p] != no_node) {
            const std::int64_t unit = split_step(step, split_scale[p]);
            std::size_t active_around = 0;
            if (mutual)
                active_around = activities[p];
            else
                for (std::uint32_t i = first_neighbour[p]; i < first_neighbour[p + 1]; ++i)
                    active_around += active[neighbours[i]];
            const std::size_t activity = activity_classes[active_around];
            const std::size_t steep = steep_class(chosen[p], unit);
            const SplitContext context{.level = depth,
                                       .activity = activity,
                                       .by_level = first_by_level + by_level[p] + activity,
                                       .by_before = by_before[p] + activity,
                                       .by_other = by_other[p],
                                       .by_steep = first_by_steep + steep};
            const auto sign = [&] { return sign_context(chosen[p], steep, other.empty() ? 0 : other[p]); };
            rest = code_split(coder, component.models, context, sign, choose(p, chosen[p], unit, context, sign));
        }
        if (rest == 0 && active[p] == 0) continue;
        rests[p] = rest;
        own[p] = magnitude_of(rest);
        const std::uint8_t now = activity_coded(own[p]);
        if (mutual) add_around(p, now - active[p]);
        active[p] = now;
    }
}

// Codes how the differences of a level and component are coded.
template <class Coder>
LevelMode code_mode(Coder& coder, FieldWalk& walk, LevelMode& mode, const LevelMode& wanted) {
    mode.coded = coder.bit(walk.coded[mode.coded], wanted.coded);
    if (coder.bit(walk.same, wanted.slope == mode.slope && wanted.before == mode.before)) return mode;
    mode.slope = coder.raw(wanted.slope, 3);
    if (walk.has_history) mode.before = std::min(coder.raw(wanted.before, 3), 4u);
    return mode;
}

// Codes the mean of all of one component.
template <class Coder>
void code_root(Coder& coder, ComponentWalk& component, std::size_t vertex_count, std::int32_t wanted) {
    const std::int64_t unit = root_step(component.step, vertex_count);
    const std::int64_t from = component.before ? component.before->mean.back()[0] : 0;
    constexpr SplitContext context{.level = SplitContext::levels - 1};
    const std::int32_t quantised = code_split(
        coder, component.models, context, [] { return SignContext{}; }, wanted);
    component.plane.mean.back()[0] =
        static_cast<std::int32_t>(std::clamp<std::int64_t>(from + quantised * unit, -most_mean, most_mean));
}

// The history that a walk leaves; takes its planes.
FieldHistory history_of(FieldWalk& walk, bool turned);

// The values that planes stand for: rounded, turned back.
std::vector<std::int32_t> field_values(const std::vector<FieldPlane>& planes, std::size_t vertex_count, bool turned);

// True where the history is one of this hierarchy and as many components.
bool history_fits(const FieldHistory& history, const VertexHierarchy& hierarchy, std::size_t components, bool turned);

}  // namespace htvm::internal
