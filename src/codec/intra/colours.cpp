#include "codec/intra/colours.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <memory>

#include "codec/intra/attribute_residual.h"
#include "core/bytes.h"
#include "entropy/cost.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

// Integers throughout; predictions and magnitudes are in sixteenths of a level.

// How the layer predicts; sent in its first four bytes.
struct ColourPredictor {
    std::int8_t red_from_green = 64, blue_from_green = 64, blue_from_red = 0;  // 1/64
    std::uint8_t decoded_weight = 16;                                          // 1/16, 1..16
};

constexpr std::array<std::size_t, 3> colour_order{1, 0, 2};  // green, red, blue: the components as coded

using ColourLevels = std::array<std::int32_t, 3>;  // in coding order, sixteenths of a level

// What is known about each vertex coded so far.
struct ColourHistory {
    explicit ColourHistory(std::size_t vertex_count) : level(vertex_count), miss(vertex_count) {}
    std::vector<std::array<std::int16_t, 3>> level;  // the colour from which others are predicted
    std::vector<std::array<std::int16_t, 3>> miss;   // how far off its own prediction was
};

// The prediction of a vertex, and how much its surroundings vary.
struct ColourSurroundings {
    ColourLevels predicted{}, spread{}, miss{};
};

ColourSurroundings colour_surroundings(std::span<const LatticePoint> positions, const Neighbours& neighbours,
                                       std::size_t rank, const ColourHistory& history) {
    ColourSurroundings out;
    const auto around = neighbours.neighbours_of(rank);
    if (around.empty()) {
        for (std::size_t k = 0; k < 3; ++k)
            out.predicted[k] = rank == 0 ? 16 * 128 : history.level[neighbours.order[rank - 1]][k];
        return out;
    }
    // Weights fall with the squared distance. A squared distance is below 2^53, the sum of the weights below 2^44.
    std::array<std::int64_t, row_limit> weight{};
    std::int64_t sum = 0;
    const LatticePoint here = positions[neighbours.order[rank]];
    for (std::size_t i = 0; i < around.size(); ++i) {
        weight[i] = (std::int64_t{1} << 40) / (squared_distance(positions[around[i]], here) + 1) + 1;
        sum += weight[i];
    }
    std::int32_t left = 1 << 14;  // the normalised weights sum to 2^14
    std::array<std::int32_t, row_limit> share{};
    for (std::size_t i = 1; i < around.size(); ++i) {
        share[i] = static_cast<std::int32_t>((weight[i] << 14) / sum);
        left -= share[i];
    }
    share[0] = left;
    for (std::size_t i = 0; i < around.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            out.predicted[k] += share[i] * history.level[around[i]][k];
            out.miss[k] += share[i] * history.miss[around[i]][k];
        }
    for (std::size_t k = 0; k < 3; ++k) {
        out.predicted[k] = (out.predicted[k] + (1 << 13)) >> 14;
        out.miss[k] >>= 14;
    }
    for (std::size_t i = 0; i < around.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k)
            out.spread[k] += share[i] * std::abs(history.level[around[i]][k] - out.predicted[k]);
    for (auto& spread : out.spread) spread >>= 14;
    return out;
}

// The contexts of the residuals; their classes scale with the step.
class ColourContexts {
public:
    explicit ColourContexts(std::int32_t step) {
        // Classes of a magnitude in quarters of a level at step 1; a coarser step widens them.
        static constexpr Thresholds quarters{2, 4, 6, 12, 20, 32, 52, 80, 160, 320, 800};  // in eighths
        for (std::size_t i = 0; i < quarters.size(); ++i) {
            const std::int32_t sixteenths = 2 * quarters[i];
            fine_[i] = step == 1 ? sixteenths / 4 : sixteenths * step * 3 / 20;
            coarse_[i] = sixteenths * step / 4;
            middle_[i] = sixteenths * step / 3;
        }
    }
    ResidualContext& by_activity(std::size_t component, std::int32_t activity) {
        return activity_[component][class_of(activity, fine_)];
    }
    // before: for the first component the spread; for others, how far off the previous component was.
    ResidualContext& by_components(std::size_t component, std::int32_t before, std::int32_t miss) {
        return components_[component]
                          [class_of(before, component == 0 ? coarse_ : middle_) * classes + class_of(miss, coarse_)];
    }
    ResidualMantissa& mantissa(std::size_t component) { return mantissa_[component]; }

private:
    static constexpr std::size_t classes = 12;
    using Thresholds = std::array<std::int32_t, classes - 1>;
    static std::size_t class_of(std::int32_t value, const Thresholds& thresholds) {
        std::int32_t k = 0;  // counts without an early exit, which is faster than a branch that is hard to predict
        for (const std::int32_t threshold : thresholds) k += value > threshold;
        return static_cast<std::size_t>(k);
    }
    Thresholds fine_{}, middle_{}, coarse_{};
    std::array<std::array<ResidualContext, classes>, 3> activity_;
    std::array<std::array<ResidualContext, classes * classes>, 3> components_;
    std::array<ResidualMantissa, 3> mantissa_;
};

