#include <cmath>
#include <string>

#include "codec/vertex_field_walk.h"
#include "core/bytes.h"
#include "entropy/cost.h"
#include "entropy/range_encoder.h"

namespace htvm {

namespace {

// What the walk codes with: bytes, or the bits that they would take.
template <class Coder>
struct FieldCoder {
    Coder coder;
    bool bit(BinaryModel& model, bool wanted) {
        coder.bit(model, wanted);
        return wanted;
    }
    std::uint32_t raw(std::uint32_t wanted, int n) {
        coder.raw(wanted, n);
        return wanted;
    }
};
using FieldWriter = FieldCoder<RangeEncoder>;
using FieldCounter = FieldCoder<CostCounter>;

// The bits of a decision predicted from several contexts, without adapting them.
template <std::size_t N>
std::array<double, 2> mixed_cost(const Mixer<N>& mixer, const std::array<BinaryModel*, N>& models) {
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < N; ++i) sum += std::int64_t{log_odds_table[models[i]->one >> 4]} * mixer.weights[i];
    const std::int32_t odds = static_cast<std::int32_t>(std::clamp<std::int64_t>(sum >> 16, -2047, 2047));
    const BinaryModel model{static_cast<std::uint16_t>(probability_of_log_odds(odds)), 0};
    return {decision_cost(model, false), decision_cost(model, true)};
}

// The bits of small quantised differences in one context.
class SplitCost {
public:
    SplitCost(SplitModels& models, const SplitContext& context)
        : models_(models),
          context_(context),
          nonzero_(mixed_cost(models.nonzero_mixer[context.level], split_detail::nonzero(models, context))),
          negative_(mixed_cost(models.sign_mixer, split_detail::negative(models, context))) {}
    double of(std::int32_t rest) const {
        if (rest == 0) return nonzero_[0];
        double bits = nonzero_[1] + negative_[rest < 0];
        const auto more = static_cast<std::uint32_t>(std::abs(rest)) - 1;
        for (std::uint32_t i = 0; i < SplitModels::unary && i <= more; ++i)
            bits += mixed_cost(models_.more_mixer[i], split_detail::more(models_, context_, i))[more > i];
        if (more > SplitModels::unary) bits += 2 * std::log2(1.0 + static_cast<double>(more - SplitModels::unary));
        return bits;
    }

private:
    SplitModels& models_;
    const SplitContext& context_;
    std::array<double, 2> nonzero_, negative_;
};

// What is to be coded.
struct FieldPlan {
    std::vector<std::int32_t> roots;                            // by component
    std::vector<std::vector<LevelMode>> modes;                  // by level and component
    std::vector<std::vector<std::vector<std::int32_t>>> rests;  // likewise, by node

