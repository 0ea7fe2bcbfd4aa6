// The values behind the header of a PLY file.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "htvm/result.hpp"
#include "io/ply_header.h"
#include "io/ply_source.h"

namespace htvm {

struct PlyBody {
    PlySource& source;
    PlyFormat format;
    bool took_words = false;  // words of a text body were taken, so the rest of the last line must be skipped
};

template <std::size_t size>
std::uint64_t load_bits(const std::uint8_t* bytes, bool big_endian) {
    std::uint64_t bits = 0;
    if (big_endian) {
        for (std::size_t i = 0; i < size; ++i) bits |= static_cast<std::uint64_t>(bytes[i]) << (8 * (size - 1 - i));
    } else {
        for (std::size_t i = 0; i < size; ++i) bits |= static_cast<std::uint64_t>(bytes[i]) << (8 * i);
    }
    return bits;
}

// A value of a binary file.
inline double decode_value(const std::uint8_t* bytes, PlyType type, bool big_endian) {
    switch (type) {
        case PlyType::i8:
            return static_cast<std::int8_t>(*bytes);
        case PlyType::u8:
            return *bytes;
        case PlyType::i16:
            return static_cast<std::int16_t>(load_bits<2>(bytes, big_endian));
        case PlyType::u16:
            return static_cast<std::uint16_t>(load_bits<2>(bytes, big_endian));
        case PlyType::i32:
            return static_cast<std::int32_t>(load_bits<4>(bytes, big_endian));
        case PlyType::u32:
            return static_cast<std::uint32_t>(load_bits<4>(bytes, big_endian));
        case PlyType::i64:
            return static_cast<double>(static_cast<std::int64_t>(load_bits<8>(bytes, big_endian)));
        case PlyType::u64:
            return static_cast<double>(load_bits<8>(bytes, big_endian));
        case PlyType::f32:
            return static_cast<double>(
                std::bit_cast<float>(static_cast<std::uint32_t>(load_bits<4>(bytes, big_endian))));
        case PlyType::f64:
            break;
    }
    return std::bit_cast<double>(load_bits<8>(bytes, big_endian));
}

// The next value; nothing if the bytes end or, in text, if the next word is not a number. Comments in text are passed
// over.
std::optional<double> read_value(PlyBody& body, PlyType type);

// The length of a list; nothing if it is missing, negative or malformed.
std::optional<std::uint64_t> read_list_length(PlyBody& body, const PlyProperty& list);

// False if the bytes end or cannot be read.
bool skip_property(PlyBody& body, const PlyProperty& property);

// Makes a stream fetch data in pieces rather than value by value, but never more than the least that the remaining
// elements take.
void fetch_ahead(PlyBody& body, std::uint64_t element_bytes, std::uint64_t elements_left);

// Skips what is left of a text's last line, so that what follows begins on its own line.
void skip_rest_of_line(PlyBody& body, char line_end);

// Fails if the element claims more than the available bytes can hold.
Result<void> check_element_count(const PlyBody& body, const PlyElement& element);

// How much to reserve for a count that was checked against the available bytes, or (for a stream) was not.
std::size_t reservation(const PlyBody& body, std::uint64_t count, std::uint64_t bytes_each);

// The error of bytes that end, or are none of what is expected, in this one of the element's.
tl::unexpected<Error> ends_within(const PlyElement& element, std::uint64_t index);

}  // namespace htvm
