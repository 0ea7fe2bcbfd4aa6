// Mesh files: the extension (.ply, .obj, .drc, .glb, .gltf, in either case) decides the format.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "htvm/mesh.hpp"
#include "htvm/result.hpp"
#include "htvm/scene.hpp"
#include "io/mesh_reading.h"

namespace htvm {

struct MeshFileOptions {
    double millimetres_per_unit = 1;  // for the file's coordinates: 1000 for a file in metres; finite, above 0
    MeshReadOptions reading;          // of a file that is read
    std::string timestamp;            // for the comment of a PLY file that is written (ply.h); empty: none
    std::string texture;         // of a PLY or OBJ file that is written, the name of its image; an OBJ's material then
                                 // goes to a file of the same name that ends in .mtl
    GlobalShift global_shift{};  // of a file that is written, mm: added to the positions, as doubles
    std::span<const std::uint8_t> image;  // of a .glb that is written, the file of its image: PNG or JPEG
};

// When a PLY file says that its frame was captured (ply.h); empty if it does not say, is no PLY or cannot be read.
std::string timestamp_in_file(const std::filesystem::path& path);

// Reads a mesh and scales its positions to millimetres. Every error message begins with the file's name. findings:
// takes what else was found; the image is read by texture_file.h.
Result<Mesh> read_mesh(const std::filesystem::path& path, const MeshFileOptions& options = {},
                       MeshFindings* findings = nullptr);

// Writes a mesh, with positions scaled from millimetres to the file's unit, replacing any file of that name. The folder
// must exist. Writing .drc and .gltf is unsupported. Every error message begins with the file's name.
Result<void> write_mesh(const std::filesystem::path& path, const Mesh& mesh, const MeshFileOptions& options = {});

// The extensions that read_mesh reads, for messages.
inline constexpr std::string_view mesh_file_extensions = ".ply, .obj, .drc, .glb, .gltf";
// True for these.
bool is_mesh_file_name(const std::filesystem::path& path);
// True for those that write_mesh writes: .ply, .obj, .glb.
bool is_written_mesh_file_name(const std::filesystem::path& path);

// The bytes of any file. Fails (bad_input) if it cannot be read, (limit) above most_bytes.
Result<std::vector<std::uint8_t>> read_file(const std::filesystem::path& path,
                                            std::uint64_t most_bytes = std::uint64_t{1} << 32);

// Multiplies the positions by `factor`. Fails (bad_input, naming the vertex) if one leaves the range of a float, and if
// the factor is not finite and above 0.
Result<void> scale_positions(Mesh& mesh, double factor);

enum class LengthUnit { millimetre, centimetre, decimetre, metre, inch, foot };

// The shift in a unit of so many millimetres.
std::array<double, 3> in_units(const GlobalShift& shift, double millimetres_per_unit);

struct LengthUnitNames {
    LengthUnit unit;
    const char* symbol;  // "mm"
    const char* name;    // "millimetres"
    double millimetres;
};
inline constexpr std::array length_units = {
    LengthUnitNames{LengthUnit::millimetre, "mm", "millimetres", 1},
    LengthUnitNames{LengthUnit::centimetre, "cm", "centimetres", 10},
    LengthUnitNames{LengthUnit::decimetre, "dm", "decimetres", 100},
    LengthUnitNames{LengthUnit::metre, "m", "metres", 1000},
    LengthUnitNames{LengthUnit::inch, "in", "inches", 25.4},
    LengthUnitNames{LengthUnit::foot, "ft", "feet", 304.8},
};

constexpr const LengthUnitNames& names_of(LengthUnit unit) { return length_units[static_cast<std::size_t>(unit)]; }
constexpr double millimetres_per(LengthUnit unit) { return names_of(unit).millimetres; }
// bad_input names the symbols that there are, and the one that was meant.
Result<LengthUnit> length_unit(std::string_view symbol);
// The symbol of the unit that somebody may mean who writes it otherwise: "m" for "meter" or "M". Empty: nobody knows.
std::string meant_unit(std::string_view typed);

// The box of the vertices that triangles use; of all where there are none. Scanners leave unused ones at the origin.
std::optional<SpaceBounds> surface_bounds(const Mesh& mesh);

// The unit that a mesh of a person is probably in, by the diagonal of its surface's bounding box: metres below 10,
// centimetres below 600, otherwise millimetres. A person's diagonal is 0.5 m (an infant) to 3 m (arms and legs spread),
// so the bounds are safe except for scenes above 6 m in cm. For a mesh without extent: mm.
LengthUnit guess_unit(const Mesh& mesh);

// The unit that the file's format prescribes, whatever the mesh looks like: metres for glTF; nothing for the others.
std::optional<LengthUnit> unit_of_format(const std::filesystem::path& path);
// That unit, or else the one that the file's mesh looks as if it were in.
LengthUnit likely_unit(const std::filesystem::path& path, const Mesh& mesh);

// Whether the format counts texture coordinates from the top of the image, as glTF does; what is read from all formats
// is counted from the bottom.
bool counts_texture_from_top(const std::filesystem::path& path);

}  // namespace htvm
