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
    VisitedPositions known;
    std::vector<std::uint32_t> order;  // input index by visiting number
    RangeEncoder encoder;
    DistanceOrderModels models;
    std::vector<std::uint32_t> counts;

    void visit(std::uint32_t vertex) {
        unvisited.visit(vertex);
        known.push_back(positions[vertex]);
        order.push_back(vertex);
    }
    void seed(std::uint32_t vertex) { visit(vertex); }
    FanHints hints(const FanState& fan) const { return known.hints(fan); }
    void discover(const FanState& fan, std::uint32_t vertex) {
        WritingCoder<RangeEncoder> coder{encoder};
        const std::size_t place = code_distance_order(coder, models, unvisited, known, fan, order[fan.focus], vertex);
        if (place == unvisited.candidates().size()) {
            code_index_directly(coder, models, order[fan.current == OpenEdges::none ? fan.focus : fan.current], vertex);
            ++counts.back();
        } else {
            ++counts[place];
        }
        visit(vertex);
    }
};

}  // namespace

EncodedMtfan encode_mtfan(std::span<const LatticePoint> decoded_positions, std::span<const Triangle> triangles, int m,
                          Threads threads) {
    EncodedMtfan result;
    result.distance_order_counts.resize(static_cast<std::size_t>(m) + 1);
    if (triangles.empty()) return result;
    RangeEncoder encoder;
    WritingCoder<RangeEncoder> coder{encoder};
    const auto models = std::make_unique<FanModels>();
    const auto discovery =
        std::unique_ptr<DistanceOrders>(new DistanceOrders{decoded_positions,
                                                           UnvisitedNear(decoded_positions, m, threads),
                                                           {},
                                                           {},
                                                           {},
                                                           {},
                                                           std::move(result.distance_order_counts)});
    FanOrder fans;
    discovery->unvisited.search_beside([&] {
        fans = encode_fans(coder, *models, static_cast<std::uint32_t>(decoded_positions.size()), triangles, *discovery);
    });
    result.fans = encoder.finish();
    result.distance_orders = discovery->encoder.finish();
    result.distance_order_counts = std::move(discovery->counts);
    result.triangles = std::move(fans.triangles);
    for (Triangle& triangle : result.triangles)
        for (std::uint32_t& vertex : triangle) vertex = fans.order[vertex];
    return result;
}

}  // namespace htvm::internal
