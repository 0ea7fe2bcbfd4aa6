// The materials of OBJ files (.mtl), as far as a mesh's texture and colours go.
//
// Nothing is an error: what is not understood is passed over. Lines end in LF, CR LF or CR, and go on behind a
// backslash; keywords are taken in either case; a byte-order mark is passed over.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "htvm/mesh.hpp"

namespace htvm {

struct ObjMaterial {
    std::string name;  // the rest of newmtl's line, which may hold blanks and '#'
    // What map_Kd says, without its options; else map_Ka, else map_Ke. As in the file but for backslashes, which become
    // slashes. Empty: it has none.
    std::string image;
    bool is_substitute = false;    // the image is map_Ka's or map_Ke's
    bool is_placed = false;        // options scale, move or shake the image's coordinates, which is not done here
    std::optional<Colour> colour;  // Kd: its levels as they stand, 0..1 for 0..255
};

// In the order of the file.
std::vector<ObjMaterial> read_obj_materials(std::string_view text);

// The material of that name: the first, by its very letters, else in either case; null if there is none.
const ObjMaterial* find_material(const std::vector<ObjMaterial>& materials, std::string_view name);

// The names on a line of mtllib, which is its whole rest: as the programs that write them mean it, a single name with
// blanks in it, or several names. Each element is one way to read the line, the likeliest first: one name; names that
// end in .mtl or stand in quotes; words.
std::vector<std::vector<std::string>> material_file_names(std::string_view line);

}  // namespace htvm
