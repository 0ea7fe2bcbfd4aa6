#include "io/ply_faces.h"

#include <algorithm>
#include <optional>
#include <string_view>

#include "io/ply_vertices.h"

namespace htvm {

namespace {

tl::unexpected<Error> bad_index(std::string_view element, std::uint64_t face, std::uint64_t vertex_count) {
    return fail(ErrorKind::bad_input, std::string(element) + " " + std::to_string(face) +
                                          " uses a vertex index that is not one of 0 to " +
                                          std::to_string(vertex_count) + " - 1");
}

tl::unexpected<Error> too_many_triangles(const PlyFaceLimits& limits) {
    return tl::unexpected(check_count(limits.most_triangles + 1, limits.most_triangles, "triangles or more").error());
}

// A vertex index as a whole number below vertex_count; nothing if it is not one.
std::optional<std::uint32_t> as_index(double value, std::uint64_t vertex_count) {
    if (!(value >= 0 && value < static_cast<double>(vertex_count))) return std::nullopt;
    const auto index = static_cast<std::uint32_t>(value);
    if (static_cast<double>(index) != value) return std::nullopt;
    return index;
}

bool is_one_of(std::string_view name, std::initializer_list<std::string_view> names) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

// The meaning of a face's property. Of each meaning there is one at most.
enum class FaceField { ignored, corners, texcoords, colour_list, texture, red, green, blue };

struct FaceLayout {
    std::vector<FaceField> fields;  // of each property
    std::size_t corners = 0;        // which property
    bool has_corners = false;
    bool has_texcoords = false;
    bool has_colours = false;
    bool has_texture = false;
    std::array<PlyType, 3> colour_type{};
};

FaceLayout layout_of(const PlyElement& face) {
    FaceLayout layout;
    layout.fields.assign(face.properties.size(), FaceField::ignored);
    for (const auto& names : ply_colour_names) {
        const auto red = ply_scalar_named(face, names[0]), green = ply_scalar_named(face, names[1]),
                   blue = ply_scalar_named(face, names[2]);
        if (layout.has_colours || !red || !green || !blue) continue;
        layout.fields[*red] = FaceField::red;
        layout.fields[*green] = FaceField::green;
        layout.fields[*blue] = FaceField::blue;
        layout.has_colours = true;
        layout.colour_type = {face.properties[*red].type, face.properties[*green].type, face.properties[*blue].type};
    }
    for (std::size_t p = 0; p < face.properties.size(); ++p) {
        const auto& [name, type, is_list, count_type] = face.properties[p];
        const auto take = [&](bool& is_taken, bool is_it, FaceField field) {
            if (!is_taken && is_it) layout.fields[p] = field;
            is_taken = is_taken || is_it;
        };
        if (!is_list) {
            take(layout.has_texture, is_one_of(name, {"texnumber", "texture_number", "texindex", "texture_index"}),
                 FaceField::texture);
            continue;
        }
        const bool is_colours = !layout.has_colours && is_ply_colour_list(face.properties[p]);
        if (is_colours) layout.colour_type = {type, type, type};
        take(layout.has_colours, is_colours, FaceField::colour_list);
        take(layout.has_texcoords, is_one_of(name, {"texcoord", "texcoords", "texture_coordinates", "texture_coords"}),
             FaceField::texcoords);
        const bool is_corners =
            is_one_of(name, {"vertex_indices", "vertex_index", "vertex_indexes", "vertexindices", "indices"});
        if (is_corners && !layout.has_corners) layout.corners = p;
        take(layout.has_corners, is_corners, FaceField::corners);
    }
    return layout;
}

// One face. Kept from one to the next for its memory.
struct Face {
    std::vector<std::uint32_t> corners;
    std::vector<float> texcoords;  // two for each corner
    std::vector<float> colours;    // three or four for each corner, or for all of them
    double texture = 0;
};

enum class ReadFace { done, ended, bad_index, too_many };

ReadFace read_corners(PlyBody& body, const PlyProperty& list, const PlyFaceLimits& limits, std::size_t triangles,
                      std::vector<std::uint32_t>& corners) {
    const auto length = read_list_length(body, list);
    if (!length) return ReadFace::ended;
    for (std::uint64_t c = 0; c < *length; ++c) {
        const auto value = read_value(body, list.type);
        if (!value) return ReadFace::ended;
        const auto index = as_index(*value, limits.vertices);
        if (!index) return ReadFace::bad_index;
        corners.push_back(*index);
        if (corners.size() > 2 && corners.size() - 2 + triangles > limits.most_triangles) return ReadFace::too_many;
    }
    return ReadFace::done;
}

bool read_floats(PlyBody& body, const PlyProperty& list, bool is_colour, std::vector<float>& out) {
    const auto length = read_list_length(body, list);
    if (!length) return false;
    for (std::uint64_t i = 0; i < *length; ++i) {
        const auto value = read_value(body, list.type);
        if (!value) return false;
        out.push_back(finite_or_zero(is_colour ? ply_colour_value(*value, list.type) : *value));
    }
    return true;
}

ReadFace read_face(PlyBody& body, const PlyElement& element, const FaceLayout& layout, const PlyFaceLimits& limits,
                   std::size_t triangles, Face& face) {
    face.corners.clear();
    face.texcoords.clear();
    face.colours.clear();
    std::array<float, 3> colour{};
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        bool is_read = true;
        switch (const FaceField field = layout.fields[p]; field) {
            case FaceField::ignored:
                is_read = skip_property(body, property);
                break;
            case FaceField::corners:
                if (const auto read = read_corners(body, property, limits, triangles, face.corners);
                    read != ReadFace::done)
                    return read;
                break;
            case FaceField::texcoords:
                is_read = read_floats(body, property, false, face.texcoords);
                break;
            case FaceField::colour_list:
                is_read = read_floats(body, property, true, face.colours);
                break;
            case FaceField::texture:
            case FaceField::red:
            case FaceField::green:
            case FaceField::blue:
                const auto value = read_value(body, property.type);
                is_read = value.has_value();
                if (!is_read) break;
                if (field == FaceField::texture) {
                    face.texture = *value;
                } else {
                    colour[static_cast<std::size_t>(field) - static_cast<std::size_t>(FaceField::red)] =
                        finite_or_zero(ply_colour_value(*value, property.type));
                }
        }
        if (!is_read) return ReadFace::ended;
    }
    if (layout.has_colours && face.colours.empty()) face.colours.assign(colour.begin(), colour.end());
    return ReadFace::done;
}

Vector2f texcoord_of(const Face& face, std::size_t corner) {
    if (face.texcoords.size() < 2 * face.corners.size()) return {};
    return {face.texcoords[2 * corner], face.texcoords[2 * corner + 1]};
}

Vector3f colour_of(const Face& face, std::size_t corner) {
    const std::size_t corners = face.corners.size(), numbers = face.colours.size();
    const bool is_each = numbers == 3 * corners || numbers == 4 * corners;
    const std::size_t at = is_each ? corner * (numbers / corners) : 0;
    if (at + 3 > numbers) return {};
    return {face.colours[at], face.colours[at + 1], face.colours[at + 2]};
}

void append_face(const Face& face, const FaceLayout& layout, Mesh& mesh, PlyFaces& faces) {
    if (face.corners.size() < 3) return;
    const std::size_t first = mesh.triangles.size(), count = face.corners.size() - 2;
    if (count > 1) faces.fans.push_back({static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(count)});
    // A face without coordinates does not give them to the others.
    const bool has_texcoords = layout.has_texcoords && (!face.texcoords.empty() || !faces.texcoords.empty());
    if (has_texcoords) faces.texcoords.resize(first);
    for (std::size_t c = 1; c <= count; ++c) {
        const std::array<std::size_t, 3> of{0, c, c + 1};
        mesh.triangles.push_back({face.corners[0], face.corners[c], face.corners[c + 1]});
        if (has_texcoords)
            faces.texcoords.push_back({texcoord_of(face, of[0]), texcoord_of(face, of[1]), texcoord_of(face, of[2])});
        if (layout.has_colours)
            faces.colours.push_back({colour_of(face, of[0]), colour_of(face, of[1]), colour_of(face, of[2])});
        const bool is_texture = face.texture >= 0 && face.texture < static_cast<double>(most_ply_textures);
        if (layout.has_texture) faces.textures.push_back(is_texture ? static_cast<std::int32_t>(face.texture) : -1);
    }
}

// Takes the usual faces, only a triangle each with 32-bit indices, in a fraction of the time: some of those that
// follow. Returns how many, none if the next face is of another kind, which read_face handles.
std::uint64_t read_plain_triangles(PlyBody& body, const PlyElement& element, std::uint64_t faces,
                                   const PlyFaceLimits& limits, Mesh& mesh) {
    constexpr std::size_t bytes = 1 + 3 * 4;
    constexpr std::uint64_t at_once = 256;  // few, as room for those that are not taken is made again and again
    const PlyProperty& list = element.properties[0];
    const bool plain = body.format == PlyFormat::binary_little_endian && element.properties.size() == 1 &&
                       ply_type_size(list.count_type) == 1 && (list.type == PlyType::u32 || list.type == PlyType::i32);
    const std::size_t before = mesh.triangles.size();
    if (!plain || before >= limits.most_triangles) return 0;
    if (!body.source.ensure(1) || *body.source.cursor() != 3 || !body.source.ensure(bytes)) return 0;
    const std::uint64_t most = std::min(limits.vertices, std::uint64_t{1} << 31);  // an int32 above would be negative
    const auto at_hand = static_cast<std::size_t>(
        std::min<std::uint64_t>({faces, at_once, body.source.buffered() / bytes, limits.most_triangles - before}));
    mesh.triangles.resize(before + at_hand);
    const std::uint8_t* face = body.source.cursor();
    std::size_t taken = 0;
    for (; taken < at_hand && *face == 3; ++taken, face += bytes) {
        Triangle triangle{};
        for (std::size_t c = 0; c < 3; ++c)
            triangle[c] = static_cast<std::uint32_t>(load_bits<4>(face + 1 + 4 * c, false));
        if (triangle[0] >= most || triangle[1] >= most || triangle[2] >= most) break;
        mesh.triangles[before + taken] = triangle;
    }
    mesh.triangles.resize(before + taken);
    body.source.advance(taken * bytes);
    return taken;
}

// The triangles of one list of strips.
ReadFace read_strips(PlyBody& body, const PlyProperty& list, const PlyFaceLimits& limits, Mesh& mesh) {
    const auto length = read_list_length(body, list);
    if (!length) return ReadFace::ended;
    const std::size_t size = ply_type_size(list.type);
    const double all_ones = size < 8 ? static_cast<double>((std::uint64_t{1} << (8 * size)) - 1) : 0x1p64;
    Triangle last{};
    std::uint64_t in_strip = 0;
    for (std::uint64_t c = 0; c < *length; ++c) {
        const auto value = read_value(body, list.type);
        if (!value) return ReadFace::ended;
        const auto index = as_index(*value, limits.vertices);
        if (!index && *value != -1 && *value != all_ones) return ReadFace::bad_index;
        in_strip = index ? in_strip + 1 : 0;
        if (!index) continue;
        last = {last[1], last[2], *index};
        if (in_strip < 3 || last[0] == last[1] || last[1] == last[2] || last[0] == last[2]) continue;
        if (mesh.triangles.size() >= limits.most_triangles) return ReadFace::too_many;
        mesh.triangles.push_back(in_strip % 2 == 1 ? last : Triangle{last[1], last[0], last[2]});
    }
    return ReadFace::done;
}

tl::unexpected<Error> error_of(ReadFace read, const PlyElement& element, std::uint64_t index,
                               const PlyFaceLimits& limits) {
    if (read == ReadFace::bad_index) return bad_index(element.name, index, limits.vertices);
    if (read == ReadFace::too_many) return too_many_triangles(limits);
    return ends_within(element, index);
}

tl::unexpected<Error> no_corners(const PlyElement& element) {
    return fail(ErrorKind::bad_input,
                "the PLY header declares no list vertex_indices for the element \"" + element.name + "\"");
}

}  // namespace

