#include <algorithm>

#include "codec/intra/attribute_values.h"
#include "codec/paper/duplicates_enc.h"
#include "codec/intra/intra_colours.h"
#include "codec/intra/intra_frame.h"
#include "codec/intra/intra_neighbours.h"
#include "codec/intra/intra_positions.h"
#include "codec/intra/tfan.h"

namespace htvm::internal {
namespace {

// Positions in grid steps; colours as captured.
LatticeMesh on_grid(const LatticeMesh& mesh, std::int32_t step) {
    LatticeMesh out = mesh;
    for (auto& p : out.positions)
        p = {static_cast<std::int32_t>(divide_rounded(p.x, step)), static_cast<std::int32_t>(divide_rounded(p.y, step)),
             static_cast<std::int32_t>(divide_rounded(p.z, step))};
    return out;
}

Colour quantised(Colour colour, std::int32_t step) {
    for (auto& c : colour) c = static_cast<std::uint8_t>((c + step / 2) / step);
    return colour;
}

// Vertices merge where position, attributes and quantised colour are the same; the first one's colour stays.
LatticeMesh without_duplicates(const LatticeMesh& grid, std::int32_t colour_step) {
    LatticeMesh quantised_colours;
    quantised_colours.positions = grid.positions;
    quantised_colours.normals = grid.normals;
    quantised_colours.texcoords = grid.texcoords;
    for (const auto& c : grid.colours) quantised_colours.colours.push_back(quantised(c, colour_step));
    const auto merging = find_duplicates(quantised_colours);
    LatticeMesh out = kept_vertices(grid, merging.kept);
    out.triangles = merged_triangles(grid.triangles, merging, true);
    return out;
}

Result<LatticeMesh> encode_by_tfan(const LatticeMesh& grid, const IntraFrameOptions& options, FramePayload& payload) {
    auto connectivity = encode_tfan(static_cast<std::uint32_t>(grid.positions.size()), grid.triangles);
    LatticeMesh mesh = kept_vertices(grid, connectivity.order);
    mesh.triangles = std::move(connectivity.triangles);
    const auto neighbours = find_neighbours(mesh.triangles, mesh.positions.size());
    if (!neighbours) return tl::unexpected(neighbours.error());
    payload.set(Layer::fans, std::move(connectivity.bytes));
    payload.set(Layer::geometry, encode_intra_positions(mesh.positions, *neighbours));
    if (!mesh.colours.empty()) {
        auto coded = encode_intra_colours(mesh.colours, mesh.positions, *neighbours, options.colour_step);
        payload.set(Layer::colour, std::move(coded.bytes));
        mesh.colours = std::move(coded.decoded);
    }
    if (!mesh.normals.empty()) payload.set(Layer::normals, encode_attribute_values(mesh.normals, *neighbours));
    if (!mesh.texcoords.empty()) payload.set(Layer::texcoords, encode_attribute_values(mesh.texcoords, *neighbours));
    return mesh;
}

Result<LatticeMesh> encode_by(const ExternalIntraCoder& coder, LatticeMesh grid, const IntraFrameOptions& options,
                              FramePayload& payload) {
    for (auto& colour : grid.colours) colour = quantised(colour, options.colour_step);
    auto bytes = coder.encode(grid);
    if (!bytes) return tl::unexpected(bytes.error());
    auto mesh = coder.decode(*bytes);
    if (!mesh) return mesh;
    for (auto& colour : mesh->colours)
        for (auto& c : colour) c = static_cast<std::uint8_t>(std::min(c * options.colour_step, 255));
    payload.set(Layer::external_intra, std::move(*bytes));
    return mesh;
}

}  // namespace

Result<LatticeMesh> encode_intra_frame(const LatticeMesh& mesh, const IntraFrameOptions& options,
                                       FramePayload& payload) {
    LatticeMesh grid = on_grid(mesh, options.geometry_step);
    if (options.merge_duplicates) grid = without_duplicates(grid, options.colour_step);
    auto decoded = options.external ? encode_by(*options.external, std::move(grid), options, payload)
                                    : encode_by_tfan(grid, options, payload);
    if (!decoded) return decoded;
    for (auto& p : decoded->positions) p = from_grid(p, options.geometry_step);
    auto& header = payload.header;
    header.source_vertices = static_cast<std::uint32_t>(mesh.positions.size());
    header.source_triangles = static_cast<std::uint32_t>(mesh.triangles.size());
    header.vertices = static_cast<std::uint32_t>(decoded->positions.size());
    header.triangles = static_cast<std::uint32_t>(decoded->triangles.size());
    header.geometry_step = static_cast<std::uint32_t>(options.geometry_step);
    header.colour_step = static_cast<std::uint32_t>(options.colour_step);
    header.intra_coder = options.external ? options.external->number : intra_coder_tfan;
    return decoded;
}

}  // namespace htvm::internal
