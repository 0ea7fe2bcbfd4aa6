#include "io/gltf_file.h"

#include <algorithm>
#include <string_view>

#include "core/bytes.h"
#include "io/gltf_uri.h"
#include "io/mesh_check.h"
#include "io/mesh_file.h"
#include "io/named_file.h"
#include "io/skeleton_json_value.h"

namespace htvm::internal {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::uint64_t most_json_bytes = std::uint64_t{1} << 27;
constexpr std::uint64_t most_buffer_bytes = std::uint64_t{1} << 32;  // of all buffers of a file

tl::unexpected<Error> not_readable(const std::string& why) { return gltf_not_readable(why); }

// ---- The container --------------------------------------------------------------------------------------------------

struct Parts {
    std::string_view json;
    std::span<const std::uint8_t> binary;
};

// The text of a JSON chunk, which some programs fill up with zeros.
std::string_view text_of(std::span<const std::uint8_t> chunk) {
    std::string_view text(reinterpret_cast<const char*>(chunk.data()), chunk.size());
    while (text.ends_with('\0')) text.remove_suffix(1);
    return text;
}

// The chunks say how long they are, and are believed as far as the file goes: what is missing of the binary one is
// found out where it is needed.
Result<Parts> parts_of_glb(std::span<const std::uint8_t> bytes) {
    ByteReader chunks(bytes);
    chunks.u32();
    const auto version = chunks.u32();
    chunks.u32();  // the length of all
    if (!chunks.ok()) return not_readable("it is cut off");
    if (version != 2)
        return fail(ErrorKind::unsupported, "the .glb is of version " + std::to_string(version) + ", not 2");
    Parts parts;
    while (chunks.remaining() >= 8 && (parts.json.empty() || parts.binary.empty())) {
        const auto size = chunks.u32();
        const auto type = chunks.u32();
        const auto content = chunks.bytes(std::min<std::size_t>(size, chunks.remaining()));
        if (type == glb_json_chunk && content.size() < size) return not_readable("its JSON is cut off");
        if (type == glb_json_chunk && parts.json.empty()) parts.json = text_of(content);
        if (type == glb_binary_chunk && parts.binary.empty()) parts.binary = content;
    }
    if (parts.json.empty()) return not_readable("the .glb has no JSON in it");
    return parts;
}

// "2.1" may be read by those who know 2.0, unless the file says otherwise.
Result<void> check_version(const json& root) {
    const auto* asset = gltf_member(root, "asset");
    const auto* version = asset ? gltf_member(*asset, "version") : nullptr;
    if (!version || !version->is_string()) return not_readable("it does not say its version");
    const auto* least = gltf_member(*asset, "minVersion");
    const auto& text = (least && least->is_string() ? least : version)->get_ref<const std::string&>();
    const bool is_read =
        least && least->is_string() ? text == "2.0" || text == "2" : text.starts_with("2.") || text == "2";
    if (is_read) return {};
    return fail(ErrorKind::unsupported, "the glTF is of version " + text.substr(0, 20) + ", not 2");
}

// ---- Buffers --------------------------------------------------------------------------------------------------------

// The file that a URI names, if it lies in the folder or below it.
Result<fs::path> file_in(const fs::path& folder, const std::string& uri) {
    const auto refused = [&](const std::string& why) {
        return not_readable("its buffer \"" + uri.substr(0, 100) + "\" " + why);
    };
    if (folder.empty()) return refused("is a file of its own, which is not read here");
    const auto name = name_in_uri(uri, folder);
    if (!name || name->starts_with('/')) return refused("is not in its folder; only buffers there are read");
    const auto path = folder / *name;
    const auto place = named_place(folder, path);
    if (place == NamedPlace::nowhere) return refused("is not there");
    if (place == NamedPlace::outside) return refused("is not in its folder; only buffers there are read");
    return path;
}

Result<std::vector<std::uint8_t>> read_buffer(const GltfFile& file, const std::string& uri) {
    std::uint64_t taken = 0;
    for (const auto& [name, content] : file.buffers) taken += content.size();
    if (is_data_uri(uri)) {
        auto content = content_of_data_uri(uri);
        if (!content) return not_readable("a buffer inside of it is not Base64");
        return std::move(*content);
    }
    const auto path = file_in(file.folder, uri);
    if (!path) return tl::unexpected(path.error());
    return read_file(*path, most_buffer_bytes - std::min(taken, most_buffer_bytes));
}

// All that there is of a buffer, which is no less than its length.
Result<std::span<const std::uint8_t>> open_buffer(GltfFile& file, std::uint64_t index) {
    const auto buffer = gltf_item(file, "buffers", index);
    if (!buffer) return tl::unexpected(buffer.error());
    const auto length = gltf_number(**buffer, "byteLength", 0);
    if (!length) return tl::unexpected(length.error());
    std::span<const std::uint8_t> content;
    const auto* uri = gltf_member(**buffer, "uri");
    if (!uri) {
        if (index > 0) return not_readable("buffer " + std::to_string(index) + " has no URI");
        content = file.binary;
    } else {
        if (!uri->is_string()) return not_readable("the URI of a buffer is no text");
        const auto& name = uri->get_ref<const std::string&>();
        if (!file.buffers.contains(name)) {
            auto read = read_buffer(file, name);
            if (!read) return tl::unexpected(read.error());
            file.buffers.emplace(name, std::move(*read));
        }
        content = file.buffers.at(name);
    }
    if (*length > content.size())
        return not_readable("buffer " + std::to_string(index) + " has " + std::to_string(content.size()) +
                            " bytes of " + std::to_string(*length));
    return content;
}

// Whether an extension that compresses a view has left the plain bytes out.
bool is_plain_left_out(const json& buffer, bool is_binary_chunk) {
    for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression"})
        if (const auto* extension = gltf_extension(buffer, name)) {
            const auto* fallback = gltf_member(*extension, "fallback");
            if (fallback && fallback->is_boolean() && fallback->get<bool>()) return true;
        }
    return !gltf_member(buffer, "uri") && !is_binary_chunk;
}

Result<void> check_compression(const GltfFile& file, const json& view, std::uint64_t buffer_index) {
    for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression"}) {
        if (!gltf_extension(view, name)) continue;
        const auto buffer = gltf_item(file, "buffers", buffer_index);
        if (!buffer) return tl::unexpected(buffer.error());
        if (is_plain_left_out(**buffer, buffer_index == 0 && !file.binary.empty()))
            return fail(ErrorKind::unsupported, std::string("the glTF is compressed by ") + name +
                                                    ", which is not read; write it without (gltfpack without -c, "
                                                    "gltf-transform copy)");
    }
    return {};
}

