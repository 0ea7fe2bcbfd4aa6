#include "io/ply.h"

#include <algorithm>
#include <istream>
#include <limits>
#include <string>
#include <utility>

#include "io/corner_values.h"
#include "io/finite_mesh.h"
#include "io/ply_body.h"
#include "io/ply_faces.h"
#include "io/ply_vertices.h"

namespace htvm {

namespace {

// What the elements hold, before it becomes a mesh.
struct PlyElements {
    Mesh mesh;
    RawColours vertex_colours;  // those that are not in the mesh
    PlyFaces faces;
    MeshFindings findings;
};

Result<void> skip_element(PlyBody& body, const PlyElement& element) {
    if (element.properties.empty()) return {};
    const std::uint64_t fewest = fewest_element_bytes(element, body.format);
    for (std::uint64_t i = 0; i < element.count; ++i) {
        fetch_ahead(body, fewest, element.count - i);
        for (const PlyProperty& property : element.properties) {
            if (!skip_property(body, property)) return ends_within(element, i);
        }
    }
    return {};
}

// The number of vertices, within limits.
Result<std::uint64_t> vertex_count(const PlyHeader& header, const MeshLimits& limits) {
    const auto vertices = std::ranges::find(header.elements, "vertex", &PlyElement::name);
    if (vertices == header.elements.end())
        return fail(ErrorKind::bad_input, "the PLY header declares no element \"vertex\"");
    const std::uint64_t most = std::min<std::uint64_t>(limits.most_vertices, std::numeric_limits<std::uint32_t>::max());
    if (auto ok = check_count(vertices->count, most, "vertices"); !ok) return tl::unexpected(ok.error());
    return vertices->count;
}

Result<PlyElements> read_elements(PlySource& source, const PlyHeader& header, const MeshReadOptions& options) {
    const auto vertices = vertex_count(header, options.limits);
    if (!vertices) return tl::unexpected(vertices.error());
    const std::uint64_t most_triangles =
        std::min<std::uint64_t>(options.limits.most_triangles, std::numeric_limits<std::uint32_t>::max());
    const PlyFaceLimits limits{*vertices, most_triangles};
    PlyBody body{source, header.format};
    PlyElements out;
    for (const PlyElement& element : header.elements) {
        Result<void> read = check_element_count(body, element);
        if (!read) return tl::unexpected(read.error());
        if (element.name == "vertex") {
            read = read_ply_vertices(body, element, options, out.mesh, out.vertex_colours, out.findings);
        } else if (element.name == "face") {
            read = read_ply_faces(body, element, limits, out.mesh, out.faces);
        } else if (element.name == "tristrips") {
            read = read_ply_strips(body, element, limits, out.mesh);
        } else {
            read = skip_element(body, element);
        }
        if (!read) return tl::unexpected(read.error());
    }
    skip_rest_of_line(body, header.line_end);
    return out;
}

// Where vertices have no colours, those of faces become theirs.
void give_colours(PlyElements& elements, const MeshReadOptions& options) {
    auto& [mesh, vertex_colours, faces, findings] = elements;
    const bool has_vertex_colours = !mesh.colours.empty() || !vertex_colours.values.empty();
    if (!has_vertex_colours && faces.colours.empty()) return;
    RawColours of_corners{faces.colour_numbers, {}};
    if (!has_vertex_colours) {
        for (const auto& triangle : faces.colours)
            of_corners.values.insert(of_corners.values.end(), triangle.begin(), triangle.end());
    }
    findings.colour_levels = levels_of(has_vertex_colours ? vertex_colours : of_corners);
    const ColourRange range = options.colour_range.value_or(colour_range_of(findings.colour_levels));
    if (has_vertex_colours) {
        if (mesh.colours.empty()) mesh.colours = colours_of(vertex_colours, range);
        if (!faces.colours.empty())
            remark(&findings, "face-colours", "its faces have colours too, of which those of its vertices are taken");
        return;
    }
    std::vector<std::array<Colour, 3>> corners(faces.colours.size());
    for (std::size_t t = 0; t < corners.size(); ++t) {
        for (std::size_t c = 0; c < 3; ++c) corners[t][c] = colour_of(faces.colours[t][c], faces.colour_numbers, range);
    }
    give_colours_of_corners(mesh, corners);
    remark(&findings, "face-colours", "its faces have colours, which vertices take on average");
}

// The parts by the images that the header names and the faces' numbers of them.
void give_parts(const PlyHeader& header, PlyElements& elements) {
    auto& texture = elements.findings.texture;
    const std::size_t images = header.textures.size(), triangles = elements.mesh.triangles.size();
    if (images == 0) return;
    for (const auto& name : header.textures) texture.parts.push_back({{}, add_image(texture, name), {}});
    auto& numbers = elements.faces.textures;
    const auto is_named = [&](std::int32_t number) { return number >= 0 && static_cast<std::size_t>(number) < images; };
    if (std::ranges::none_of(numbers, is_named)) {
        if (images > 1) {
            remark(&elements.findings, "texture-numbers",
                   "it names " + std::to_string(images) +
                       " images but not which faces have which (texnumber): all have the first",
                   true);
        }
        return;
    }
    numbers.resize(triangles);
    const bool is_one = images == 1 && std::ranges::all_of(numbers, is_named);
    if (is_one) return;
    for (const auto number : numbers)
        texture.part_of_triangle.push_back(static_cast<std::uint16_t>(is_named(number) ? number : images));
    if (!std::ranges::all_of(numbers, is_named)) texture.parts.push_back({});
}

Result<PlyAtStart> read_one(PlySource& source, const MeshReadOptions& options) {
    const auto header = read_ply_header(source);
    if (!header) return tl::unexpected(header.error());
    auto elements = read_elements(source, *header, options);
    if (!elements) return tl::unexpected(elements.error());
    auto& mesh = elements->mesh;
    give_colours(*elements, options);
    give_parts(*header, *elements);
    if (auto& texcoords = elements->faces.texcoords; !texcoords.empty()) {
        texcoords.resize(mesh.triangles.size());
        if (auto ok = give_texcoords_of_corners(mesh, texcoords, options.limits.most_vertices); !ok)
            return tl::unexpected(ok.error());
    }
    mend_fans(mesh, elements->faces.fans);
    if (auto ok = leave_out_not_finite(mesh, elements->findings); !ok) return tl::unexpected(ok.error());
    return PlyAtStart{std::move(mesh), std::move(elements->findings), header->timestamp, header->fps,
                      static_cast<std::size_t>(source.consumed())};
}

}  // namespace

Result<PlyAtStart> read_ply_at_start(std::span<const std::uint8_t> bytes, const MeshReadOptions& options) {
    PlySource source(bytes);
    return read_one(source, options);
}

Result<Mesh> read_ply(std::span<const std::uint8_t> bytes, const MeshReadOptions& options, MeshFindings* findings) {
    auto read = read_ply_at_start(bytes, options);
    if (!read) return tl::unexpected(read.error());
    if (PlySource rest(bytes.subspan(read->bytes_consumed)); is_ply(rest))
        return fail(ErrorKind::bad_input, "the file holds more than one PLY; give such a file on standard input");
    if (findings) *findings = std::move(read->findings);
    return std::move(read->mesh);
}

Result<std::string> read_ply_timestamp(std::istream& stream) {
    PlySource source(*stream.rdbuf());
    const auto header = read_ply_header(source);
    if (!header) return tl::unexpected(header.error());
    return header->timestamp;
}

PlyStreamReader::PlyStreamReader(std::istream& stream, const MeshReadOptions& options)
    : stream_(stream), options_(options) {}

Result<std::optional<Mesh>> PlyStreamReader::next() {
    if (error_) return tl::unexpected(*error_);
    PlySource source(*stream_.rdbuf());
    if (!skip_to_ply(source)) return std::optional<Mesh>();
    auto read = read_one(source, options_);
    if (!read) {
        error_ = Error{read.error().kind,
                       "mesh " + std::to_string(meshes_read_) + " of the stream: " + read.error().message};
        return tl::unexpected(*error_);
    }
    ++meshes_read_;
    timestamp_ = std::move(read->timestamp);
    fps_ = std::move(read->fps);
    findings_ = std::move(read->findings);
    return std::optional<Mesh>(std::move(read->mesh));
}

}  // namespace htvm
