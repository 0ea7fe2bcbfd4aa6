#include <memory>

#include "codec/intra/tfan.h"
#include "codec/intra/tfan_decode_fans.h"

namespace htvm::internal {
namespace {

struct NextNumber {
    static constexpr bool visits_isolated = false;
    std::uint32_t vertices_left;
    bool seed() { return vertices_left-- > 0; }
    FanHints hints(const FanState&) const { return {}; }
    bool discover(const FanState&) { return vertices_left-- > 0; }
};

}  // namespace

Result<std::vector<Triangle>> decode_tfan(std::span<const std::uint8_t> bytes, std::uint32_t vertex_count,
                                          std::uint32_t triangle_count) {
    RangeDecoder decoder(bytes);
    NextNumber discovery{vertex_count};
    std::vector<Triangle> triangles;
    if (!decode_fans(decoder, triangle_count, discovery, triangles))
        return fail(ErrorKind::corrupt_stream,
                    "The TFAN connectivity names vertices that do not exist or ends early: the stream is damaged.");
    return triangles;
}

}  // namespace htvm::internal