// Codes the vertex at `rank` and sets its colour to the decoded one, in the encoder too, since later vertices are
// predicted from it.
template <class Coder>
void code_colour(Coder& coder, std::span<Colour> colours, std::span<const LatticePoint> positions,
                 const Neighbours& neighbours, std::size_t rank, const ColourPredictor& predictor, std::int32_t step,
                 ColourHistory& history, ColourContexts& contexts) {
    const std::uint32_t vertex = neighbours.order[rank];
    const ColourSurroundings around = colour_surroundings(positions, neighbours, rank, history);
    ColourLevels off{};
    for (std::size_t k = 0; k < 3; ++k) {
        std::int32_t at = around.predicted[k];
        if (k == 1) at += (predictor.red_from_green * off[0] + 32) >> 6;
        if (k == 2) at += (predictor.blue_from_green * off[0] + predictor.blue_from_red * off[1] + 32) >> 6;
        at = std::clamp(at, 0, 16 * 255);
        const std::int32_t nearest = (at + 8) >> 4;
        // Mirrored so that the prediction is always rounded down: one context then learns both sides.
        const std::int32_t side = at < 16 * nearest ? -1 : 1;
        std::uint8_t& level = colours[vertex][colour_order[k]];
        const std::int32_t activity = k == 0 ? (10 * around.miss[0] + 10 * around.spread[0]) / 16
                                             : (11 * around.miss[k] + 4 * around.spread[k]) / 16;
        const std::int32_t before = k == 0 ? around.spread[0] : std::abs(off[k - 1]);
        std::int32_t wanted = 0;
        if constexpr (Coder::writes) wanted = static_cast<std::int32_t>(divide_rounded(side * (level - nearest), step));
        const std::int64_t quantised =
            code_residual(coder, contexts.by_activity(k, activity), contexts.by_components(k, before, around.miss[k]),
                          contexts.mantissa(k), wanted);
        level = static_cast<std::uint8_t>(std::clamp<std::int64_t>(nearest + side * quantised * step, 0, 255));
        off[k] = 16 * level - around.predicted[k];
        history.miss[vertex][k] = static_cast<std::int16_t>(std::abs(16 * level - at));
        history.level[vertex][k] = static_cast<std::int16_t>(at + predictor.decoded_weight * (16 * level - at) / 16);
    }
}

// If the decoded value is noisy, the mean of it and its prediction predicts the next vertices best; measured on
// captures.
std::uint8_t decoded_weight_for(std::int32_t step) {
    if (step == 1) return 16;
    if (step <= 3) return 15;
    return step <= 6 ? 14 : 13;
}

// Enters a colour that both sides know, if it is one.
bool enter_known(std::span<const std::uint8_t> known, std::span<const Colour> colours, std::uint32_t vertex,
                 ColourHistory& history) {
    if (known.empty() || known[vertex] == 0) return false;
    for (std::size_t k = 0; k < 3; ++k)
        history.level[vertex][k] = static_cast<std::int16_t>(16 * colours[vertex][colour_order[k]]);
    return true;
}

// What an encoder is given.
struct ColourSource {
    std::span<const LatticePoint> positions;
    const Neighbours& neighbours;
    std::int32_t step;
    std::span<const std::uint8_t> known;
    const Progress* ordered;
};

// Codes the first `end` vertices of the coding order and sets their colours to the decoded ones.
template <class Writer>
void write_colours(std::vector<Colour>& colours, const ColourSource& source, const ColourPredictor& predictor,
                   std::size_t end, Writer& writer) {
    const auto& neighbours = source.neighbours;
    ColourHistory history(neighbours.vertex_count());
    const auto contexts = std::make_unique<ColourContexts>(source.step);
    WritingCoder<Writer> coder{writer};
    Followed rows(source.ordered);
    for (std::size_t rank = 0; rank < end; ++rank) {
        rows.wait_beyond(rank);
        if (!enter_known(source.known, colours, neighbours.order[rank], history))
            code_colour(coder, std::span(colours), source.positions, neighbours, rank, predictor, source.step, history,
                        *contexts);
    }
}

