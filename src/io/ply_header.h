// The header of a PLY file: which elements and properties follow, and how they are stored.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "htvm/result.hpp"

namespace htvm {

enum class PlyFormat { ascii, binary_little_endian, binary_big_endian };

enum class PlyType { i8, u8, i16, u16, i32, u32, f32, f64 };

struct PlyProperty {
    std::string name;
    PlyType type = PlyType::f32;       // of the value, or of a list's items
    bool is_list = false;              //
    PlyType count_type = PlyType::u8;  // of a list's length; an integer type
};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0;  // as claimed by the header, not to be trusted
    std::vector<PlyProperty> properties;
};

struct PlyHeader {
    PlyFormat format = PlyFormat::ascii;
    std::vector<PlyElement> elements;
    std::string timestamp;  // what stands behind "comment timestamp"; empty: nothing does
    std::string texture;    // what stands behind "comment TextureFile", likewise
    std::string fps;        // what stands behind "comment fps", likewise
};

// The longest header, from "ply" to "end_header", that a reader accepts, in bytes.
inline constexpr std::size_t most_ply_header_bytes = std::size_t{1} << 20;

// The most elements that a header may declare.
inline constexpr std::size_t most_ply_elements = 256;

// The bytes of one value in a binary file: 1, 2, 4 or 8.
std::size_t ply_type_size(PlyType type);

// The fewest bytes that one element of this kind takes in the file; 0 for an element without properties. A list may be
// empty; in text a value takes a digit and a separator (which the last value in the file may lack).
std::uint64_t fewest_element_bytes(const PlyElement& element, PlyFormat format);

// Parses one line of the header, without its line ending, into the header read so far. Returns true for "end_header".
// Fails (bad_input, unsupported) with a sentence that quotes the line. The first line, "ply", must not be passed.
Result<bool> read_ply_header_line(PlyHeader& header, std::string_view line);

}  // namespace htvm
