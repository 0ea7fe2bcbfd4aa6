#include "codec/intra/positions.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <memory>

#include "codec/intra/attribute_residual.h"
#include "core/bytes.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

// Positions and their differences are in sixteenths of a step: means of a few vertices keep their fraction, which tells
// on which side the residual is likely to fall.
using Triple = std::array<std::int64_t, 3>;

// Where the known vertices around a vertex suggest that it is, as offsets from the mean of its neighbours.
struct PositionFeatures {
    Triple mean{};            // of the neighbours; if there are none, the vertex coded before
    Triple across{};          // mean of the parallelograms across an edge, minus `mean`; zero if there are none
    Triple ending{};          // the same for parallelograms where the vertex is an end of the shared edge
    Triple outer{};           // mean of the neighbours' own neighbour means, minus `mean`
    Triple normal{};          // of the known triangles, components below 2^28; zero if there are none
    std::int64_t spread = 0;  // mean distance of the parallelograms from their mean, summed over the components
    std::size_t parallelograms = 0;
    bool has_ending = false;
};

constexpr std::size_t weight_count = 3;                                        // across, ending, outer
using PositionWeights = std::array<std::array<std::int8_t, weight_count>, 2>;  // in 1/64, indexed by has_ending

// What coding a vertex leaves for the next ones; one entry per vertex.
struct PositionHistory {
    explicit PositionHistory(std::size_t vertex_count)
        : ring_mean(vertex_count), along(vertex_count, 0), across(vertex_count, 0) {}
    std::vector<std::array<std::int32_t, 3>> ring_mean;  // mean of the neighbours that were known when it was coded
    std::vector<std::int32_t> along, across;             // its residual along the surface and across it
};

// 65536 / n, rounded. Means are taken of differences from a nearby point, so the rounding has no visible effect.
constexpr std::array<std::int64_t, row_limit + 1> reciprocals = [] {
    std::array<std::int64_t, row_limit + 1> r{};
    for (std::size_t n = 1; n <= row_limit; ++n)
        r[n] = (65536 + static_cast<std::int64_t>(n) / 2) / static_cast<std::int64_t>(n);
    return r;
}();

std::int64_t mean_of(std::int64_t sum, std::size_t count) { return (sum * reciprocals[count]) >> 16; }

Triple triple(LatticePoint p) { return {p.x, p.y, p.z}; }

// The features that come from the parallelograms; differences are taken from `base`.
void add_parallelograms(std::span<const LatticePoint> points, std::span<const Parallelogram> parallelograms,
                        LatticePoint base, const Triple& base_to_mean, PositionFeatures& out) {
    std::array<Triple, row_limit> at{};
    std::array<Triple, 2> sum{};  // ending, across
    std::array<std::size_t, 2> count{};
    Triple total{}, normal{};
    for (std::size_t i = 0; i < parallelograms.size(); ++i) {
        const Parallelogram& p = parallelograms[i];
        const LatticePoint opposite = points[p.opposite];
        const Triple a = triple(points[p.a] - opposite), b = triple(points[p.b] - opposite),
                     o = triple(opposite - base);
        for (std::size_t c = 0; c < 3; ++c) {
            at[i][c] = a[c] + b[c] + o[c];
            sum[p.across][c] += at[i][c];
            total[c] += at[i][c];
            const std::size_t d = (c + 1) % 3, e = (c + 2) % 3;
            normal[c] += b[d] * a[e] - b[e] * a[d];
        }
        ++count[p.across];
    }
    for (std::size_t c = 0; c < 3; ++c) {
        if (count[0] > 0) out.ending[c] = mean_of(16 * sum[0][c], count[0]) - base_to_mean[c];
        if (count[1] > 0) out.across[c] = mean_of(16 * sum[1][c], count[1]) - base_to_mean[c];
        const std::int64_t centre = mean_of(16 * total[c], parallelograms.size());
        for (std::size_t i = 0; i < parallelograms.size(); ++i) out.spread += std::abs(16 * at[i][c] - centre);
    }
    out.spread = mean_of(out.spread, parallelograms.size());
    const auto longest =
        static_cast<std::uint64_t>(std::max({std::abs(normal[0]), std::abs(normal[1]), std::abs(normal[2])}));
    const int excess = std::max(static_cast<int>(std::bit_width(longest)) - 27, 0);
    for (std::size_t c = 0; c < 3; ++c) out.normal[c] = normal[c] >> excess;
    out.parallelograms = parallelograms.size();
    out.has_ending = count[0] > 0;
}