Result<void> read_ply_faces(PlyBody& body, const PlyElement& element, const PlyFaceLimits& limits, Mesh& mesh,
                            PlyFaces& faces) {
    const FaceLayout layout = layout_of(element);
    if (!layout.has_corners && element.count > 0) return no_corners(element);
    const std::uint64_t fewest = fewest_element_bytes(element, body.format);
    mesh.triangles.reserve(mesh.triangles.size() + reservation(body, element.count, fewest + 3));
    for (std::size_t c = 0; c < 3; ++c) faces.colour_numbers[c] = ply_colour_numbers(layout.colour_type[c]);
    // Triangles of strips that came first have none of what faces say.
    if (layout.has_colours) faces.colours.resize(mesh.triangles.size());
    if (layout.has_texture) faces.textures.resize(mesh.triangles.size());
    Face face;
    for (std::uint64_t f = 0; f < element.count; ++f) {
        fetch_ahead(body, fewest, element.count - f);
        if (const auto taken =
                layout.corners == 0 ? read_plain_triangles(body, element, element.count - f, limits, mesh) : 0) {
            f += taken - 1;
            continue;
        }
        const auto read = read_face(body, element, layout, limits, mesh.triangles.size(), face);
        if (read != ReadFace::done) return error_of(read, element, f, limits);
        append_face(face, layout, mesh, faces);
    }
    return {};
}

Result<void> read_ply_strips(PlyBody& body, const PlyElement& element, const PlyFaceLimits& limits, Mesh& mesh) {
    const FaceLayout layout = layout_of(element);
    if (!layout.has_corners && element.count > 0) return no_corners(element);
    const std::uint64_t fewest = fewest_element_bytes(element, body.format);
    for (std::uint64_t i = 0; i < element.count; ++i) {
        fetch_ahead(body, fewest, element.count - i);
        for (std::size_t p = 0; p < element.properties.size(); ++p) {
            const auto& property = element.properties[p];
            const bool is_corners = layout.fields[p] == FaceField::corners;
            const auto read = is_corners                      ? read_strips(body, property, limits, mesh)
                              : skip_property(body, property) ? ReadFace::done
                                                              : ReadFace::ended;
            if (read != ReadFace::done) return error_of(read, element, i, limits);
        }
    }
    return {};
}

}  // namespace htvm
