// What a glTF file holds, opened with care: its JSON, its buffers, and the numbers in them. Nothing that the file says
// about sizes and places is believed.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "htvm/result.hpp"
#include "io/texture_reference.h"

namespace htvm::internal {

struct GltfFile {
    nlohmann::json root;
    std::span<const std::uint8_t> binary;                      // of a .glb: the chunk with the first buffer; lent
    std::filesystem::path folder;                              // of buffers in files of their own; empty: none are read
    std::map<std::string, std::vector<std::uint8_t>> buffers;  // that were read, by URI
};

// The parts of a .glb, or the text of a .gltf file; of version 2, and without required extensions that change what is
// read here. The bytes must outlive the file. Errors: bad_input, unsupported, limit.
Result<GltfFile> open_gltf(std::span<const std::uint8_t> bytes, const std::filesystem::path& folder);

// The entry of a list of the file, such as "nodes"; bad_input if there is none or it is no object.
Result<const nlohmann::json*> gltf_item(const GltfFile& file, const char* list, std::uint64_t index);

// A whole number from 0 on that an object has, or `otherwise`; bad_input if it is something else.
Result<std::uint64_t> gltf_number(const nlohmann::json& object, const char* name, std::uint64_t otherwise);
// The same for indices: nothing where there is none.
Result<std::optional<std::uint64_t>> gltf_index(const nlohmann::json& object, const char* name);

// Numbers that an object has, exactly `N` of them and finite, or `otherwise`.
template <std::size_t N>
Result<std::array<double, N>> gltf_numbers(const nlohmann::json& object, const char* name,
                                           const std::array<double, N>& otherwise);

// What a .glb file and its chunks begin with.
inline constexpr std::uint32_t glb_magic = 0x46546c67, glb_json_chunk = 0x4e4f534a, glb_binary_chunk = 0x004e4942;

enum class GltfComponent : std::uint16_t {
    i8 = 5120,
    u8 = 5121,
    i16 = 5122,
    u16 = 5123,
    u32 = 5125,
    f32 = 5126,
};

// Rows of numbers in a buffer, all of which lie inside it.
struct GltfAccessor {
    std::span<const std::uint8_t> bytes;  // from the first row on
    std::uint64_t count = 0;              // rows
    std::size_t stride = 0;               // bytes from row to row
    std::size_t components = 0;           // numbers in a row: 1 to 4
    GltfComponent component = GltfComponent::f32;
    bool normalised = false;  // integers stand for 0..1 or -1..1
    double number(std::uint64_t row, std::size_t column) const;
    std::uint32_t whole(std::uint64_t row) const;  // the first number of an unsigned accessor, as it is
};

// The image of that number: inside of the file, or its name from the folder, which is not looked for here. Errors:
// bad_input, limit.
Result<TextureReference::Image> gltf_image_at(GltfFile& file, std::uint64_t index);

// Opens an accessor, and reads the buffer that it needs. Errors: bad_input, unsupported (sparse, matrices), limit.
Result<GltfAccessor> open_accessor(GltfFile& file, std::uint64_t index);

}  // namespace htvm::internal
