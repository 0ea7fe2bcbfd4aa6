#include "codec/attribute_values.h"

#include "codec/attribute_values_walk.h"

namespace htvm {

namespace {

template <std::size_t components>
Result<AttributeValues<components>> decode_from(std::span<const std::uint8_t> bytes,
                                                const AttributeSource<components>& source) {
    AttributeValues<components> values(source.vertex_count());
    if (values.empty()) return values;
    if (bytes.empty()) return fail(ErrorKind::corrupt_stream, "attribute values: the layer is empty");
    const auto predictor = static_cast<AttributePredictor>(bytes[0]);
    if (!source.offers(predictor))
        return fail(ErrorKind::corrupt_stream, "attribute values: the layer names a predictor that this frame has not");
    RangeDecoder decoder(bytes.subspan(1));
    std::vector<AttributeContexts> contexts(components);
    auto code = [&](ResidualContext& a, ResidualContext& b, ResidualMantissa& mantissa, std::int32_t) {
        return decode_residual(decoder, a, b, mantissa);
    };
    const bool complete = walk_attribute_values(values, source, predictor, values.size(), contexts, code);
    if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "attribute values: the layer ends too early");
    if (!complete) return fail(ErrorKind::corrupt_stream, "attribute values: a decoded value is out of range");
    return values;
}

}  // namespace

template <std::size_t components>
Result<AttributeValues<components>> decode_attribute_values(std::span<const std::uint8_t> bytes,
                                                            const Neighbours& neighbours) {
    return decode_from<components>(bytes, {.neighbours = &neighbours});
}

template <std::size_t components>
Result<AttributeValues<components>> decode_attribute_values(std::span<const std::uint8_t> bytes,
                                                            const AttributeValues<components>& predictions) {
    return decode_from<components>(bytes, {.given = &predictions});
}

template Result<AttributeValues<2>> decode_attribute_values<2>(std::span<const std::uint8_t>, const Neighbours&);
template Result<AttributeValues<3>> decode_attribute_values<3>(std::span<const std::uint8_t>, const Neighbours&);
template Result<AttributeValues<2>> decode_attribute_values<2>(std::span<const std::uint8_t>,
                                                               const AttributeValues<2>&);
template Result<AttributeValues<3>> decode_attribute_values<3>(std::span<const std::uint8_t>,
                                                               const AttributeValues<3>&);

}  // namespace htvm
