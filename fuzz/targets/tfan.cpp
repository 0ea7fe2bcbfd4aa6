// Connectivity of I-frames: any triangles come back; any bytes give triangles of existing vertices, or an error.
#include "codec/intra/tfan.h"

#include "small_mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    using namespace htvm::internal;
    using fuzz::require;
    fuzz::FuzzInput input(data, size);
    if (input.flag()) {
        const std::uint32_t vertices = input.u16(), triangles = input.u16();
        const auto decoded = decode_tfan(input.rest(), vertices, triangles);
        if (decoded)
            require(decoded->size() == triangles && fuzz::names_vertices(*decoded, vertices),
                    "as many triangles as wanted, of vertices that are there");
        return 0;
    }
    const auto mesh = fuzz::small_mesh(input);
    const auto vertices = static_cast<std::uint32_t>(mesh.positions.size());
    const auto triangles = static_cast<std::uint32_t>(mesh.triangles.size());
    const auto encoded = encode_tfan(vertices, mesh.triangles);
    const auto decoded = decode_tfan(encoded.bytes, vertices, triangles);
    require(decoded && *decoded == encoded.triangles, "the triangles that the encoder promised");
    auto order = encoded.order;
    auto source = *decoded;
    for (auto& t : source)
        for (auto& v : t) v = order[v];
    require(fuzz::as_set(source) == fuzz::as_set(mesh.triangles), "the same surface");
    std::sort(order.begin(), order.end());
    for (std::uint32_t v = 0; v < vertices; ++v) require(order[v] == v, "the order is a permutation");
    const auto bad = decode_tfan(fuzz::damaged(encoded.bytes, input), vertices, triangles);
    if (bad) require(fuzz::names_vertices(*bad, vertices), "damage names no vertex that is not there");
    return 0;
}
