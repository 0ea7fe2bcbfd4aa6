#include "io/mesh_file.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "core/edit_distance.h"
#include "core/letter_case.h"
#include "io/drc.h"
#include "io/gltf.h"
#include "io/obj.h"
#include "io/output_file.h"
#include "io/ply.h"

namespace htvm {

namespace {

enum class MeshFormat { ply, obj, drc, glb, gltf };

std::optional<MeshFormat> format_of(const std::filesystem::path& path) {
    const std::string extension = internal::lower_case(path.extension().string());
    if (extension == ".ply") return MeshFormat::ply;
    if (extension == ".obj") return MeshFormat::obj;
    if (extension == ".drc") return MeshFormat::drc;
    if (extension == ".glb") return MeshFormat::glb;
    if (extension == ".gltf") return MeshFormat::gltf;
    return std::nullopt;
}

tl::unexpected<Error> fail_at(const std::filesystem::path& path, ErrorKind kind, const std::string& message) {
    return fail(kind, path.string() + ": " + message);
}

tl::unexpected<Error> fail_at(const std::filesystem::path& path, const Error& error) {
    return fail_at(path, error.kind, error.message);
}

Result<Mesh> parse(MeshFormat format, const std::vector<std::uint8_t>& bytes, const std::filesystem::path& path,
                   const MeshReadOptions& options, MeshFindings* findings) {
    switch (format) {
        case MeshFormat::ply:
            return read_ply(bytes, options, findings);
        case MeshFormat::obj:
            return read_obj(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()), options,
                            findings);
        case MeshFormat::glb:
        case MeshFormat::gltf:
            return read_gltf(bytes, path.has_parent_path() ? path.parent_path() : ".", options, findings);
        case MeshFormat::drc:
            break;
    }
    return read_drc(bytes, options, findings);
}

}  // namespace

bool is_mesh_file_name(const std::filesystem::path& path) { return format_of(path).has_value(); }

bool is_written_mesh_file_name(const std::filesystem::path& path) {
    const auto format = format_of(path);
    return format == MeshFormat::ply || format == MeshFormat::obj || format == MeshFormat::glb;
}

Result<std::vector<std::uint8_t>> read_file(const std::filesystem::path& path, std::uint64_t most_bytes) {
    std::error_code error;
    const auto status = std::filesystem::status(path, error);
    if (!std::filesystem::exists(status)) return fail_at(path, ErrorKind::bad_input, "there is no such file");
    if (std::filesystem::is_directory(status))
        return fail_at(path, ErrorKind::bad_input, "this is a folder, not a file");
    std::ifstream file(path, std::ios::binary);
    if (!file) return fail_at(path, ErrorKind::bad_input, "cannot be opened for reading; see its permissions");
    constexpr std::size_t piece = 1 << 16;
    std::vector<std::uint8_t> bytes;
    const std::uintmax_t size = std::filesystem::file_size(path, error);  // only a hint: a pipe has none
    const auto expected = error || size > most_bytes ? std::size_t{0} : static_cast<std::size_t>(size);
    bytes.reserve(expected + piece);
    for (std::size_t got = 0; file; bytes.resize(got)) {
        bytes.resize(got < expected ? expected : got + piece);
        file.read(reinterpret_cast<char*>(bytes.data() + got), static_cast<std::streamsize>(bytes.size() - got));
        got += static_cast<std::size_t>(file.gcount());
        if (got > most_bytes)
            return fail_at(path, ErrorKind::limit, "is larger than " + std::to_string(most_bytes) + " bytes");
    }
    if (file.bad()) return fail_at(path, ErrorKind::bad_input, "could not be read to its end");
    return bytes;
}

Result<void> scale_positions(Mesh& mesh, double factor) {
    if (!(factor > 0) || !std::isfinite(factor)) {
        return fail(ErrorKind::bad_input, "the scale of the positions must be a finite number above 0");
    }
    if (factor == 1) return {};
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        for (float& c : mesh.positions[v]) {
            const double scaled = static_cast<double>(c) * factor;
            if (!fits_float(scaled)) {
                return fail(ErrorKind::bad_input, "the position of vertex " + std::to_string(v) +
                                                      " is too large once scaled; check the unit");
            }
            c = static_cast<float>(scaled);
        }
    }
    return {};
}

std::string timestamp_in_file(const std::filesystem::path& path) {
    if (format_of(path) != MeshFormat::ply) return {};
    std::ifstream file(path, std::ios::binary);
    if (!file) return {};
    return read_ply_timestamp(file).value_or(std::string());
}

Result<Mesh> read_mesh(const std::filesystem::path& path, const MeshFileOptions& options, MeshFindings* findings) {
    const auto format = format_of(path);
    if (!format) {
        const auto ending = internal::lower_case(path.extension().string());
        return fail_at(path, ErrorKind::unsupported,
                       ending == ".htvm" ? "it is no mesh but a stream, which is to be decoded first"
                                         : "the name ends in none of " + std::string(mesh_file_extensions) +
                                               ", the formats that are read");
    }
    const auto bytes = read_file(path);
    if (!bytes) return tl::unexpected(bytes.error());
    auto mesh = parse(*format, *bytes, path, options.reading, findings);
    if (!mesh) return fail_at(path, mesh.error());
    if (auto ok = scale_positions(*mesh, options.millimetres_per_unit); !ok) return fail_at(path, ok.error());
    return mesh;
}

