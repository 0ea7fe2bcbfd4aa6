#include "codec/intra/attribute_values.h"

#include "codec/intra/attribute_values_walk.h"

namespace htvm::internal {

namespace {

using Values2 = std::array<std::int32_t, 2>;
using Values3 = std::array<std::int32_t, 3>;

template <class Value>
Result<std::vector<Value>> decode_from(std::span<const std::uint8_t> bytes, const AttributeSource<Value>& source) {
    std::vector<Value> values(source.vertex_count());
    if (values.empty()) return values;
    if (bytes.empty()) return fail(ErrorKind::corrupt_stream, "attribute values: the layer is empty");
    const auto predictor = static_cast<AttributePredictor>(bytes[0]);
    if (!source.offers(predictor))
        return fail(ErrorKind::corrupt_stream, "attribute values: the layer names a predictor that this frame has not");
    RangeDecoder decoder(bytes.subspan(1));
    std::vector<AttributeContexts> contexts(std::tuple_size_v<Value>);
    auto code = [&](ResidualContext& a, ResidualContext& b, ResidualMantissa& mantissa, std::int32_t) {
        return decode_residual(decoder, a, b, mantissa);
    };
    const bool complete = walk_attribute_values(values, source, predictor, values.size(), contexts, code);
    if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "attribute values: the layer ends too early");
    if (!complete) return fail(ErrorKind::corrupt_stream, "attribute values: a decoded value is out of range");
    return values;
}

}  // namespace

template <class Value>
Result<std::vector<Value>> decode_attribute_values(std::span<const std::uint8_t> bytes, const Neighbours& neighbours) {
    return decode_from<Value>(bytes, {.neighbours = &neighbours});
}

template <class Value>
Result<std::vector<Value>> decode_attribute_values(std::span<const std::uint8_t> bytes,
                                                   const std::vector<Value>& predictions) {
    return decode_from<Value>(bytes, {.given = &predictions});
}

template Result<std::vector<Values2>> decode_attribute_values<Values2>(std::span<const std::uint8_t>,
                                                                       const Neighbours&);
template Result<std::vector<Values3>> decode_attribute_values<Values3>(std::span<const std::uint8_t>,
                                                                       const Neighbours&);
template Result<std::vector<Values2>> decode_attribute_values<Values2>(std::span<const std::uint8_t>,
                                                                       const std::vector<Values2>&);
template Result<std::vector<Values3>> decode_attribute_values<Values3>(std::span<const std::uint8_t>,
                                                                       const std::vector<Values3>&);

}  // namespace htvm::internal
