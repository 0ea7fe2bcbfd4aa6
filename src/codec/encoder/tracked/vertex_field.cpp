#include <atomic>
#include <cmath>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <string>

#include "codec/tracked/vertex_field_walk.h"
#include "core/parallel.h"
#include "entropy/cost.h"

namespace htvm::internal {

namespace {

// The bits of a decision predicted from several contexts, for either answer. Near certainty they are fewer than it is
// coded with, by which streams were decided from the first.
template <std::size_t N>
std::array<double, 2> mixed_cost(const Mixer<N>& mixer, const std::array<BinaryModel*, N>& models) {
    const auto odds = mixed_log_odds(mixer, models);
    const BinaryModel model{static_cast<std::uint16_t>(probability_of_log_odds(odds)), 0};
    return {decision_cost(model, false), decision_cost(model, true)};
}

// The bits of small quantised differences in one context.
class SplitCost {
public:
    SplitCost(SplitModels& models, const SplitContext& context, const SignContext& sign)
        : models_(models),
          context_(context),
          nonzero_(mixed_cost(models.nonzero_mixer[context.level], split_detail::nonzero(models, context))),
          negative_(mixed_cost(models.sign_mixer, split_detail::negative(models, sign))) {}
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

// What is coded of one component.
struct ComponentPlan {
    DecisionLog root;
    std::vector<LevelMode> modes;    // by level
    std::vector<DecisionLog> rests;  // likewise
};

using Means = std::vector<std::vector<std::int32_t>>;  // as FieldPlane::mean, of the field to be coded

// Which nodes have a vertex below whose value counts. [0]: the vertices, [1 + k]: level k; none: all do.
using Counting = std::vector<std::vector<std::uint8_t>>;

Counting counting_of(const VertexHierarchy& hierarchy, std::span<const std::uint8_t> counts) {
    Counting out;
    if (counts.empty()) return out;
    out.emplace_back(counts.begin(), counts.end());
    for (const auto& level : hierarchy.levels) {
        const auto& below = out.back();
        std::vector<std::uint8_t> here(level.size());
        for (std::size_t p = 0; p < here.size(); ++p)
            here[p] = below[level.first[p]] != 0 || (level.second[p] != no_node && below[level.second[p]] != 0);
        out.push_back(std::move(here));
    }
    return out;
}

// The means of all nodes from those of the vertices, which are in place. What does not count takes the mean of what it
// is joined to.
void fill_means(const VertexHierarchy& hierarchy, const Counting& counting, Means& means) {
    means.resize(hierarchy.levels.size() + 1);
    for (std::size_t k = 0; k < hierarchy.levels.size(); ++k) {
        const HierarchyLevel& level = hierarchy.levels[k];
        means[k + 1].resize(level.size());
        for (std::size_t p = 0; p < level.size(); ++p) {
            if (!counting.empty() && level.second[p] != no_node) {
                const bool first = counting[k][level.first[p]] != 0, second = counting[k][level.second[p]] != 0;
                if (first && !second) means[k][level.second[p]] = means[k][level.first[p]];
                if (!first && second) means[k][level.first[p]] = means[k][level.second[p]];
            }
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

// The means of component c.
Means means_of(const VertexHierarchy& hierarchy, const Counting& counting, std::span<const std::int32_t> values,
               std::size_t components, std::size_t c, bool turned) {
    Means means(1);
    auto& of_vertices = means[0];
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
        const double scaled = along * field_one;  // to the nearest, halves away from zero
        of_vertices[v] = static_cast<std::int32_t>(scaled + (scaled < 0 ? -0.5 : 0.5));
    }
    fill_means(hierarchy, counting, means);
    return means;
}

// The weights of slopes and of the frame before that leave the least squared error, and bits for saying so. counting:
// of the level's nodes, or none.
LevelMode choose_mode(const HierarchyLevel& level, std::span<const std::int32_t> finer,
                      std::span<const std::uint8_t> counting, const LevelPrediction& prediction, const LevelMode& above,
                      std::uint32_t step, double lambda) {
    const bool history = !prediction.before.empty();
    // Products of: difference, its prediction by slopes, difference before, its prediction before.
    std::array<std::array<double, 4>, 4> product{};
    for (std::size_t p = 0; p < level.size(); ++p) {
        if (level.second[p] == no_node || (!counting.empty() && counting[p] == 0)) continue;
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

// Quantises one level of one component, weighing squared error against bits as the models stand. The mode must have
// been chosen. False where nothing is worth its bits.
bool quantise_level(FieldWalk& walk, std::size_t k, std::size_t c, std::span<const std::int32_t> finer,
                    std::span<const std::uint8_t> counting, const LevelMode& mode, double lambda, DecisionLog& log) {
    const HierarchyLevel& level = walk.hierarchy.levels[k];
    ComponentWalk& component = walk.components[c];
    const SplitModels models_before = component.models;
    double gained = 0;  // squared steps that the rests spare
    auto choose = [&](std::size_t p, std::int32_t predicted, std::int64_t step, const SplitContext& context,
                      const auto& sign) {
        const std::int64_t difference = std::int64_t{finer[level.first[p]]} - finer[level.second[p]] - predicted;
        if (2 * std::abs(difference) < step || (!counting.empty() && counting[p] == 0)) return 0;
        const double off = static_cast<double>(difference) / static_cast<double>(step);
        auto best = static_cast<std::int32_t>(std::round(off));
        if (lambda > 0) {
            const SplitCost cost(component.models, context, sign());
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
    code_level(log, walk, k, c, mode, choose);
    if (gained > lambda * log.bits()) return true;
    component.models = models_before;
    std::fill(component.rests[k].begin(), component.rests[k].end(), 0);
    std::fill(component.plane.magnitude[k].begin(), component.plane.magnitude[k].end(), std::uint8_t{0});
    log.clear();
    return false;
}

// How far the planning of a component is, for the one that looks at its rests. Not by std::atomic::wait(): that of
// libstdc++ 12 misses who comes just then where there are no futexes, as on Windows, and waits for ever.
class Progress {
public:
    static constexpr std::size_t everything = std::numeric_limits<std::size_t>::max();
    void reach(std::size_t levels) {
        {
            const std::lock_guard lock(mutex_);
            levels_.store(levels, std::memory_order_release);
        }
        reached_.notify_all();
    }
    void await(std::size_t levels) const {
        const auto is_there = [&] { return levels_.load(std::memory_order_acquire) >= levels; };
        if (is_there()) return;
        std::unique_lock lock(mutex_);
        reached_.wait(lock, is_there);
    }

private:
    std::atomic<std::size_t> levels_{0};
    mutable std::mutex mutex_;
    mutable std::condition_variable reached_;
};

// Lets those who wait go on, however a component's planning ends.
struct ProgressEnd {
    Progress& progress;
    ~ProgressEnd() { progress.reach(Progress::everything); }
};

// Plans component c; where its rests are needed before those of a level can be chosen, waits for `awaited`.
ComponentPlan plan_component(FieldWalk& walk, std::size_t c, const Means& means, const Counting& counting,
                             double lambda, Progress& progress, const Progress* awaited) {
    const ProgressEnd end{progress};
    ComponentWalk& component = walk.components[c];
    const std::size_t levels = walk.hierarchy.levels.size();
    ComponentPlan plan{.root = {}, .modes = std::vector<LevelMode>(levels), .rests = std::vector<DecisionLog>(levels)};
    if (component.step == 0) return plan;
    const std::int64_t from = component.before ? component.before->mean.back()[0] : 0;
    const std::int64_t unit = root_step(component.step, walk.hierarchy.vertex_count);
    code_root(plan.root, component, walk.hierarchy.vertex_count,
              static_cast<std::int32_t>(divide_rounded(means.back()[0] - from, unit)));
    for (std::size_t k = levels; k-- > 0;) {
        walk.begin_level(k, c);
        const auto counts = counting.empty() ? std::span<const std::uint8_t>() : std::span(counting[k + 1]);
        LevelMode mode = choose_mode(walk.hierarchy.levels[k], means[k], counts, component.prediction, component.last,
                                     component.step, lambda);
        if (awaited) awaited->await(levels - k);
        mode.coded = quantise_level(walk, k, c, means[k], counts, mode, lambda, plan.rests[k]);
        component.last = plan.modes[k] = mode;
        walk.end_level(k, c, mode);
        progress.reach(levels - k);
    }
    return plan;
}

// Plans all components, the first two beside the third, which comes behind `beside`.
std::vector<ComponentPlan> plan_field(FieldWalk& walk, std::span<const std::int32_t> values,
                                      const FieldOptions& options, Threads threads,
                                      const std::function<void()>& beside) {
    const std::size_t components = walk.components.size();
    std::vector<ComponentPlan> plans(components);
    std::array<Progress, most_field_components> progress;
    const auto counting = counting_of(walk.hierarchy, options.counts);
    auto plan = [&](std::size_t c) {
        plans[c] = plan_component(walk, c, means_of(walk.hierarchy, counting, values, components, c, options.turned),
                                  counting, options.lambda, progress[c], c > 0 ? &progress[c - 1] : nullptr);
    };
    // The third waits for what the first two do, which begins before it on any number of threads.
    parallel_invoke(
        threads,
        [&] {
            const ProgressEnd end{progress[1]};
            for (std::size_t c = 0; c < std::min<std::size_t>(components, 2); ++c) plan(c);
        },
        [&] {
            if (beside) beside();
            if (components > 2) plan(2);
        });
    return plans;
}

// What was planned in the order of the stream: level by level, component by component.
DecisionLog in_order(FieldWalk& walk, const std::vector<ComponentPlan>& plans) {
    DecisionLog out;
    for (const auto& plan : plans) out.append(plan.root);
    std::vector<LevelMode> last;
    for (const auto& component : walk.components) last.push_back(first_mode(component.before != nullptr));
    for (std::size_t k = walk.hierarchy.levels.size(); k-- > 0;)
        for (std::size_t c = 0; c < plans.size(); ++c) {
            if (walk.components[c].step == 0) continue;
            code_mode(out, walk, last[c], plans[c].modes[k]);
            out.append(plans[c].rests[k]);
        }
    return out;
}

Result<FieldSteps> steps_of(std::span<const std::int32_t> values, std::size_t components, const FieldOptions& options) {
    FieldSteps out{.turned = options.turned};
    for (std::size_t c = 0; c < components; ++c) {
        double step = options.step[c];
        if (options.turned && c == 0) step /= options.first_weight;
        if (!(step >= 0 && step <= field_limit && (step == 0 || step * field_one >= 0.5)))
            return fail(ErrorKind::bad_input, "vertex field: a step must be 0 or between 1/256 and 2^20");
        out.step[c] = static_cast<std::uint32_t>(std::lround(step * field_one));
    }
    for (std::size_t i = 0; i < values.size(); ++i)
        if (values[i] < -field_limit || values[i] > field_limit)
            return fail(ErrorKind::bad_input,
                        "vertex field: the value of vertex " + std::to_string(i / components) + " is beyond 2^20");
    return out;
}

}  // namespace

Result<EncodedField> encode_field(const VertexHierarchy& hierarchy, std::span<const std::int32_t> values,
                                  std::size_t components, const FieldOptions& options, const FieldHistory* before,
                                  Threads threads, const std::function<void()>& beside) {
    if (components == 0 || components > most_field_components)
        return fail(ErrorKind::bad_input, "vertex field: there must be one to three components");
    if (values.size() != hierarchy.vertex_count * components)
        return fail(ErrorKind::bad_input, "vertex field: there must be a value for each vertex and component");
    if (options.turned && components != 3)
        return fail(ErrorKind::bad_input, "vertex field: only three components can be turned");
    if (!(options.lambda >= 0 && options.lambda <= 1e6))
        return fail(ErrorKind::bad_input, "vertex field: lambda must be between 0 and 10^6");
    if (!options.counts.empty() && options.counts.size() != hierarchy.vertex_count)
        return fail(ErrorKind::bad_input, "vertex field: it must be told of each vertex whether its value counts");
    const auto steps = steps_of(values, components, options);
    if (!steps) return tl::unexpected(steps.error());
    if (before && !history_fits(*before, hierarchy, components, options.turned))
        return fail(ErrorKind::bad_input, "vertex field: the frame before is of another mesh or another kind of field");
    EncodedField out;
    out.steps = *steps;
    FieldWalk walk(hierarchy, *steps, components, before);
    if (hierarchy.vertex_count > 0)
        out.decisions = in_order(walk, plan_field(walk, values, options, threads, beside));
    else if (beside)
        beside();
    out.history = history_of(walk, steps->turned);
    out.values = field_values(out.history.planes, hierarchy.vertex_count, steps->turned);
    return out;
}

}  // namespace htvm::internal
