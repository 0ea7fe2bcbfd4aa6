#include "codec/intra/tfan.h"

#include <memory>

#include "codec/intra/triangle_fans.h"

namespace htvm::internal {
namespace {

// A new vertex takes the next visiting number. Nothing needs to be coded for it; the decoder only checks that a vertex
// is left.
struct NextNumberOfEncoder {
    static constexpr bool visits_isolated = false;
    void seed(std::uint32_t) {}
    FanHints hints(const FanState&) const { return {}; }
    void discover(const FanState&, std::uint32_t) {}
};

struct NextNumberOfDecoder {
    static constexpr bool visits_isolated = false;
    std::uint32_t vertices_left;
    bool seed() { return vertices_left-- > 0; }
    FanHints hints(const FanState&) const { return {}; }
    bool discover(const FanState&) { return vertices_left-- > 0; }
};

}  // namespace

EncodedTfan encode_tfan(std::uint32_t vertex_count, std::span<const Triangle> triangles) {
    RangeEncoder encoder;
    WritingCoder<RangeEncoder> coder{encoder};
    const auto models = std::unique_ptr<FanModels>(new FanModels);
    NextNumberOfEncoder discovery;
    FanOrder fans = encode_fans(coder, *models, vertex_count, triangles, discovery);
    std::vector<bool> visited(vertex_count);
    for (const std::uint32_t vertex : fans.order) visited[vertex] = true;
    for (std::uint32_t vertex = 0; vertex < vertex_count; ++vertex)
        if (!visited[vertex]) fans.order.push_back(vertex);
    return {encoder.finish(), std::move(fans.order), std::move(fans.triangles)};
}

Result<std::vector<Triangle>> decode_tfan(std::span<const std::uint8_t> bytes, std::uint32_t vertex_count,
                                          std::uint32_t triangle_count) {
    RangeDecoder decoder(bytes);
    NextNumberOfDecoder discovery{vertex_count};
    std::vector<Triangle> triangles;
    if (!decode_fans(decoder, triangle_count, discovery, triangles))
        return fail(ErrorKind::corrupt_stream,
                    "The TFAN connectivity names vertices that do not exist or ends early: the stream is damaged.");
    return triangles;
}

}  // namespace htvm::internal
