#include "codec/intra/intra_positions.h"

#include <memory>

#include "codec/intra/intra_position_walk.h"
#include "core/bytes.h"

namespace htvm::internal {

Result<std::vector<LatticePoint>> decode_intra_positions(std::span<const std::uint8_t> bytes,
                                                         const Neighbours& neighbours) {
    const std::size_t vertex_count = neighbours.vertex_count();
    std::vector<LatticePoint> points(vertex_count);
    if (vertex_count == 0) return points;
    ByteReader reader(bytes);
    PositionWeights weights{};
    for (auto& set : weights)
        for (auto& weight : set) weight = static_cast<std::int8_t>(reader.u8());
    if (!reader.ok()) return fail(ErrorKind::corrupt_stream, "intra positions: the layer ends before its weights");
    RangeDecoder decoder(bytes.subspan(reader.position()));
    PositionHistory history(vertex_count);
    const auto contexts = std::make_unique<PositionContexts>();
    auto code = [&](ResidualContext& a, ResidualContext& b, ResidualMantissa& mantissa, std::int32_t) {
        return decode_residual(decoder, a, b, mantissa);
    };
    for (std::size_t rank = 0; rank < vertex_count; ++rank) {
        const PositionFeatures features = position_features(points, neighbours, rank, history);
        if (!code_position(points, neighbours, rank, features, weights, history, *contexts, code))
            return fail(ErrorKind::corrupt_stream, "intra positions: a decoded vertex lies off the lattice");
        if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "intra positions: the layer ends too early");
    }
    return points;
}

}  // namespace htvm::internal
