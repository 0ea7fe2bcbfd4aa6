// Presence on any mesh: what is written comes back, whatever was known before; any bytes give 0 or 1 for each vertex,
// and damaged layers that or an error. What is shown are triangles of the mesh.
#include "codec/tracked/presence.h"

#include <algorithm>

#include "small_mesh.h"

namespace {

using namespace htvm;
using namespace htvm::internal;
using fuzz::require;

// The same for all but some stretches of vertices.
Presence any_presence(std::size_t vertices, std::uint32_t values, fuzz::FuzzInput& input) {
    Presence out(vertices, static_cast<std::uint8_t>(input.below(values)));
    for (std::uint32_t n = input.below(16); n > 0 && vertices > 0; --n) {
        const std::size_t at = input.below(static_cast<std::uint32_t>(vertices));
        const auto value = static_cast<std::uint8_t>(input.below(values));
        for (std::size_t v = at; v < std::min(at + 1 + input.u8() % 32, vertices); ++v) out[v] = value;
    }
    return out;
}

bool tells_each(const Presence& presence, std::size_t vertices) {
    return presence.size() == vertices && std::ranges::all_of(presence, [](auto is) { return is <= 1; });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    const auto mesh = fuzz::small_mesh(input);
    const auto vertices = mesh.positions.size();
    const auto around = vertices_around(vertices, mesh.triangles);
    const auto before = input.flag() ? any_presence(vertices, 3, input) : Presence{};
    const auto presence = any_presence(vertices, 2, input);

    RangeEncoder encoder;
    write_presence(encoder, around, before, presence);
    const auto position = encoder.position();
    const auto run = encoder.finish();
    RangeDecoder decoder(run);
    require(read_presence(decoder, around, before) == presence, "presence comes back");
    require(!decoder.exhausted() && decoder.position() == position, "both sides say where it ends");

    const auto layer = write_presence_layer(mesh.triangles, presence);
    const auto again = read_presence_layer(layer, vertices, mesh.triangles);
    require(again && *again == presence, "a layer comes back");
    if (const auto read = read_presence_layer(fuzz::damaged(layer, input), vertices, mesh.triangles))
        require(tells_each(*read, vertices), "a damaged layer tells 0 or 1 of each vertex");

    std::vector<Triangle> shown;
    triangles_shown(mesh.triangles, presence, shown);
    require(
        shown.size() <= mesh.triangles.size() && (anything_absent(presence) || shown.size() == mesh.triangles.size()),
        "what is shown is of the mesh, and all of it where all is there");

    RangeDecoder any(input.rest());
    require(tells_each(read_presence(any, around, before), vertices), "any bytes tell 0 or 1 of each vertex");
    return 0;
}
