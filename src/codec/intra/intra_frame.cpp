#include "codec/intra/intra_frame.h"

#include <algorithm>
#include <string>

#include "codec/intra/attribute_values.h"
#include "codec/intra/colours.h"
#include "codec/intra/duplicates.h"
#include "codec/intra/neighbours.h"
#include "codec/intra/positions.h"
#include "codec/intra/tfan.h"
#include "core/parallel.h"
#include "core/progress.h"

namespace htvm::internal {
namespace {

// Waking a thread costs more than a small mesh does.
Threads threads_for(std::size_t vertices, Threads threads) { return threads.at_most(vertices < 2000 ? 1 : 3); }

// Positions in grid steps; colours as captured.
LatticeMesh on_grid(const LatticeMesh& mesh, std::int32_t step) {
    LatticeMesh out = mesh;
    for (auto& p : out.positions) p = to_grid(p, step);
    return out;
}

Colour quantised(Colour colour, std::int32_t step) {
    for (auto& c : colour) c = static_cast<std::uint8_t>((c + step / 2) / step);
    return colour;
}

// Merges vertices with the same position, attributes and quantised colour; the colour of the first is kept.
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

// Normals and texture coordinates.
void encode_values(const LatticeMesh& mesh, const Neighbours& neighbours, FramePayload& payload) {
    if (!mesh.normals.empty()) payload.set(Layer::normals, encode_attribute_values(mesh.normals, neighbours));
    if (!mesh.texcoords.empty()) payload.set(Layer::texcoords, encode_attribute_values(mesh.texcoords, neighbours));
}
Result<void> decode_values(const FramePayloadView& payload, const Neighbours& neighbours, LatticeMesh& mesh) {
    if (payload.has(Layer::normals)) {
        auto normals = decode_attribute_values<QuantisedNormal>(payload.of(Layer::normals), neighbours);
        if (!normals) return tl::unexpected(normals.error());
        mesh.normals = std::move(*normals);
    }
    if (payload.has(Layer::texcoords)) {
        auto texcoords = decode_attribute_values<QuantisedTexcoord>(payload.of(Layer::texcoords), neighbours);
        if (!texcoords) return tl::unexpected(texcoords.error());
        mesh.texcoords = std::move(*texcoords);
    }
    return {};
}

// The vertices of a mesh in coding order, each with its neighbours.
Result<Neighbours> ordered_neighbours(const LatticeMesh& mesh, Threads threads) {
    const auto corners = find_corners(mesh.triangles, mesh.positions.size(), threads);
    if (!corners) return tl::unexpected(corners.error());
    auto out = empty_rows(*corners);
    order_vertices(*corners, {}, out);
    return out;
}

Result<LatticeMesh> encode_by_tfan(const LatticeMesh& grid, const IntraFrameOptions& options, FramePayload& payload) {
    auto connectivity = encode_tfan(static_cast<std::uint32_t>(grid.positions.size()), grid.triangles);
    LatticeMesh mesh = kept_vertices(grid, connectivity.order);
    mesh.triangles = std::move(connectivity.triangles);
    payload.set(Layer::fans, std::move(connectivity.bytes));
    const auto threads = threads_for(mesh.positions.size(), options.threads);
    const auto corners = find_corners(mesh.triangles, mesh.positions.size(), threads);
    if (!corners) return tl::unexpected(corners.error());
    auto neighbours = empty_rows(*corners);
    std::vector<std::uint8_t> positions;
    EncodedColours colours;
    Progress ordered;
    parallel_invoke(
        threads,
        [&] {
            const EndOfProgress end{ordered};
            order_vertices(*corners, {}, neighbours, &ordered);
        },
        [&] { positions = encode_intra_positions(mesh.positions, neighbours, {}, &ordered); },
        [&] {
            if (mesh.colours.empty()) return;
            colours = encode_intra_colours(mesh.colours, mesh.positions, neighbours, options.colour_step, {}, &ordered);
        });
    payload.set(Layer::geometry, std::move(positions));
    if (!mesh.colours.empty()) {
        payload.set(Layer::colour, std::move(colours.bytes));
        mesh.colours = std::move(colours.decoded);
    }
    encode_values(mesh, neighbours, payload);
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

Result<LatticeMesh> decode_by_tfan(const FramePayloadView& payload, Threads threads) {
    const auto& h = payload.header;
    LatticeMesh mesh;
    auto triangles = decode_tfan(payload.of(Layer::fans), h.vertices, h.triangles);
    if (!triangles) return tl::unexpected(triangles.error());
    mesh.triangles = std::move(*triangles);
    threads = threads_for(h.vertices, threads);
    const auto corners = find_corners(mesh.triangles, h.vertices, threads);
    if (!corners) return fail(ErrorKind::corrupt_stream, "I-frame: " + corners.error().message);
    auto neighbours = empty_rows(*corners);
    // Positions follow behind the order, colours behind both.
    Result<void> positions;
    Result<std::vector<Colour>> colours;
    Progress ordered, located;
    mesh.positions.resize(h.vertices);
    parallel_invoke(
        threads,
        [&] {
            const EndOfProgress end{ordered};
            order_vertices(*corners, {}, neighbours, &ordered);
        },
        [&] {
            const EndOfProgress end{located};
            positions =
                decode_intra_positions(payload.of(Layer::geometry), neighbours, {}, mesh.positions, &ordered, &located);
        },
        [&] {
            if (!payload.has(Layer::colour)) return;
            colours =
                decode_intra_colours(payload.of(Layer::colour), mesh.positions, neighbours,
                                     static_cast<std::int32_t>(payload.header.colour_step), {}, &ordered, &located);
        });
    if (!positions) return tl::unexpected(positions.error());
    if (!colours) return tl::unexpected(colours.error());
    mesh.colours = std::move(*colours);
    if (auto ok = decode_values(payload, neighbours, mesh); !ok) return tl::unexpected(ok.error());
    return mesh;
}

bool within_attribute_limit(const auto& values) {
    for (const auto& value : values)
        for (const std::int32_t c : value)
            if (c < -attribute_limit || c > attribute_limit) return false;
    return true;
}

// The output of another coder is not trusted: sizes must be as announced, indices and attributes in range.
Result<LatticeMesh> decode_by(const ExternalIntraCoder& coder, const FramePayloadView& payload) {
    if (coder.claims) {
        const auto claimed = coder.claims(payload.of(Layer::external_intra));
        if (!claimed) return tl::unexpected(claimed.error());
        if (claimed->vertices > payload.header.vertices || claimed->triangles > payload.header.triangles)
            return fail(ErrorKind::corrupt_stream, "I-frame: its mesh is larger than its header says");
    }
    auto mesh = coder.decode(payload.of(Layer::external_intra));
    if (!mesh) return mesh;
    const auto n = mesh->positions.size();
    auto fits = [&](std::size_t values) { return values == 0 || values == n; };
    const bool in_range = std::all_of(mesh->triangles.begin(), mesh->triangles.end(),
                                      [&](const Triangle& t) { return t[0] < n && t[1] < n && t[2] < n; });
    if (n != payload.header.vertices || mesh->triangles.size() != payload.header.triangles || !in_range ||
        !fits(mesh->colours.size()) || !fits(mesh->normals.size()) || !fits(mesh->texcoords.size()) ||
        !within_attribute_limit(mesh->normals) || !within_attribute_limit(mesh->texcoords))
        return fail(ErrorKind::corrupt_stream, "I-frame: its mesh is not what its header says");
    for (auto& colour : mesh->colours)
        for (auto& c : colour)
            c = static_cast<std::uint8_t>(std::min<std::uint32_t>(c * payload.header.colour_step, 255));
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

Result<void> encode_intra_attributes(LatticeMesh& mesh, std::int32_t colour_step, FramePayload& payload,
                                     Threads threads) {
    payload.header.colour_step = static_cast<std::uint32_t>(colour_step);
    const auto neighbours = ordered_neighbours(mesh, threads_for(mesh.positions.size(), threads));
    if (!neighbours) return tl::unexpected(neighbours.error());
    if (!mesh.colours.empty()) {
        auto colours = encode_intra_colours(mesh.colours, mesh.positions, *neighbours, colour_step, {});
        payload.set(Layer::colour, std::move(colours.bytes));
        mesh.colours = std::move(colours.decoded);
    }
    encode_values(mesh, *neighbours, payload);
    return {};
}

Result<void> decode_intra_attributes(const FramePayloadView& payload, LatticeMesh& mesh, Threads threads) {
    if (!payload.has(Layer::colour) && !payload.has(Layer::normals) && !payload.has(Layer::texcoords)) return {};
    const auto neighbours = ordered_neighbours(mesh, threads_for(mesh.positions.size(), threads));
    if (!neighbours) return fail(ErrorKind::corrupt_stream, "I-frame: " + neighbours.error().message);
    if (payload.has(Layer::colour)) {
        auto colours = decode_intra_colours(payload.of(Layer::colour), mesh.positions, *neighbours,
                                            static_cast<std::int32_t>(payload.header.colour_step), {});
        if (!colours) return tl::unexpected(colours.error());
        mesh.colours = std::move(*colours);
    }
    return decode_values(payload, *neighbours, mesh);
}

Result<LatticeMesh> decode_intra_frame(const FramePayloadView& payload, const ExternalIntraCoder* external,
                                       Threads threads) {
    const auto number = payload.header.intra_coder;
    if (number != intra_coder_tfan && (!external || external->number != number))
        return fail(ErrorKind::unsupported, "the I-frame was coded by " +
                                                std::string(number == intra_coder_draco ? "Draco" : "another coder") +
                                                ", which this decoder was built without");
    auto mesh = number == intra_coder_tfan ? decode_by_tfan(payload, threads) : decode_by(*external, payload);
    if (!mesh) return mesh;
    const auto step = static_cast<std::int32_t>(payload.header.geometry_step);
    const std::int32_t limit = lattice_limit / step;
    const auto inside = [&](std::int32_t c) { return c >= -limit && c <= limit; };
    for (auto& p : mesh->positions) {
        if (!inside(p.x) || !inside(p.y) || !inside(p.z))
            return fail(ErrorKind::corrupt_stream, "I-frame: a vertex lies off the lattice");
        p = from_grid(p, step);
    }
    return mesh;
}

}  // namespace htvm::internal