// The features of the vertex at `rank`; also records its ring mean.
PositionFeatures position_features(std::span<const LatticePoint> points, const Neighbours& neighbours, std::size_t rank,
                                   PositionHistory& history) {
    PositionFeatures out;
    const auto around = neighbours.neighbours_of(rank);
    auto& ring_mean = history.ring_mean[neighbours.order[rank]];
    if (around.empty()) {
        const Triple before = rank == 0 ? Triple{} : triple(points[neighbours.order[rank - 1]]);
        for (std::size_t c = 0; c < 3; ++c) {
            out.mean[c] = 16 * before[c];
            ring_mean[c] = static_cast<std::int32_t>(out.mean[c]);
        }
        return out;
    }
    const LatticePoint base = points[around[0]];
    Triple sum{}, outer{};
    for (const std::uint32_t v : around) {
        const Triple offset = triple(points[v] - base);
        for (std::size_t c = 0; c < 3; ++c) {
            sum[c] += offset[c];
            outer[c] += history.ring_mean[v][c] - history.ring_mean[around[0]][c];
        }
    }
    Triple base_to_mean;
    for (std::size_t c = 0; c < 3; ++c) {
        base_to_mean[c] = mean_of(16 * sum[c], around.size());
        out.mean[c] = 16 * triple(base)[c] + base_to_mean[c];
        ring_mean[c] = static_cast<std::int32_t>(out.mean[c]);
        out.outer[c] = history.ring_mean[around[0]][c] + mean_of(outer[c], around.size()) - out.mean[c];
    }
    const auto parallelograms = neighbours.parallelograms_of(rank);
    if (!parallelograms.empty()) add_parallelograms(points, parallelograms, base, base_to_mean, out);
    return out;
}

// The mean plus the weighted offsets, clamped near the lattice so that a corrupt stream cannot cause an overflow.
Triple predict_position(const PositionFeatures& features, const PositionWeights& weights) {
    constexpr std::int64_t reach = 32 * std::int64_t{lattice_limit};  // sixteenths: twice the lattice
    const auto& w = weights[features.has_ending];
    Triple predicted;
    for (std::size_t c = 0; c < 3; ++c) {
        std::int64_t offset = 0;
        if (features.parallelograms > 0)
            offset = (w[0] * features.across[c] + w[1] * features.ending[c] + w[2] * features.outer[c] + 32) >> 6;
        predicted[c] = std::clamp(features.mean[c] + offset, -reach, reach);
    }
    return predicted;
}

// How large the residuals around a vertex were, along and across the surface, from its neighbours.
struct Activity {
    std::int64_t along = 0, across = 0;
};
Activity activity_around(std::span<const std::uint32_t> around, const PositionHistory& history) {
    Activity sum;
    for (const std::uint32_t v : around) {
        sum.along += history.along[v];
        sum.across += history.across[v];
    }
    if (around.empty()) return sum;
    return {mean_of(sum.along, around.size()), mean_of(sum.across, around.size())};
}

// The number of ascending thresholds below the value. Without an early exit, which would be a branch that is hard to
// predict.
template <std::size_t size>
std::size_t class_of(std::int64_t value, const std::array<std::int32_t, size>& thresholds) {
    const auto bounded = static_cast<std::int32_t>(std::min<std::int64_t>(value, 1 << 30));
    std::int32_t k = 0;
    for (const std::int32_t threshold : thresholds) k += bounded > threshold;
    return static_cast<std::size_t>(k);
}