// What an image inside of the file is, if it is of a kind that no reader here takes; else nothing.
std::string_view unread_kind(std::span<const std::uint8_t> bytes) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (text.starts_with("\xABKTX")) return "KTX2 with Basis (KHR_texture_basisu)";
    if (text.size() > 12 && text.substr(4, 7) == "ftypavi") return "AVIF (EXT_texture_avif)";
    return {};
}

}  // namespace

tl::unexpected<Error> gltf_not_readable(const std::string& why) {
    return fail(ErrorKind::bad_input, "the glTF cannot be read: " + why);
}

const json* gltf_member(const json& object, const char* name) {
    if (!object.is_object()) return nullptr;
    const auto found = object.find(name);
    return found == object.end() || found->is_null() ? nullptr : &*found;
}

Result<GltfFile> open_gltf(std::span<const std::uint8_t> bytes, const fs::path& folder) {
    Parts parts{{reinterpret_cast<const char*>(bytes.data()), bytes.size()}, {}};
    if (ByteReader(bytes).u32() == glb_magic) {
        const auto found = parts_of_glb(bytes);
        if (!found) return tl::unexpected(found.error());
        parts = *found;
    }
    if (auto ok = check_count(parts.json.size(), most_json_bytes, "bytes of JSON"); !ok)
        return tl::unexpected(ok.error());
    auto root = parse_json(parts.json);
    if (!root) return tl::unexpected(root.error());
    if (auto ok = check_version(*root); !ok) return tl::unexpected(ok.error());
    return GltfFile{std::move(*root), parts.binary, folder, {}};
}

Result<const json*> gltf_item(const GltfFile& file, const char* list, std::uint64_t index) {
    const auto* items = gltf_member(file.root, list);
    if (!items || !items->is_array() || index >= items->size() ||
        !(*items)[static_cast<std::size_t>(index)].is_object())
        return not_readable("it refers to number " + std::to_string(index) + " of its " + list +
                            ", which is not there");
    return &(*items)[static_cast<std::size_t>(index)];
}

Result<std::uint64_t> gltf_number(const json& object, const char* name, std::uint64_t otherwise) {
    const auto* member = gltf_member(object, name);
    if (!member) return otherwise;
    if (!member->is_number_unsigned())
        return not_readable(std::string("a \"") + name + "\" is no whole number from 0 on");
    return member->get<std::uint64_t>();
}

