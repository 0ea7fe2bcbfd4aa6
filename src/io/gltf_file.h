// What a glTF file holds, opened with care: its JSON, its buffers and its images. Nothing that the file says about
// sizes and places is believed. The numbers in buffers: gltf_accessor.h.
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
#include "io/mesh_reading.h"
#include "io/texture_reference.h"

namespace htvm::internal {

struct GltfFile {
    nlohmann::json root;
    std::span<const std::uint8_t> binary;                      // of a .glb: the chunk with the first buffer; lent
    std::filesystem::path folder;                              // of buffers in files of their own; empty: none are read
    std::map<std::string, std::vector<std::uint8_t>> buffers;  // that were read, by URI
};

// The error of a file that is damaged or not what it should be.
tl::unexpected<Error> gltf_not_readable(const std::string& why);

// The parts of a .glb, or the text of a .gltf file, of version 2. Lengths that a .glb gives for all of it, and what
// lies behind its chunks, are passed over, as readers in browsers do. The bytes must outlive the file. Errors:
// bad_input, unsupported, limit.
Result<GltfFile> open_gltf(std::span<const std::uint8_t> bytes, const std::filesystem::path& folder);

// Fails (unsupported) if the file requires an extension that is not read; tells of used ones that are not known here.
Result<void> check_gltf_extensions(const nlohmann::json& root, MeshFindings* findings);

// The member of exactly that name, as "_COLOR_0" is not COLOR_0; nullptr if it is not there or null.
const nlohmann::json* gltf_member(const nlohmann::json& object, const char* name);

// The object of an extension, nullptr if there is none.
const nlohmann::json* gltf_extension(const nlohmann::json& object, const char* name);

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

// A finite number that an object has, or `otherwise`.
Result<double> gltf_real(const nlohmann::json& object, const char* name, double otherwise);

// What a .glb file and its chunks begin with.
inline constexpr std::uint32_t glb_magic = 0x46546c67, glb_json_chunk = 0x4e4f534a, glb_binary_chunk = 0x004e4942;

// A piece of a buffer.
struct GltfView {
    std::span<const std::uint8_t> bytes;  // as long as the file lives
    std::optional<std::uint64_t> stride = {};
};
// Opens a view of numbers or of an image, and reads the buffer that it needs. Errors: bad_input, limit, unsupported
// where the view is compressed (EXT_meshopt_compression) and the file has no plain one beside it.
Result<GltfView> open_gltf_view(GltfFile& file, std::uint64_t index);

// The image of that number: inside of the file, or its name from the folder, which is not looked for here. The name of
// one inside that no reader here takes says what it is. Errors: bad_input, limit.
Result<TextureReference::Image> gltf_image_at(GltfFile& file, std::uint64_t index);

}  // namespace htvm::internal
