#include "codec/intra/attribute_values.h"
#include "codec/intra/attribute_values_walk.h"
#include "entropy/cost.h"
#include "entropy/range_encoder.h"

namespace htvm::internal {

namespace {

using Values2 = std::array<std::int32_t, 2>;
using Values3 = std::array<std::int32_t, 3>;

// The values are not changed by walking over them: what is coded is what they are.
template <class Value, class Writer>
void write_values(std::vector<Value>& values, const AttributeSource<Value>& source, AttributePredictor predictor,
                  std::size_t end, Writer& writer) {
    std::vector<AttributeContexts> contexts(std::tuple_size_v<Value>);
    auto code = [&](ResidualContext& a, ResidualContext& b, ResidualMantissa& mantissa, std::int32_t residual) {
        encode_residual(writer, a, b, mantissa, residual);
        return residual;
    };
    walk_attribute_values(values, source, predictor, end, contexts, code);
}

template <class Value>
std::vector<std::uint8_t> encode_from(std::vector<Value> values, const AttributeSource<Value>& source) {
    if (values.empty()) return {};
    constexpr std::size_t trial_size = 8192;  // enough vertices to tell the predictors apart
    AttributePredictor best = AttributePredictor::previous;
    double fewest_bits = 0;
    for (std::uint8_t number = 0; number <= static_cast<std::uint8_t>(AttributePredictor::between); ++number) {
        const auto predictor = static_cast<AttributePredictor>(number);
        if (!source.offers(predictor)) continue;
        CostCounter counter;
        write_values(values, source, predictor, std::min(values.size(), trial_size), counter);
        if (number > 0 && counter.bits() >= fewest_bits) continue;
        best = predictor;
        fewest_bits = counter.bits();
    }
    RangeEncoder encoder;
    write_values(values, source, best, values.size(), encoder);
    std::vector<std::uint8_t> bytes{static_cast<std::uint8_t>(best)};
    const auto coded = encoder.finish();
    bytes.insert(bytes.end(), coded.begin(), coded.end());
    return bytes;
}

}  // namespace

template <class Value>
std::vector<std::uint8_t> encode_attribute_values(const std::vector<Value>& values, const Neighbours& neighbours) {
    return encode_from<Value>(values, {.neighbours = &neighbours});
}

template <class Value>
std::vector<std::uint8_t> encode_attribute_values(const std::vector<Value>& values,
                                                  const std::vector<Value>& predictions) {
    return encode_from<Value>(values, {.given = &predictions});
}

template std::vector<std::uint8_t> encode_attribute_values<Values2>(const std::vector<Values2>&, const Neighbours&);
template std::vector<std::uint8_t> encode_attribute_values<Values3>(const std::vector<Values3>&, const Neighbours&);
template std::vector<std::uint8_t> encode_attribute_values<Values2>(const std::vector<Values2>&,
                                                                    const std::vector<Values2>&);
template std::vector<std::uint8_t> encode_attribute_values<Values3>(const std::vector<Values3>&,
                                                                    const std::vector<Values3>&);

}  // namespace htvm::internal