    std::int32_t root(std::size_t c) const { return roots[c]; }
    LevelMode mode(std::size_t k, std::size_t c) const { return modes[k][c]; }
    std::int32_t rest(std::size_t k, std::size_t c, std::size_t p) const { return rests[k][c][p]; }
};

using Means = std::vector<std::vector<std::int32_t>>;  // as FieldPlane::mean, of the field to be coded

// The means of all nodes from those of the vertices, which are in place.
void fill_means(const VertexHierarchy& hierarchy, Means& means) {
    means.resize(hierarchy.levels.size() + 1);
    for (std::size_t k = 0; k < hierarchy.levels.size(); ++k) {
        const HierarchyLevel& level = hierarchy.levels[k];
        means[k + 1].resize(level.size());
        for (std::size_t p = 0; p < level.size(); ++p) {
            const std::int64_t a = means[k][level.first[p]];
            std::int64_t mean = a;
            if (level.second[p] != no_node) {
                const std::int64_t b = means[k][level.second[p]];
                const auto n = static_cast<std::int64_t>(level.vertices[p]);
                const std::int64_t below = k == 0 ? 1 : hierarchy.levels[k - 1].vertices[level.second[p]];
                mean = a + divide_rounded((b - a) * below, n);
            }
            means[k + 1][p] = static_cast<std::int32_t>(mean);
        }
    }
}

std::vector<Means> means_of(const VertexHierarchy& hierarchy, std::span<const std::int32_t> values,
                            std::size_t components, bool turned) {
    std::vector<Means> means(components);
    for (std::size_t c = 0; c < components; ++c) {
        means[c].resize(1);
        auto& of_vertices = means[c][0];
        of_vertices.resize(hierarchy.vertex_count);
        for (std::size_t v = 0; v < hierarchy.vertex_count; ++v) {
            if (!turned) {
                of_vertices[v] = values[v * components + c] * field_one;
                continue;
            }
            const double red = values[v * 3], green = values[v * 3 + 1], blue = values[v * 3 + 2];
            const double along = c == 0   ? (red + green + blue) / std::sqrt(3.0)
                                 : c == 1 ? (red - blue) / std::sqrt(2.0)
                                          : (2 * green - red - blue) / std::sqrt(6.0);
            of_vertices[v] = static_cast<std::int32_t>(std::lround(along * field_one));
        }
        fill_means(hierarchy, means[c]);
    }
    return means;
}

// The weights of slopes and of the frame before that leave the least squared error, and bits for saying so.
LevelMode choose_mode(const HierarchyLevel& level, std::span<const std::int32_t> finer,
                      const LevelPrediction& prediction, const LevelMode& above, std::uint32_t step, double lambda) {
    const bool history = !prediction.before.empty();
    // Products of: difference, its prediction by slopes, difference before, its prediction before.
    std::array<std::array<double, 4>, 4> product{};
    for (std::size_t p = 0; p < level.size(); ++p) {
        if (level.second[p] == no_node) continue;
        const double weight = 1.0 / (1.0 * level.split_scale[p] * level.split_scale[p]);
        std::array<double, 4> x{1.0 * finer[level.first[p]] - finer[level.second[p]], 1.0 * prediction.now[p], 0, 0};
        if (history) x[2] = prediction.before[p], x[3] = prediction.slope_before[p];
        for (std::size_t i = 0; i < 4; ++i)
            for (std::size_t j = i; j < 4; ++j) product[i][j] += weight * x[i] * x[j];
    }
    const double in_steps = static_cast<double>(1 << split_scale_bits) / step;
    LevelMode best;
    double least = -1;
    for (std::uint32_t before = 0; before <= (history ? 4u : 0u); ++before)
        for (std::uint32_t slope = 0; slope < 8; ++slope) {
            const double a = before / 4.0, b = slope / 4.0;
            const std::array<double, 4> w{1, -b, -a, a * b};
            double error = 0;
            for (std::size_t i = 0; i < 4; ++i)
                for (std::size_t j = i; j < 4; ++j) error += (i == j ? 1 : 2) * w[i] * w[j] * product[i][j];
            const bool same = slope == above.slope && before == above.before;
            const double bits = same ? 0.5 : history ? 7.5 : 4.5;
            const double price = error * in_steps * in_steps + lambda * bits;
            if (least >= 0 && price >= least) continue;
            least = price;
            best = {.coded = true, .slope = slope, .before = before};
        }
    return best;
}

// Quantises one level of one component, weighing squared error against bits as the models stand.
LevelMode plan_level(FieldWalk& walk, std::size_t k, std::size_t c, std::span<const std::int32_t> finer,
                     double lambda) {
    const HierarchyLevel& level = walk.hierarchy.levels[k];
    walk.begin_component(k, c);
    LevelMode mode = choose_mode(level, finer, walk.prediction, walk.models.last[c], walk.header.step[c], lambda);
    SplitModels& models = walk.models.splits[c];
    const SplitModels models_before = models;
    double gained = 0;  // squared steps that the rests spare
    FieldCounter coder;
    auto choose = [&](std::size_t p, std::int32_t predicted, std::int64_t step, const SplitContext& context) {
        const double off =
            static_cast<double>(std::int64_t{finer[level.first[p]]} - finer[level.second[p]] - predicted) /
            static_cast<double>(step);
        const double near = std::round(off);
        if (near == 0) return 0;
        auto best = static_cast<std::int32_t>(near);
        if (lambda > 0) {
            const SplitCost cost(models, context);
            const std::int32_t inner = best + (best < 0 ? 1 : -1);
            double least = (off - best) * (off - best) + lambda * cost.of(best);
            for (const std::int32_t candidate : {inner, 0}) {
                const double price = (off - candidate) * (off - candidate) + lambda * cost.of(candidate);
                if (price < least) least = price, best = candidate;
            }
        }
        gained += off * off - (off - best) * (off - best);
        return best;
    };
    code_level(coder, models, level, k, walk.prediction, mode, walk.header.step[c], walk.magnitudes(k, c),
               walk.rests[c], walk.planes[c].magnitude[k], choose);
    if (gained <= lambda * coder.coder.bits()) {
        models = models_before;
        mode.coded = false;
        std::fill(walk.rests[c].begin(), walk.rests[c].end(), 0);
        std::fill(walk.planes[c].magnitude[k].begin(), walk.planes[c].magnitude[k].end(), std::uint8_t{0});
    }
    code_mode(coder, walk.models, c, walk.before != nullptr, mode);  // so that the next level knows
    walk.end_component(k, c, mode);
    return mode;
}

FieldPlan plan_field(FieldWalk& walk, const std::vector<Means>& means, double lambda) {
    const std::size_t components = walk.planes.size();
    const std::size_t levels = walk.hierarchy.levels.size();
    FieldPlan plan{.roots = std::vector<std::int32_t>(components, 0),
                   .modes = std::vector(levels, std::vector<LevelMode>(components)),
                   .rests = std::vector(levels, std::vector<std::vector<std::int32_t>>(components))};
    FieldCounter coder;
    for (std::size_t c = 0; c < components; ++c) {
        if (walk.header.step[c] == 0) continue;
        const std::int64_t from = walk.before ? walk.before->planes[c].mean.back()[0] : 0;
        plan.roots[c] = static_cast<std::int32_t>(
            divide_rounded(means[c].back()[0] - from, root_step(walk.header.step[c], walk.hierarchy.vertex_count)));
        code_root(walk, coder, c, plan.roots[c]);
    }
    for (std::size_t k = levels; k-- > 0;) {
        walk.begin_level(k);
        for (std::size_t c = 0; c < components; ++c)
            if (walk.header.step[c] != 0) plan.modes[k][c] = plan_level(walk, k, c, means[c][k], lambda);
        plan.rests[k] = walk.rests;
        walk.end_level(k);
    }
    return plan;
}

Result<FieldHeader> header_of(std::span<const std::int32_t> values, std::size_t components,
                              const FieldOptions& options) {
    FieldHeader header{.turned = options.turned};
    for (std::size_t c = 0; c < components; ++c) {
        double step = options.step[c];
        if (options.turned && c == 0) step /= options.first_weight;
        if (!(step >= 0 && step <= field_limit && (step == 0 || step * field_one >= 0.5)))
            return fail(ErrorKind::bad_input, "vertex field: a step must be 0 or between 1/256 and 2^20");
        header.step[c] = static_cast<std::uint32_t>(std::lround(step * field_one));
    }
    for (std::size_t i = 0; i < values.size(); ++i)
        if (values[i] < -field_limit || values[i] > field_limit)
            return fail(ErrorKind::bad_input,
                        "vertex field: the value of vertex " + std::to_string(i / components) + " is beyond 2^20");
    return header;
}

}  // namespace