Result<std::optional<std::uint64_t>> gltf_index(const json& object, const char* name) {
    if (!gltf_member(object, name)) return std::optional<std::uint64_t>();
    const auto number = gltf_number(object, name, 0);
    if (!number) return tl::unexpected(number.error());
    return std::optional(*number);
}

template <std::size_t N>
Result<std::array<double, N>> gltf_numbers(const json& object, const char* name,
                                           const std::array<double, N>& otherwise) {
    const auto* member = gltf_member(object, name);
    if (!member) return otherwise;
    std::array<double, N> out{};
    bool fits = member->is_array() && member->size() == N;
    for (std::size_t i = 0; fits && i < N; ++i) {
        const auto number = finite_number((*member)[i]);
        fits = number.has_value();
        if (fits) out[i] = *number;
    }
    if (!fits)
        return not_readable(std::string("a \"") + name + "\" is not a list of " + std::to_string(N) + " numbers");
    return out;
}
template Result<std::array<double, 2>> gltf_numbers(const json&, const char*, const std::array<double, 2>&);
template Result<std::array<double, 3>> gltf_numbers(const json&, const char*, const std::array<double, 3>&);
template Result<std::array<double, 4>> gltf_numbers(const json&, const char*, const std::array<double, 4>&);
template Result<std::array<double, 16>> gltf_numbers(const json&, const char*, const std::array<double, 16>&);

Result<double> gltf_real(const json& object, const char* name, double otherwise) {
    const auto* member = gltf_member(object, name);
    if (!member) return otherwise;
    const auto number = finite_number(*member);
    if (!number) return not_readable(std::string("a \"") + name + "\" is no number");
    return *number;
}

Result<GltfView> open_gltf_view(GltfFile& file, std::uint64_t index) {
    const auto view = gltf_item(file, "bufferViews", index);
    if (!view) return tl::unexpected(view.error());
    const auto buffer_index = gltf_number(**view, "buffer", 0);
    const auto offset = gltf_number(**view, "byteOffset", 0);
    const auto length = gltf_number(**view, "byteLength", 0);
    const auto stride = gltf_index(**view, "byteStride");
    for (const auto* number : {&buffer_index, &offset, &length})
        if (!*number) return tl::unexpected(number->error());
    if (!stride) return tl::unexpected(stride.error());
    if (auto ok = check_compression(file, **view, *buffer_index); !ok) return tl::unexpected(ok.error());
    const auto buffer = open_buffer(file, *buffer_index);
    if (!buffer) return tl::unexpected(buffer.error());
    if (*offset > buffer->size() || *length > buffer->size() - *offset)
        return not_readable("view " + std::to_string(index) + " goes beyond its buffer");
    return GltfView{buffer->subspan(static_cast<std::size_t>(*offset), static_cast<std::size_t>(*length)), *stride};
}

Result<TextureReference::Image> gltf_image_at(GltfFile& file, std::uint64_t index) {
    const auto image = gltf_item(file, "images", index);
    if (!image) return tl::unexpected(image.error());
    TextureReference::Image out;
    out.name = "image " + std::to_string(index) + " of the glTF";
    if (const auto* uri = gltf_member(**image, "uri")) {
        if (!uri->is_string()) return not_readable("the URI of an image is no text");
        const auto& text = uri->get_ref<const std::string&>();
        if (!is_data_uri(text)) {
            // A name that leads elsewhere is looked for by its last part.
            auto name = name_in_uri(text, file.folder);
            if (!name) name = name_in_uri(text.substr(text.find_last_of("/\\:") + 1), file.folder);
            if (!name) return not_readable("its image \"" + text.substr(0, 100) + "\" has no name that can be read");
            out.name = *name;
            return out;
        }
        auto content = content_of_data_uri(text);
        if (!content) return not_readable("an image inside of it is not Base64");
        out.bytes = std::move(*content);
    } else {
        const auto view_index = gltf_index(**image, "bufferView");
        if (!view_index) return tl::unexpected(view_index.error());
        if (!*view_index) return not_readable(out.name + " has neither a URI nor a place in a buffer");
        const auto view = open_gltf_view(file, **view_index);
        if (!view) return tl::unexpected(view.error());
        out.bytes.assign(view->bytes.begin(), view->bytes.end());
    }
    if (out.bytes.empty()) return not_readable(out.name + " is empty");
    if (const auto kind = unread_kind(out.bytes); !kind.empty())
        out.name += ", which is " + std::string(kind) + " and not read: write the file with PNG, JPEG or WebP images";
    return out;
}

}  // namespace htvm::internal
