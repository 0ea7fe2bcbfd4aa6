#include <memory>

#include "codec/intra/triangle_fans.h"
#include "codec/paper/mtfan.h"
#include "codec/paper/mtfan_distance_order.h"

namespace htvm::internal {
namespace {

struct DistanceOrders {
    static constexpr bool visits_isolated = true;
    std::span<const LatticePoint> positions;
    UnvisitedNear unvisited;
    RangeDecoder decoder;
    VisitedPositions known;
    std::vector<std::uint32_t> order;  // input index by visiting number
    std::size_t next_seed = 0;
    DistanceOrderModels models;

    void visit(std::uint32_t vertex) {
        unvisited.visit(vertex);
        known.push_back(positions[vertex]);
        order.push_back(vertex);
    }
    bool seed() {
        while (next_seed < positions.size() && unvisited.visited(static_cast<std::uint32_t>(next_seed))) ++next_seed;
        if (next_seed == positions.size()) return false;
        visit(static_cast<std::uint32_t>(next_seed));
        return true;
    }
    FanHints hints(const FanState& fan) const { return known.hints(fan); }
    bool discover(const FanState& fan) {
        ReadingCoder<RangeDecoder> coder{decoder};
        const std::size_t place =
            code_distance_order(coder, models, unvisited, known, fan, order[fan.focus], OpenEdges::none);
        const auto candidates = unvisited.candidates();
        const std::uint32_t vertex =
            place < candidates.size()
                ? candidates[place].vertex
                : code_index_directly(coder, models, order[fan.current == OpenEdges::none ? fan.focus : fan.current],
                                      OpenEdges::none);
        if (vertex >= positions.size() || unvisited.visited(vertex) || decoder.exhausted()) return false;
        visit(vertex);
        return true;
    }
};

}  // namespace

Result<std::vector<Triangle>> decode_mtfan(std::span<const std::uint8_t> fans,
                                           std::span<const std::uint8_t> distance_orders,
                                           std::span<const LatticePoint> positions, std::uint32_t triangle_count, int m,
                                           Threads threads) {
    if (m < 1 || m > mtfan_max_nearest)
        return fail(ErrorKind::corrupt_stream,
                    "M-TFAN's number of nearest vertices must be 1 to 64, but the stream "
                    "has " +
                        std::to_string(m) + ": it is damaged.");
    std::vector<Triangle> triangles;
    if (triangle_count == 0) return triangles;
    RangeDecoder decoder(fans);
    const auto discovery = std::unique_ptr<DistanceOrders>(new DistanceOrders{
        positions, UnvisitedNear(positions, m, threads), RangeDecoder(distance_orders), {}, {}, 0, {}});
    bool decoded = false;
    discovery->unvisited.search_beside([&] { decoded = decode_fans(decoder, triangle_count, *discovery, triangles); });
    if (!decoded)
        return fail(ErrorKind::corrupt_stream,
                    "The M-TFAN connectivity names vertices that do not exist or ends early: the stream is damaged.");
    for (Triangle& triangle : triangles)
        for (std::uint32_t& vertex : triangle) vertex = discovery->order[vertex];
    return triangles;
}

}  // namespace htvm::internal
