#include "codec/intra/intra_colours.h"

#include <memory>

#include "codec/intra/intra_colour_walk.h"
#include "core/bytes.h"

namespace htvm::internal {

Result<std::vector<Colour>> decode_intra_colours(std::span<const std::uint8_t> bytes,
                                                 std::span<const LatticePoint> positions, const Neighbours& neighbours,
                                                 std::int32_t step) {
    const std::size_t vertex_count = neighbours.vertex_count();
    if (step < 1 || step > 255)
        return fail(ErrorKind::corrupt_stream, "intra colours: the colour step is not within 1..255");
    if (positions.size() != vertex_count)
        return fail(ErrorKind::corrupt_stream, "intra colours: the frame has not one position a vertex");
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
    auto code = [&](ResidualContext& a, ResidualContext& b, ResidualMantissa& mantissa, std::int32_t) {
        return decode_residual(decoder, a, b, mantissa);
    };
    for (std::size_t rank = 0; rank < vertex_count; ++rank) {
        code_colour(colours, positions, neighbours, rank, predictor, step, history, *contexts, code);
        if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "intra colours: the layer ends too early");
    }
    return colours;
}

}  // namespace htvm::internal
