// The header of a PLY file: which elements and properties follow, and how they are stored.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "htvm/result.hpp"
#include "io/ply_source.h"

namespace htvm {

enum class PlyFormat { ascii, binary_little_endian, binary_big_endian };

enum class PlyType { i8, u8, i16, u16, i32, u32, i64, u64, f32, f64 };

struct PlyProperty {
    std::string name;                  // in lower case
    PlyType type = PlyType::f32;       // of the value, or of a list's items
    bool is_list = false;              //
    PlyType count_type = PlyType::u8;  // of a list's length; an integer type
};

struct PlyElement {
    std::string name;         // in lower case
    std::uint64_t count = 0;  // as claimed by the header, not to be trusted
    std::vector<PlyProperty> properties;
};

struct PlyHeader {
    PlyFormat format = PlyFormat::ascii;
    char line_end = '\n';  // the last character of a line
    std::vector<PlyElement> elements;
    std::string timestamp;              // what stands behind "comment timestamp"; empty: nothing does
    std::string fps;                    // what stands behind "comment fps", likewise
    std::vector<std::string> textures;  // what stands behind each "comment TextureFile", or "obj_info TextureFile"
};

// The longest header, from "ply" to "end_header", that a reader accepts, in bytes.
inline constexpr std::size_t most_ply_header_bytes = std::size_t{1} << 20;

// The most elements, and images of textures, that a header may declare.
inline constexpr std::size_t most_ply_elements = 256;
inline constexpr std::size_t most_ply_textures = 4096;

// The bytes of one value in a binary file: 1, 2, 4 or 8.
std::size_t ply_type_size(PlyType type);
bool is_ply_integer(PlyType type);

// The fewest bytes that one element of this kind takes in the file; 0 for an element without properties. A list may be
// empty; in text a value takes a digit and a separator (which the last value in the file may lack).
std::uint64_t fewest_element_bytes(const PlyElement& element, PlyFormat format);

// Whether a PLY begins here, behind what may stand before it.
bool is_ply(PlySource& source);

// Reads a header, from "ply" to the end of the line "end_header", with what may stand before it. Keywords and names are
// taken in either case. What ends the first line (LF, CR LF, CR or LF CR) ends the last one too, behind which binary
// data begin. Within an element, a line that begins with a type declares a property though it lacks that word. Errors:
// bad_input, limit and unsupported, with a sentence that quotes the line.
Result<PlyHeader> read_ply_header(PlySource& source);

}  // namespace htvm