// Contexts by the component's role: roles 0 and 1 run along the surface, role 2 across it.
class PositionContexts {
public:
    ResidualContext& by_activity(std::size_t role, std::int64_t activity) {
        static constexpr std::array<std::int32_t, activities - 1> thresholds{5,   13,  26,  48,   80,  128,
                                                                             208, 320, 640, 1280, 3200};
        return activity_[role][class_of(activity, thresholds)];
    }
    ResidualContext& by_shape(std::size_t role, const PositionFeatures& features, std::int64_t fraction) {
        std::int64_t extent = 0;
        for (std::size_t c = 0; c < 3; ++c)
            extent = std::max({extent, std::abs(features.across[c]), std::abs(features.ending[c])});
        const auto size = static_cast<std::size_t>(std::bit_width(static_cast<std::uint64_t>(extent) >> 4));
        const std::size_t count = std::min(features.parallelograms, counts - 1);
        const auto part = std::min(static_cast<std::size_t>(fraction) / 2, fractions - 1);
        return shape_[role][(count * fractions + part) * extents + std::min(size, extents - 1)];
    }
    ResidualMantissa& mantissa(std::size_t role) { return mantissa_[role]; }

private:
    static constexpr std::size_t activities = 12, counts = 5, fractions = 4, extents = 8;
    std::array<std::array<ResidualContext, activities>, 3> activity_;
    std::array<std::array<ResidualContext, counts * fractions * extents>, 3> shape_;
    std::array<ResidualMantissa, 3> mantissa_;
};

// Sixteenths rounded to whole numbers, halves upwards.
std::int64_t whole(std::int64_t sixteenths) { return (sixteenths + 8) >> 4; }

// Codes the vertex at `rank`, given its features. In the encoder the point is there already and is not changed; the
// decoder sets it to what it reads. False if the point is off the lattice.
//
// The component across the surface is coded last, because it is the smallest once the other two are known: the vertex
// lies close to the plane of its known triangles. "Across" is the axis nearest to their normal, so that the division by
// that component of the normal never magnifies.
template <class Coder>
bool code_position(Coder& coder, std::span<LatticePoint> points, const Neighbours& neighbours, std::size_t rank,
                   const PositionFeatures& features, const PositionWeights& weights, PositionHistory& history,
                   PositionContexts& contexts) {
    const std::uint32_t vertex = neighbours.order[rank];
    const Triple predicted = predict_position(features, weights);
    const Activity around = activity_around(neighbours.neighbours_of(rank), history);
    LatticePoint& point = points[vertex];
    std::array<std::int32_t*, 3> component{&point.x, &point.y, &point.z};
    const Triple& n = features.normal;
    std::size_t steep = std::abs(n[1]) > std::abs(n[0]) ? 1 : 0;
    if (std::abs(n[2]) > std::abs(n[steep])) steep = 2;
    const std::array<std::size_t, 3> axis{(steep + 1) % 3, (steep + 2) % 3, steep};
    Triple off{};  // by role
    for (std::size_t role = 0; role < 3; ++role) {
        std::int64_t at = predicted[axis[role]];
        std::int64_t activity = 3 * around.along + features.spread;
        if (role == 1) activity = 2 * around.along + features.spread / 2 + 2 * std::abs(off[0]);
        if (role == 2) {
            if (n[steep] != 0) at -= (n[axis[0]] * off[0] + n[axis[1]] * off[1]) / n[steep];
            activity = 3 * around.across + (features.spread + std::abs(off[0]) + std::abs(off[1])) / 2;
        }
        const std::int64_t nearest = whole(at), fraction = at - 16 * nearest;
        // Mirrored so that the prediction is always rounded down: one context then learns both sides.
        const std::int64_t side = fraction < 0 ? -1 : 1;
        const std::int64_t wanted = side * (*component[axis[role]] - nearest);
        const std::int64_t value =
            nearest + side * code_residual(coder, contexts.by_activity(role, activity),
                                           contexts.by_shape(role, features, side * fraction), contexts.mantissa(role),
                                           static_cast<std::int32_t>(wanted));
        if (value < -lattice_limit || value > lattice_limit) return false;
        *component[axis[role]] = static_cast<std::int32_t>(value);
        off[role] = 16 * value - (role == 2 ? at : predicted[axis[role]]);
    }
    constexpr std::int64_t remembered = 1 << 20;  // larger values fall in the same context
    history.along[vertex] = static_cast<std::int32_t>(std::min((std::abs(off[0]) + std::abs(off[1])) / 2, remembered));
    history.across[vertex] = static_cast<std::int32_t>(std::min(std::abs(off[2]), remembered));
    return true;
}

