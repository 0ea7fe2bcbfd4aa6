// Levels of a surface on any base: any bytes give a surface on the lattice whose triangles have corners that exist, no
// larger than allowed, the same each time; or an error.
#include "codec/intra/surface_levels.h"

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
    const auto run = input.rest();
    const auto surface = decode_surface_levels(run, base, most_vertices);
    if (!surface) return 0;
    require(surface->positions.size() <= std::max(most_vertices, base.positions.size()),
            "no more vertices than allowed");
    require(surface->positions.size() >= base.positions.size(), "the base's vertices are there");
    require(fuzz::all_on_lattice(surface->positions), "vertices are on the lattice");
    require(fuzz::names_vertices(surface->triangles, surface->positions.size()), "corners exist");
    const auto again = decode_surface_levels(run, base, most_vertices);
    require(again && again->positions == surface->positions && again->triangles == surface->triangles,
            "the same run gives the same surface");
    return 0;
}
