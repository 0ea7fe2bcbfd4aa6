#include <algorithm>
#include <string>

#include "codec/intra/attribute_values.h"
#include "codec/intra/intra_colours.h"
#include "codec/intra/intra_frame.h"
#include "codec/intra/intra_neighbours.h"
#include "codec/intra/intra_positions.h"
#include "codec/intra/tfan.h"

namespace htvm::internal {
namespace {

Result<LatticeMesh> decode_by_tfan(const FramePayload& payload) {
    const auto& h = payload.header;
    LatticeMesh mesh;
    auto triangles = decode_tfan(payload.of(Layer::fans), h.vertices, h.triangles);
    if (!triangles) return tl::unexpected(triangles.error());
    mesh.triangles = std::move(*triangles);
    const auto neighbours = find_neighbours(mesh.triangles, h.vertices);
    if (!neighbours) return fail(ErrorKind::corrupt_stream, "I-frame: " + neighbours.error().message);
    auto positions = decode_intra_positions(payload.of(Layer::geometry), *neighbours);
    if (!positions) return tl::unexpected(positions.error());
    mesh.positions = std::move(*positions);
    if (payload.has(Layer::colour)) {
        auto colours = decode_intra_colours(payload.of(Layer::colour), mesh.positions, *neighbours,
                                            static_cast<std::int32_t>(h.colour_step));
        if (!colours) return tl::unexpected(colours.error());
        mesh.colours = std::move(*colours);
    }
    if (payload.has(Layer::normals)) {
        auto normals = decode_attribute_values<QuantisedNormal>(payload.of(Layer::normals), *neighbours);
        if (!normals) return tl::unexpected(normals.error());
        mesh.normals = std::move(*normals);
    }
    if (payload.has(Layer::texcoords)) {
        auto texcoords = decode_attribute_values<QuantisedTexcoord>(payload.of(Layer::texcoords), *neighbours);
        if (!texcoords) return tl::unexpected(texcoords.error());
        mesh.texcoords = std::move(*texcoords);
    }
    return mesh;
}

bool within_attribute_limit(const auto& values) {
    for (const auto& value : values)
        for (const std::int32_t c : value)
            if (c < -attribute_limit || c > attribute_limit) return false;
    return true;
}

// What another coder gives back is not trusted: sizes as announced, indices and attributes in range.
Result<LatticeMesh> decode_by(const ExternalIntraCoder& coder, const FramePayload& payload) {
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

Result<LatticeMesh> decode_intra_frame(const FramePayload& payload, const ExternalIntraCoder* external) {
    const auto number = payload.header.intra_coder;
    if (number != intra_coder_tfan && (!external || external->number != number))
        return fail(ErrorKind::unsupported, "the I-frame was coded by " +
                                                std::string(number == intra_coder_draco ? "Draco" : "another coder") +
                                                ", which this decoder was built without");
    auto mesh = number == intra_coder_tfan ? decode_by_tfan(payload) : decode_by(*external, payload);
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