// Chooses among a few predictors the one that codes the first vertices in the fewest bits.
ColourPredictor choose_predictor(std::span<const Colour> colours, const ColourSource& source) {
    constexpr std::size_t trial_size = 6144;
    constexpr std::array<std::array<std::int8_t, 3>, 3> shares{{{64, 64, 0}, {58, 29, 29}, {52, 32, 18}}};
    ColourPredictor best;
    double fewest_bits = 0;
    for (std::size_t i = 0; i < shares.size(); ++i) {
        const ColourPredictor predictor{shares[i][0], shares[i][1], shares[i][2], decoded_weight_for(source.step)};
        std::vector<Colour> trial(colours.begin(), colours.end());
        CostCounter counter;
        write_colours(trial, source, predictor, std::min(trial_size, trial.size()), counter);
        if (i > 0 && counter.bits() >= fewest_bits) continue;
        best = predictor;
        fewest_bits = counter.bits();
    }
    return best;
}

}  // namespace

EncodedColours encode_intra_colours(std::span<const Colour> colours, std::span<const LatticePoint> positions,
                                    const Neighbours& neighbours, std::int32_t step,
                                    std::span<const std::uint8_t> known, const Progress* ordered) {
    if (colours.empty()) return {};
    const ColourSource source{positions, neighbours, step, known, ordered};
    const ColourPredictor predictor = choose_predictor(colours, source);
    EncodedColours out;
    out.decoded.assign(colours.begin(), colours.end());
    RangeEncoder encoder;
    write_colours(out.decoded, source, predictor, colours.size(), encoder);
    const auto coded = encoder.finish();
    out.bytes.reserve(coded.size() + 4);
    for (const std::int8_t share : {predictor.red_from_green, predictor.blue_from_green, predictor.blue_from_red})
        out.bytes.push_back(static_cast<std::uint8_t>(share));
    out.bytes.push_back(predictor.decoded_weight);
    out.bytes.insert(out.bytes.end(), coded.begin(), coded.end());
    return out;
}

Result<std::vector<Colour>> decode_intra_colours(std::span<const std::uint8_t> bytes,
                                                 std::span<const LatticePoint> positions, const Neighbours& neighbours,
                                                 std::int32_t step, const Known<Colour>& known, const Progress* ordered,
                                                 const Progress* located) {
    const std::size_t vertex_count = neighbours.vertex_count();
    if (step < 1 || step > 255)
        return fail(ErrorKind::corrupt_stream, "intra colours: the colour step is not within 1..255");
    if (positions.size() != vertex_count)
        return fail(ErrorKind::corrupt_stream, "intra colours: the frame does not have one position per vertex");
    std::vector<Colour> colours(vertex_count);
    if (vertex_count == 0) return colours;
    ByteReader reader(bytes);
    ColourPredictor predictor;
    predictor.red_from_green = static_cast<std::int8_t>(reader.u8());
    predictor.blue_from_green = static_cast<std::int8_t>(reader.u8());
    predictor.blue_from_red = static_cast<std::int8_t>(reader.u8());
    predictor.decoded_weight = reader.u8();
    if (!reader.ok() || predictor.decoded_weight < 1 || predictor.decoded_weight > 16)
        return fail(ErrorKind::corrupt_stream, "intra colours: the layer's predictor is missing or impossible");
    RangeDecoder decoder(bytes.subspan(reader.position()));
    ColourHistory history(vertex_count);
    const auto contexts = std::make_unique<ColourContexts>(step);
    ReadingCoder<RangeDecoder> coder{decoder};
    Followed others(ordered, located);
    for (std::size_t rank = 0; rank < vertex_count; ++rank) {
        others.wait_beyond(rank);
        const auto v = neighbours.order[rank];
        if (enter_known(known.is, known.value, v, history)) {
            colours[v] = known.value[v];
            continue;
        }
        code_colour(coder, std::span(colours), positions, neighbours, rank, predictor, step, history, *contexts);
        if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "intra colours: the layer ends too early");
    }
    return colours;
}

}  // namespace htvm::internal