Result<void> write_mesh(const std::filesystem::path& path, const Mesh& mesh, const MeshFileOptions& options) {
    const auto format = format_of(path);
    if (!is_written_mesh_file_name(path)) {
        return fail_at(path, ErrorKind::unsupported,
                       "the name must end in .ply, .obj or .glb, the formats that are written");
    }
    if (!(options.millimetres_per_unit > 0)) {
        return fail_at(path, ErrorKind::bad_input, "the millimetres per unit must be above 0");
    }
    Mesh scaled;
    const Mesh* written = &mesh;
    if (options.millimetres_per_unit != 1) {
        scaled = mesh;
        if (auto ok = scale_positions(scaled, 1 / options.millimetres_per_unit); !ok) return fail_at(path, ok.error());
        written = &scaled;
    }
    const auto origin = in_units(options.global_shift, options.millimetres_per_unit);
    if (*format != MeshFormat::obj) {
        const auto bytes = *format == MeshFormat::ply
                               ? write_ply(*written, options.timestamp, options.texture, {}, origin)
                               : write_gltf(*written, options.image, origin);
        if (!bytes) return fail_at(path, bytes.error());
        return write_file(path, *bytes);
    }
    auto material = path;
    if (!options.texture.empty()) {
        material.replace_extension(".mtl");
        if (auto ok = write_file(material, write_obj_material(options.texture)); !ok) return ok;
    }
    const auto text =
        write_obj(*written, options.texture.empty() ? std::string() : material.filename().string(), origin);
    if (!text) return fail_at(path, text.error());
    return write_file(path, *text);
}

std::array<double, 3> in_units(const GlobalShift& shift, double millimetres_per_unit) {
    std::array<double, 3> out{};
    for (std::size_t c = 0; c < 3; ++c) out[c] = static_cast<double>(shift[c]) / millimetres_per_unit;
    return out;
}

Result<LengthUnit> length_unit(std::string_view symbol) {
    std::string symbols;
    for (const auto& unit : length_units) {
        if (symbol == unit.symbol) return unit.unit;
        symbols += (symbols.empty() ? "" : ", ") + std::string(unit.symbol);
    }
    const auto meant = meant_unit(symbol);
    return fail(ErrorKind::bad_input, "the unit '" + std::string(symbol) + "' is not one of " + symbols +
                                          (meant.empty() ? "" : "; did you mean " + meant + "?"));
}

std::string meant_unit(std::string_view typed) {
    const auto word = internal::lower_case(typed.substr(0, 100));
    std::vector<std::string> symbols, names;
    for (const auto& unit : length_units) {
        symbols.emplace_back(unit.symbol);
        names.emplace_back(unit.name);
    }
    // "meter" is as near to "metres" as a mistyped word may be.
    const auto name = std::ranges::find(names, internal::meant_word(word, names));
    if (word.size() > 3 && name != names.end()) return symbols[static_cast<std::size_t>(name - names.begin())];
    return internal::meant_word(word, symbols);
}

std::optional<SpaceBounds> surface_bounds(const Mesh& mesh) {
    std::optional<SpaceBounds> out;
    const auto add = [&out](const Vector3f& p) {
        if (!out) out = SpaceBounds{p, p};
        for (std::size_t c = 0; c < 3; ++c) {
            out->low[c] = std::min(out->low[c], p[c]);
            out->high[c] = std::max(out->high[c], p[c]);
        }
    };
    for (const auto& triangle : mesh.triangles)
        for (const auto v : triangle) add(mesh.positions[v]);
    if (mesh.triangles.empty())
        for (const auto& p : mesh.positions) add(p);
    return out;
}

LengthUnit guess_unit(const Mesh& mesh) {
    double squared = 0;
    const auto bounds = surface_bounds(mesh);
    for (std::size_t axis = 0; axis < 3 && bounds; ++axis) {
        const double extent = static_cast<double>(bounds->high[axis]) - static_cast<double>(bounds->low[axis]);
        squared += extent * extent;
    }
    const double diagonal = std::sqrt(squared);
    if (!(diagonal > 0) || diagonal >= 600) return LengthUnit::millimetre;
    return diagonal < 10 ? LengthUnit::metre : LengthUnit::centimetre;
}

std::optional<LengthUnit> unit_of_format(const std::filesystem::path& path) {
    const auto format = format_of(path);
    if (format == MeshFormat::glb || format == MeshFormat::gltf) return LengthUnit::metre;
    return std::nullopt;
}

bool counts_texture_from_top(const std::filesystem::path& path) {
    const auto format = format_of(path);
    return format == MeshFormat::glb || format == MeshFormat::gltf;
}

LengthUnit likely_unit(const std::filesystem::path& path, const Mesh& mesh) {
    return unit_of_format(path).value_or(guess_unit(mesh));
}

}  // namespace htvm
