// The numbers in a glTF file's buffers.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "io/gltf_file.h"

namespace htvm::internal {

enum class GltfComponent : std::uint16_t {
    i8 = 5120,
    u8 = 5121,
    i16 = 5122,
    u16 = 5123,
    u32 = 5125,
    f32 = 5126,
};

// Rows of numbers, all of which are there.
struct GltfAccessor {
    std::span<const std::uint8_t> bytes;  // of a buffer, from the first row on; empty: all are zero
    std::uint64_t count = 0;              // rows
    std::size_t stride = 0;               // bytes from row to row
    std::size_t components = 0;           // numbers in a row: 1 to 4, or 16 of a matrix
    GltfComponent component = GltfComponent::f32;
    bool normalised = false;  // integers stand for 0..1 or -1..1

    // Rows that a sparse accessor replaces, ascending, and where each stands among the replacing ones.
    std::vector<std::pair<std::uint64_t, std::uint32_t>> replaced = {};
    std::span<const std::uint8_t> replacing = {};
    // Numbers that lie in no buffer, as decoded, row by row; in the place of all others.
    std::shared_ptr<const std::vector<double>> decoded = {};

    double number(std::uint64_t row, std::size_t column) const;
    std::uint32_t whole(std::uint64_t row) const;  // the first number of an unsigned accessor, as it is
};

// Opens an accessor, and reads the buffers that it needs. An accessor without any has zeros, as many as it says: its
// count is to be checked before it is used. Errors: bad_input, unsupported, limit.
Result<GltfAccessor> open_accessor(GltfFile& file, std::uint64_t index);

}  // namespace htvm::internal
