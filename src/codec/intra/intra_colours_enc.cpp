#include <memory>

#include "codec/intra/intra_colour_walk.h"
#include "codec/intra/intra_colours.h"
#include "entropy/cost.h"
#include "entropy/range_encoder.h"

namespace htvm::internal {

namespace {

// The mean of a colour's decoded value and its prediction serves the next predictions best where the decoded value is
// noisy: measured on captures.
std::uint8_t decoded_weight_for(std::int32_t step) {
    if (step == 1) return 16;
    if (step <= 3) return 15;
    return step <= 6 ? 14 : 13;
}

// Codes the first `end` vertices of the coding order and sets their colours to the decoded ones.
template <class Writer>
void write_colours(std::vector<Colour>& colours, std::span<const LatticePoint> positions, const Neighbours& neighbours,
                   std::int32_t step, const ColourPredictor& predictor, std::size_t end, Writer& writer) {
    ColourHistory history(neighbours.vertex_count());
    const auto contexts = std::make_unique<ColourContexts>(step);
    auto code = [&](ResidualContext& a, ResidualContext& b, ResidualMantissa& mantissa, std::int32_t offset) {
        const auto quantised = static_cast<std::int32_t>(divide_rounded(offset, step));
        encode_residual(writer, a, b, mantissa, quantised);
        return quantised;
    };
    for (std::size_t rank = 0; rank < end; ++rank)
        code_colour(colours, positions, neighbours, rank, predictor, step, history, *contexts, code);
}

// Of a few predictors, the one that codes the first vertices in the fewest bits.
ColourPredictor choose_predictor(std::span<const Colour> colours, std::span<const LatticePoint> positions,
                                 const Neighbours& neighbours, std::int32_t step) {
    constexpr std::size_t trial_size = 6144;
    constexpr std::array<std::array<std::int8_t, 3>, 3> shares{{{64, 64, 0}, {58, 29, 29}, {52, 32, 18}}};
    ColourPredictor best;
    double fewest_bits = 0;
    for (std::size_t i = 0; i < shares.size(); ++i) {
        const ColourPredictor predictor{shares[i][0], shares[i][1], shares[i][2], decoded_weight_for(step)};
        std::vector<Colour> trial(colours.begin(), colours.end());
        CostCounter counter;
        write_colours(trial, positions, neighbours, step, predictor, std::min(trial_size, trial.size()), counter);
        if (i > 0 && counter.bits() >= fewest_bits) continue;
        best = predictor;
        fewest_bits = counter.bits();
    }
    return best;
}

}  // namespace

EncodedColours encode_intra_colours(std::span<const Colour> colours, std::span<const LatticePoint> positions,
                                    const Neighbours& neighbours, std::int32_t step) {
    if (colours.empty()) return {};
    const ColourPredictor predictor = choose_predictor(colours, positions, neighbours, step);
    EncodedColours out;
    out.decoded.assign(colours.begin(), colours.end());
    RangeEncoder encoder;
    write_colours(out.decoded, positions, neighbours, step, predictor, colours.size(), encoder);
    const auto coded = encoder.finish();
    out.bytes.reserve(coded.size() + 4);
    for (const std::int8_t share : {predictor.red_from_green, predictor.blue_from_green, predictor.blue_from_red})
        out.bytes.push_back(static_cast<std::uint8_t>(share));
    out.bytes.push_back(predictor.decoded_weight);
    out.bytes.insert(out.bytes.end(), coded.begin(), coded.end());
    return out;
}

}  // namespace htvm::internal
