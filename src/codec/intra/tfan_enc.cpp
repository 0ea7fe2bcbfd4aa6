#include <memory>

#include "codec/intra/tfan.h"
#include "codec/intra/tfan_encode_fans.h"

namespace htvm::internal {
namespace {

struct NextNumber {
    static constexpr bool visits_isolated = false;
    void seed(std::uint32_t) {}
    FanHints hints(const FanState&) const { return {}; }
    void discover(const FanState&, std::uint32_t) {}
};

}  // namespace

EncodedTfan encode_tfan(std::uint32_t vertex_count, std::span<const Triangle> triangles) {
    RangeEncoder encoder;
    FanWriter coder{encoder};
    const auto models = std::make_unique<FanModels>();
    NextNumber discovery;
    FanOrder fans = encode_fans(coder, *models, vertex_count, triangles, discovery);
    std::vector<bool> visited(vertex_count);
    for (const std::uint32_t vertex : fans.order) visited[vertex] = true;
    for (std::uint32_t vertex = 0; vertex < vertex_count; ++vertex)
        if (!visited[vertex]) fans.order.push_back(vertex);
    return {encoder.finish(), std::move(fans.order), std::move(fans.triangles)};
}

}  // namespace htvm::internal
