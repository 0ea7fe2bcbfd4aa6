// Levels of a surface on any base: any bytes give a surface on the lattice whose triangles have corners that exist, no
// larger than allowed, the same each time; or an error. The first levels lie where they lie in the whole, without the
// bytes of the others.
#include "codec/intra/surface_levels.h"

#include <algorithm>

#include "small_mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    using namespace htvm::internal;
    using fuzz::require;
    constexpr std::size_t most_vertices = 4000;
    fuzz::FuzzInput input(data, size);
    const auto mesh = fuzz::small_mesh(input);
    LatticeMesh base;
    base.positions = mesh.positions;
    base.triangles = mesh.triangles;
    const auto payload = input.rest();
    const auto surface = decode_surface_levels(payload, base, most_vertices);
    if (!surface) return 0;
    require(surface->positions.size() <= std::max(most_vertices, base.positions.size()),
            "no more vertices than allowed");
    require(surface->positions.size() >= base.positions.size(), "the base's vertices are there");
    require(fuzz::all_on_lattice(surface->positions), "vertices are on the lattice");
    require(fuzz::names_vertices(surface->finest(), surface->positions.size()), "corners exist");
    require(surface->displacements.size() == surface->positions.size(), "each vertex has a displacement");
    const auto again = decode_surface_levels(payload, base, most_vertices);
    require(again && again->positions == surface->positions && again->finest() == surface->finest(),
            "the same payload gives the same surface");
    const auto header = read_levels_header(payload);
    require(header.has_value(), "what is decoded has a header");
    const auto level = static_cast<std::uint32_t>(payload.size() % (header->levels.depth.levels + 1));
    const auto first = decode_surface_levels(payload.first(header->ends[level]), base, most_vertices, level);
    require(first && first->positions.size() <= surface->positions.size() &&
                std::equal(first->positions.begin(), first->positions.end(), surface->positions.begin()),
            "the first levels are those of the whole");
    return 0;
}
