#include "io/obj.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/equal_floats.h"
#include "io/finite_mesh.h"
#include "io/number_text.h"
#include "io/obj_line.h"
#include "io/obj_text.h"
#include "io/polygon.h"
#include "io/raw_colours.h"

namespace htvm {

namespace {

// True if every corner uses the attribute with the same index as its position, and the counts agree: then the attribute
// is one per position, also for positions that no corner uses.
bool in_step(const ObjText& obj, std::size_t count, std::uint32_t ObjCorner::*attribute) {
    return count == obj.positions.size() && std::all_of(obj.corners.begin(), obj.corners.end(),
                                                        [&](const ObjCorner& c) { return c.*attribute == c.position; });
}

// Assigns a vertex to every corner; `vertices` tells which combination each vertex is.
std::vector<std::uint32_t> vertices_of_corners(const ObjText& obj, std::vector<ObjCorner>& vertices) {
    // Equal values under several indices, as many exporters write one per corner, do not split vertices.
    const auto texcoord_of = internal::first_equal(std::span(obj.texcoords));
    const auto normal_of = internal::first_equal(std::span(obj.normals));
    vertices.assign(obj.positions.size(), ObjCorner{});
    std::vector<std::uint32_t> vertex_of_corner;
    vertex_of_corner.reserve(obj.corners.size());
    struct Hash {
        std::size_t operator()(const ObjCorner& c) const {
            std::uint64_t h = c.position * 0x9e3779b97f4a7c15u;
            h = (h ^ (h >> 29) ^ c.texcoord) * 0xbf58476d1ce4e5b9u;
            h = (h ^ (h >> 32) ^ c.normal) * 0x94d049bb133111ebu;
            return static_cast<std::size_t>(h ^ (h >> 31));
        }
    };
    std::unordered_map<ObjCorner, std::uint32_t, Hash> appended;
    for (ObjCorner corner : obj.corners) {
        if (corner.texcoord != no_index) corner.texcoord = texcoord_of[corner.texcoord];
        if (corner.normal != no_index) corner.normal = normal_of[corner.normal];
        ObjCorner& own = vertices[corner.position];
        if (own.position == no_index) own = corner;
        if (own == corner) {
            vertex_of_corner.push_back(corner.position);
            continue;
        }
        const auto [at, is_new] = appended.emplace(corner, static_cast<std::uint32_t>(vertices.size()));
        vertex_of_corner.push_back(at->second);
        if (is_new) vertices.push_back(corner);
    }
    return vertex_of_corner;
}

void give_colours(const ObjText& obj, const std::vector<ObjCorner>& vertices, const MeshReadOptions& options,
                  Mesh& mesh, MeshFindings& findings) {
    if (obj.colours.empty()) return;
    RawColours known;  // of the lines that have one
    known.numbers.fill(ColourNumbers::fractions);
    std::ranges::copy_if(obj.colours, std::back_inserter(known.values),
                         [](const auto& colour) { return !std::isnan(colour[0]); });
    findings.colour_levels = levels_of(known);
    const ColourRange range = options.colour_range.value_or(colour_range_of(findings.colour_levels));
    for (const auto& vertex : vertices) {
        const auto& colour = obj.colours[vertex.position];
        mesh.colours.push_back(std::isnan(colour[0]) ? Colour{255, 255, 255} : colour_of(colour, known.numbers, range));
    }
}

// The fans of polygons, and of which part each triangle is.
void give_triangles(const ObjText& obj, const std::vector<std::uint32_t>& vertex_of_corner, Mesh& mesh,
                    MeshFindings& findings) {
    std::vector<Fan> fans;
    const bool has_parts = findings.texture.parts.size() > 1;
    for (const ObjPolygon& polygon : obj.polygons) {
        const std::uint32_t* corners = vertex_of_corner.data() + polygon.first_corner;
        const auto first = static_cast<std::uint32_t>(mesh.triangles.size());
        if (polygon.corner_count > 3) fans.push_back({first, static_cast<std::uint32_t>(polygon.corner_count - 2)});
        for (std::size_t c = 2; c < polygon.corner_count; ++c) {
            mesh.triangles.push_back({corners[0], corners[c - 1], corners[c]});
            if (has_parts) findings.texture.part_of_triangle.push_back(polygon.part);
        }
    }
    mend_fans(mesh, fans);
}

Mesh mesh_of(const ObjText& obj, const MeshReadOptions& options, MeshFindings& findings) {
    Mesh mesh;
    std::vector<ObjCorner> vertices;
    const auto vertex_of_corner = vertices_of_corners(obj, vertices);
    const bool texcoords_in_step = in_step(obj, obj.texcoords.size(), &ObjCorner::texcoord);
    const bool normals_in_step = in_step(obj, obj.normals.size(), &ObjCorner::normal);
    const auto uses = [&](std::uint32_t ObjCorner::*attribute) {
        return std::any_of(obj.corners.begin(), obj.corners.end(),
                           [&](const ObjCorner& c) { return c.*attribute != no_index; });
    };
    const bool has_texcoords = !obj.texcoords.empty() && (texcoords_in_step || uses(&ObjCorner::texcoord));
    const bool has_normals = !obj.normals.empty() && (normals_in_step || uses(&ObjCorner::normal));
    for (std::size_t v = 0; v < vertices.size(); ++v) {
        ObjCorner& vertex = vertices[v];
        if (vertex.position == no_index) {
            vertex.position = static_cast<std::uint32_t>(v);
            if (texcoords_in_step) vertex.texcoord = vertex.position;
            if (normals_in_step) vertex.normal = vertex.position;
        }
        mesh.positions.push_back(obj.positions[vertex.position]);
        if (has_texcoords)
            mesh.texcoords.push_back(vertex.texcoord == no_index ? Vector2f{} : obj.texcoords[vertex.texcoord]);
        if (has_normals) mesh.normals.push_back(vertex.normal == no_index ? Vector3f{} : obj.normals[vertex.normal]);
    }
    give_colours(obj, vertices, options, mesh, findings);
    give_triangles(obj, vertex_of_corner, mesh, findings);
    return mesh;
}

}  // namespace

Result<Mesh> read_obj(std::string_view text, const MeshReadOptions& options, MeshFindings* findings) {
    MeshFindings found;
    auto obj = read_obj_text(text, options, found);
    if (!obj) return tl::unexpected(obj.error());
    found.texture = std::move(obj->texture);
    Mesh mesh = mesh_of(*obj, options, found);
    if (auto ok = leave_out_not_finite(mesh, found); !ok) return tl::unexpected(ok.error());
    if (findings) *findings = std::move(found);
    return mesh;
}

}  // namespace htvm