bool is_known(std::span<const std::uint8_t> known, std::uint32_t vertex) {
    return !known.empty() && known[vertex] != 0;
}

// The encoder's choice of weights. It may use doubles, because the weights are sent.
using Matrix = std::array<std::array<double, weight_count + 1>, weight_count>;  // normal equations, the right-hand side
                                                                                // in the last column

// Solves the normal equations by elimination; a direction that the data do not determine gets the weight 0.
std::array<double, weight_count> solve(Matrix m) {
    std::array<double, weight_count> scale{};
    for (std::size_t i = 0; i < weight_count; ++i) scale[i] = m[i][i];
    std::array<bool, weight_count> open{};
    for (std::size_t i = 0; i < weight_count; ++i) {
        open[i] = !(m[i][i] > 1e-9 * (scale[i] + 1));
        if (open[i]) continue;
        for (std::size_t row = 0; row < weight_count; ++row) {
            if (row == i) continue;
            const double factor = m[row][i] / m[i][i];
            for (std::size_t column = 0; column <= weight_count; ++column) m[row][column] -= factor * m[i][column];
        }
    }
    std::array<double, weight_count> weights{};
    for (std::size_t i = 0; i < weight_count; ++i) weights[i] = open[i] ? 0.0 : m[i][weight_count] / m[i][i];
    return weights;
}

// Least squares over the frame. Each vertex is weighted by the inverse square of the size of its surroundings and of
// the error that the usual weights leave, so that neither large triangles nor outliers dominate. The result is drawn
// towards the usual weights, those of most captures, which decide if there are few vertices.
PositionWeights fit_weights(std::span<const LatticePoint> q, const Neighbours& neighbours,
                            std::span<const std::uint8_t> known, const Progress* ordered) {
    constexpr std::array<std::array<double, weight_count>, 2> usual{{{0.5, 0.0, -0.4}, {0.46, 0.21, -0.2}}};
    std::array<Matrix, 2> equations{};
    PositionHistory history(q.size());
    Followed rows(ordered);
    for (std::size_t rank = 0; rank < q.size(); ++rank) {
        rows.wait_beyond(rank);
        const PositionFeatures f = position_features(q, neighbours, rank, history);
        if (f.parallelograms == 0 || is_known(known, neighbours.order[rank])) continue;
        const LatticePoint p = q[neighbours.order[rank]];
        const std::array<double, 3> actual{16.0 * p.x, 16.0 * p.y, 16.0 * p.z};
        std::array<std::array<double, weight_count>, 3> feature{};
        double extent = 256;
        for (std::size_t c = 0; c < 3; ++c) {
            feature[c] = {static_cast<double>(f.across[c]), static_cast<double>(f.ending[c]),
                          static_cast<double>(f.outer[c])};
            extent += 0.25 * (feature[c][0] * feature[c][0] + feature[c][1] * feature[c][1]);
        }
        for (std::size_t c = 0; c < 3; ++c) {
            double left = actual[c] - static_cast<double>(f.mean[c]);
            for (std::size_t i = 0; i < weight_count; ++i) left -= usual[f.has_ending][i] * feature[c][i];
            extent += left * left;
        }
        Matrix& m = equations[f.has_ending];
        for (std::size_t c = 0; c < 3; ++c)
            for (std::size_t i = 0; i < weight_count; ++i) {
                const double scaled = feature[c][i] / extent;
                for (std::size_t j = 0; j < weight_count; ++j) m[i][j] += scaled * feature[c][j];
                m[i][weight_count] += scaled * (actual[c] - static_cast<double>(f.mean[c]));
            }
    }
    PositionWeights weights{};
    for (std::size_t set = 0; set < 2; ++set) {
        for (std::size_t i = 0; i < weight_count; ++i) {
            constexpr double pull = 4;
            equations[set][i][i] += pull;
            equations[set][i][weight_count] += pull * usual[set][i];
        }
        const auto fitted = solve(equations[set]);
        for (std::size_t i = 0; i < weight_count; ++i)
            weights[set][i] = static_cast<std::int8_t>(std::lround(std::clamp(fitted[i] * 64, -127.0, 127.0)));
    }
    return weights;
}

}  // namespace

