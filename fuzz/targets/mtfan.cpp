// Connectivity of EP-frames: any triangles over any positions come back; any bytes give triangles, or an error.
#include "codec/bones/mtfan.h"

#include "small_mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    using namespace htvm::internal;
    using fuzz::require;
    fuzz::FuzzInput input(data, size);
    const auto mesh = fuzz::small_mesh(input);
    const int m = static_cast<int>(1 + input.below(mtfan_max_nearest));
    const std::size_t vertices = mesh.positions.size();
    const auto triangles = static_cast<std::uint32_t>(mesh.triangles.size());
    const auto encoded = encode_mtfan(mesh.positions, mesh.triangles, m, {});
    const auto decoded = decode_mtfan(encoded.fans, encoded.distance_orders, mesh.positions, triangles, m, {});
    require(decoded && *decoded == encoded.triangles, "the triangles that the encoder promised");
    require(fuzz::as_set(*decoded) == fuzz::as_set(mesh.triangles), "the same surface");
    const std::uint32_t claimed = input.flag() ? input.u16() : triangles;
    const bool raw = input.flag();
    const auto fans = raw ? std::vector<std::uint8_t>{} : fuzz::damaged(encoded.fans, input);
    const auto orders = raw ? std::vector<std::uint8_t>{} : fuzz::damaged(encoded.distance_orders, input);
    const auto some = input.take(input.left() / 2), others = input.rest();
    const auto bad = raw ? decode_mtfan(some, others, mesh.positions, claimed, m, {})
                         : decode_mtfan(fans, orders, mesh.positions, claimed, m, {});
    if (bad) require(bad->size() == claimed && fuzz::names_vertices(*bad, vertices), "triangles of vertices there are");
    return 0;
}