Result<EncodedField> encode_field(const VertexHierarchy& hierarchy, std::span<const std::int32_t> values,
                                  std::size_t components, const FieldOptions& options, const FieldHistory* before) {
    if (components == 0 || components > most_field_components)
        return fail(ErrorKind::bad_input, "vertex field: there must be one to three components");
    if (values.size() != hierarchy.vertex_count * components)
        return fail(ErrorKind::bad_input, "vertex field: there must be a value for each vertex and component");
    if (options.turned && components != 3)
        return fail(ErrorKind::bad_input, "vertex field: only three components can be turned");
    if (!(options.lambda >= 0 && options.lambda <= 1e6))
        return fail(ErrorKind::bad_input, "vertex field: lambda must be between 0 and 10^6");
    auto header = header_of(values, components, options);
    if (!header) return tl::unexpected(header.error());
    if (before && !history_fits(*before, hierarchy, components, options.turned))
        return fail(ErrorKind::bad_input, "vertex field: the frame before is of another mesh or another kind of field");
    header->has_history = before != nullptr;
    ByteWriter writer;
    writer.u8(static_cast<std::uint8_t>((header->turned ? 1 : 0) | (header->has_history ? 2 : 0)));
    for (std::size_t c = 0; c < components; ++c) writer.varint(header->step[c]);
    FieldWalk walk(hierarchy, *header, components, before);
    if (hierarchy.vertex_count > 0) {
        FieldWalk trial(hierarchy, *header, components, before);
        const FieldPlan plan =
            plan_field(trial, means_of(hierarchy, values, components, options.turned), options.lambda);
        FieldWriter coder;
        walk_field(walk, coder, plan);
        writer.bytes(coder.coder.finish());
    }
    EncodedField out;
    out.bytes = writer.take();
    out.values = field_values(walk.planes, hierarchy.vertex_count, header->turned);
    out.history = {.turned = header->turned, .planes = std::move(walk.planes)};
    return out;
}

}  // namespace htvm