std::vector<std::uint8_t> encode_intra_positions(std::span<const LatticePoint> q, const Neighbours& neighbours,
                                                 std::span<const std::uint8_t> known, const Progress* ordered) {
    if (q.empty()) return {};
    const PositionWeights weights = fit_weights(q, neighbours, known, ordered);
    ByteWriter writer;
    for (const auto& set : weights)
        for (const std::int8_t weight : set) writer.u8(static_cast<std::uint8_t>(weight));
    RangeEncoder encoder;
    PositionHistory history(q.size());
    const auto contexts = std::make_unique<PositionContexts>();
    WritingCoder<RangeEncoder> coder{encoder};
    std::vector<LatticePoint> points(q.begin(), q.end());
    for (std::size_t rank = 0; rank < q.size(); ++rank) {
        const PositionFeatures features = position_features(points, neighbours, rank, history);
        if (is_known(known, neighbours.order[rank])) continue;
        code_position(coder, std::span(points), neighbours, rank, features, weights, history, *contexts);
    }
    writer.bytes(encoder.finish());
    return writer.take();
}

Result<std::vector<LatticePoint>> decode_intra_positions(std::span<const std::uint8_t> bytes,
                                                         const Neighbours& neighbours,
                                                         const Known<LatticePoint>& known) {
    std::vector<LatticePoint> points(neighbours.vertex_count());
    if (auto ok = decode_intra_positions(bytes, neighbours, known, points, nullptr, nullptr); !ok)
        return tl::unexpected(ok.error());
    return points;
}

Result<void> decode_intra_positions(std::span<const std::uint8_t> bytes, const Neighbours& neighbours,
                                    const Known<LatticePoint>& known, std::span<LatticePoint> points,
                                    const Progress* ordered, Progress* progress) {
    const std::size_t vertex_count = neighbours.vertex_count();
    if (vertex_count == 0) return {};
    ByteReader reader(bytes);
    PositionWeights weights{};
    for (auto& set : weights)
        for (auto& weight : set) weight = static_cast<std::int8_t>(reader.u8());
    if (!reader.ok()) return fail(ErrorKind::corrupt_stream, "intra positions: the layer ends before its weights");
    RangeDecoder decoder(bytes.subspan(reader.position()));
    PositionHistory history(vertex_count);
    const auto contexts = std::make_unique<PositionContexts>();
    ReadingCoder<RangeDecoder> coder{decoder};
    Followed rows(ordered);
    for (std::size_t rank = 0; rank < vertex_count; ++rank) {
        rows.wait_beyond(rank);
        if (progress && rank % Progress::told_every == 0) progress->reach(rank);
        const PositionFeatures features = position_features(points, neighbours, rank, history);
        if (const auto v = neighbours.order[rank]; is_known(known.is, v)) {
            points[v] = known.value[v];
            continue;
        }
        if (!code_position(coder, points, neighbours, rank, features, weights, history, *contexts))
            return fail(ErrorKind::corrupt_stream, "intra positions: a decoded vertex lies off the lattice");
        if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "intra positions: the layer ends too early");
    }
    return {};
}

}  // namespace htvm::internal
