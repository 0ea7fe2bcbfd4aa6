#include "io/gltf_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>

#include "core/bytes.h"
#include "io/mesh_check.h"
#include "io/mesh_file.h"
#include "io/skeleton_json_value.h"

namespace htvm::internal {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::uint64_t most_json_bytes = std::uint64_t{1} << 27;
constexpr std::uint64_t most_buffer_bytes = std::uint64_t{1} << 32;  // of all buffers of a file

tl::unexpected<Error> not_readable(const std::string& why) {
    return fail(ErrorKind::bad_input, "the glTF cannot be read: " + why);
}

// ---- The container --------------------------------------------------------------------------------------------------

struct Parts {
    std::string_view json;
    std::span<const std::uint8_t> binary;
};

Result<Parts> parts_of_glb(std::span<const std::uint8_t> bytes) {
    ByteReader header(bytes);
    header.u32();
    const auto version = header.u32();
    const std::uint64_t length = header.u32();
    if (header.ok() && version != 2)
        return fail(ErrorKind::unsupported, "the .glb is of version " + std::to_string(version) + ", not 2");
    if (!header.ok() || length > bytes.size() || length < header.position()) return not_readable("it is cut off");
    ByteReader chunks(bytes.first(static_cast<std::size_t>(length)).subspan(header.position()));
    Parts parts;
    for (bool first = true; chunks.remaining() >= 8; first = false) {
        const auto size = chunks.u32();
        const auto type = chunks.u32();
        const auto content = chunks.bytes(size);
        if (!chunks.ok()) return not_readable("a chunk of the .glb is cut off");
        if (first != (type == glb_json_chunk)) return not_readable("the .glb does not begin with its only JSON chunk");
        if (first) parts.json = {reinterpret_cast<const char*>(content.data()), content.size()};
        if (type == glb_binary_chunk && parts.binary.empty()) parts.binary = content;
    }
    return parts;
}

// Extensions that may be required: they change nothing that is read here, or are understood.
bool is_harmless(const std::string& extension) {
    for (const std::string_view begin : {"KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_"})
        if (extension.starts_with(begin)) return true;
    return extension == "KHR_mesh_quantization" || extension == "KHR_node_visibility";
}

Result<void> check_version(const json& root) {
    const auto* asset = find_member(root, "asset");
    const auto* version = asset ? find_member(*asset, "version") : nullptr;
    if (!version || !version->is_string()) return not_readable("it does not say its version");
    const auto& text = version->get_ref<const std::string&>();
    if (!text.starts_with("2."))
        return fail(ErrorKind::unsupported, "the glTF is of version " + text.substr(0, 20) + ", not 2");
    const auto* required = find_member(root, "extensionsRequired");
    if (!required || !required->is_array()) return {};
    for (const auto& extension : *required) {
        const auto name = extension.is_string() ? extension.get<std::string>() : std::string();
        if (!is_harmless(name))
            return fail(ErrorKind::unsupported, "the glTF needs the extension \"" + name.substr(0, 60) +
                                                    "\", which is not read; export it without (for Draco: without "
                                                    "compression)");
    }
    return {};
}

// ---- Buffers --------------------------------------------------------------------------------------------------------

std::optional<std::vector<std::uint8_t>> decoded_base64(std::string_view text) {
    while (text.ends_with('=')) text.remove_suffix(1);
    std::vector<std::uint8_t> out;
    out.reserve(text.size() / 4 * 3 + 2);
    std::uint32_t bits = 0;
    int count = 0;
    for (const char c : text) {
        std::uint32_t six = 0;
        if (c >= 'A' && c <= 'Z')
            six = static_cast<std::uint32_t>(c - 'A');
        else if (c >= 'a' && c <= 'z')
            six = static_cast<std::uint32_t>(c - 'a') + 26;
        else if (c >= '0' && c <= '9')
            six = static_cast<std::uint32_t>(c - '0') + 52;
        else if (c == '+' || c == '/')
            six = c == '+' ? 62 : 63;
        else
            return std::nullopt;
        bits = bits << 6 | six;
        count += 6;
        if (count < 8) continue;
        count -= 8;
        out.push_back(static_cast<std::uint8_t>(bits >> count));
    }
    return out;
}

std::optional<std::string> decoded_percents(std::string_view text) {
    std::string out;
    const auto digit = [](char c) {
        return c >= '0' && c <= '9'   ? c - '0'
               : c >= 'a' && c <= 'f' ? c - 'a' + 10
               : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                      : -1;
    };
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] != '%') {
            out += text[i];
            continue;
        }
        const int high = i + 2 < text.size() ? digit(text[i + 1]) : -1;
        const int low = high >= 0 ? digit(text[i + 2]) : -1;
        if (low < 0) return std::nullopt;
        out += static_cast<char>(high * 16 + low);
        i += 2;
    }
    return out;
}

// The file that a URI names, if it lies in the folder or below it.
Result<fs::path> file_in(const fs::path& folder, const std::string& uri) {
    const auto refused = [&](const std::string& why) {
        return not_readable("its buffer \"" + uri.substr(0, 100) + "\" " + why);
    };
    const auto name = decoded_percents(uri);
    if (!name || name->empty() || name->find('\0') != name->npos) return refused("has no name that can be read");
    if (name->find(':') != name->npos || name->starts_with('/') || name->find('\\') != name->npos)
        return refused("is not in its folder; only buffers there are read");
    if (folder.empty()) return refused("is a file of its own, which is not read here");
    std::error_code error;
    const auto inside = fs::canonical(folder, error);
    const auto path = error ? fs::path() : fs::canonical(folder / *name, error);
    if (error || !fs::is_regular_file(path, error)) return refused("is not there");
    if (std::mismatch(inside.begin(), inside.end(), path.begin(), path.end()).first != inside.end())
        return refused("is not in its folder; only buffers there are read");
    return path;
}

// What a data: URI holds.
Result<std::vector<std::uint8_t>> content_of(const std::string& uri, const char* what) {
    const auto comma = uri.find(";base64,");
    auto content = comma == uri.npos ? std::nullopt : decoded_base64(std::string_view(uri).substr(comma + 8));
    if (!content) return not_readable(std::string(what) + " inside of it is not Base64");
    return std::move(*content);
}

Result<std::vector<std::uint8_t>> read_buffer(const GltfFile& file, const std::string& uri) {
    std::uint64_t taken = 0;
    for (const auto& [name, content] : file.buffers) taken += content.size();
    if (uri.starts_with("data:")) return content_of(uri, "a buffer");
    const auto path = file_in(file.folder, uri);
    if (!path) return tl::unexpected(path.error());
    return read_file(*path, most_buffer_bytes - std::min(taken, most_buffer_bytes));
}

Result<std::span<const std::uint8_t>> open_buffer(GltfFile& file, std::uint64_t index) {
    const auto buffer = gltf_item(file, "buffers", index);
    if (!buffer) return tl::unexpected(buffer.error());
    const auto length = gltf_number(**buffer, "byteLength", 0);
    if (!length) return tl::unexpected(length.error());
    std::span<const std::uint8_t> content;
    const auto* uri = find_member(**buffer, "uri");
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
    return content.first(static_cast<std::size_t>(*length));
}

// ---- Accessors ------------------------------------------------------------------------------------------------------

// 0: no component type of glTF.
std::size_t bytes_of(std::uint64_t component) {
    switch (component) {
        case static_cast<std::uint64_t>(GltfComponent::i8):
        case static_cast<std::uint64_t>(GltfComponent::u8):
            return 1;
        case static_cast<std::uint64_t>(GltfComponent::i16):
        case static_cast<std::uint64_t>(GltfComponent::u16):
            return 2;
        case static_cast<std::uint64_t>(GltfComponent::u32):
        case static_cast<std::uint64_t>(GltfComponent::f32):
            return 4;
        default:
            return 0;
    }
}

// 0: a type that is not read here.
std::size_t components_of(const json& accessor) {
    const auto* type = find_member(accessor, "type");
    if (!type || !type->is_string()) return 0;
    const auto& name = type->get_ref<const std::string&>();
    if (name == "SCALAR") return 1;
    const bool vector = name.size() == 4 && name.starts_with("VEC") && name[3] >= '2' && name[3] <= '4';
    return vector ? static_cast<std::size_t>(name[3] - '0') : 0;
}

template <class T>
T loaded(const std::uint8_t* at) {
    T out;
    std::memcpy(&out, at, sizeof out);
    return out;
}

struct View {
    std::span<const std::uint8_t> bytes;
    std::optional<std::uint64_t> stride = {};
};

// Opens a view of numbers or of an image; nothing if it goes beyond its buffer.
Result<std::optional<View>> open_view(GltfFile& file, std::uint64_t index) {
    const auto view = gltf_item(file, "bufferViews", index);
    if (!view) return tl::unexpected(view.error());
    const auto buffer_index = gltf_number(**view, "buffer", 0);
    const auto offset = gltf_number(**view, "byteOffset", 0);
    const auto length = gltf_number(**view, "byteLength", 0);
    const auto stride = gltf_index(**view, "byteStride");
    for (const auto* number : {&buffer_index, &offset, &length})
        if (!*number) return tl::unexpected(number->error());
    if (!stride) return tl::unexpected(stride.error());
    const auto buffer = open_buffer(file, *buffer_index);
    if (!buffer) return tl::unexpected(buffer.error());
    if (*offset > buffer->size() || *length > buffer->size() - *offset) return std::optional<View>();
    return std::optional(
        View{buffer->subspan(static_cast<std::size_t>(*offset), static_cast<std::size_t>(*length)), *stride});
}

}  // namespace

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
    const auto* items = find_member(file.root, list);
    if (!items || !items->is_array() || index >= items->size() ||
        !(*items)[static_cast<std::size_t>(index)].is_object())
        return not_readable("it refers to number " + std::to_string(index) + " of its " + list +
                            ", which is not there");
    return &(*items)[static_cast<std::size_t>(index)];
}

Result<std::uint64_t> gltf_number(const json& object, const char* name, std::uint64_t otherwise) {
    const auto* member = find_member(object, name);
    if (!member) return otherwise;
    if (!member->is_number_unsigned())
        return not_readable(std::string("a \"") + name + "\" is no whole number from 0 on");
    return member->get<std::uint64_t>();
}

Result<std::optional<std::uint64_t>> gltf_index(const json& object, const char* name) {
    if (!find_member(object, name)) return std::optional<std::uint64_t>();
    const auto number = gltf_number(object, name, 0);
    if (!number) return tl::unexpected(number.error());
    return std::optional(*number);
}

template <std::size_t N>
Result<std::array<double, N>> gltf_numbers(const json& object, const char* name,
                                           const std::array<double, N>& otherwise) {
    const auto* member = find_member(object, name);
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
template Result<std::array<double, 1>> gltf_numbers(const json&, const char*, const std::array<double, 1>&);
template Result<std::array<double, 2>> gltf_numbers(const json&, const char*, const std::array<double, 2>&);
template Result<std::array<double, 3>> gltf_numbers(const json&, const char*, const std::array<double, 3>&);
template Result<std::array<double, 4>> gltf_numbers(const json&, const char*, const std::array<double, 4>&);
template Result<std::array<double, 16>> gltf_numbers(const json&, const char*, const std::array<double, 16>&);

double GltfAccessor::number(std::uint64_t row, std::size_t column) const {
    const auto share = [this](double value, double most) { return normalised ? std::max(value / most, -1.0) : value; };
    const auto* at = bytes.data() + row * stride;
    switch (component) {
        case GltfComponent::i8:
            return share(loaded<std::int8_t>(at + column), 127);
        case GltfComponent::u8:
            return share(at[column], 255);
        case GltfComponent::i16:
            return share(loaded<std::int16_t>(at + 2 * column), 32767);
        case GltfComponent::u16:
            return share(loaded<std::uint16_t>(at + 2 * column), 65535);
        case GltfComponent::u32:
            return share(loaded<std::uint32_t>(at + 4 * column), 4294967295.0);
        case GltfComponent::f32:
            break;
    }
    return static_cast<double>(loaded<float>(at + 4 * column));
}

std::uint32_t GltfAccessor::whole(std::uint64_t row) const {
    const auto* at = bytes.data() + row * stride;
    if (component == GltfComponent::u8) return *at;
    return component == GltfComponent::u16 ? loaded<std::uint16_t>(at) : loaded<std::uint32_t>(at);
}

Result<TextureReference::Image> gltf_image_at(GltfFile& file, std::uint64_t index) {
    const auto image = gltf_item(file, "images", index);
    if (!image) return tl::unexpected(image.error());
    TextureReference::Image out;
    out.name = "image " + std::to_string(index) + " of the glTF";
    if (const auto* uri = find_member(**image, "uri")) {
        if (!uri->is_string()) return not_readable("the URI of an image is no text");
        const auto& text = uri->get_ref<const std::string&>();
        if (text.starts_with("data:")) {
            auto content = content_of(text, "an image");
            if (!content) return tl::unexpected(content.error());
            out.bytes = std::move(*content);
            return out;
        }
        const auto name = decoded_percents(text);
        if (!name || name->empty() || name->find('\0') != name->npos)
            return not_readable("its image \"" + text.substr(0, 100) + "\" has no name that can be read");
        out.name = *name;
        return out;
    }
    const auto view_index = gltf_index(**image, "bufferView");
    if (!view_index) return tl::unexpected(view_index.error());
    if (!*view_index) return not_readable(out.name + " has neither a URI nor a place in a buffer");
    const auto view = open_view(file, **view_index);
    if (!view) return tl::unexpected(view.error());
    if (!*view || (*view)->bytes.empty()) return not_readable(out.name + " is empty or goes beyond its buffer");
    out.bytes.assign((*view)->bytes.begin(), (*view)->bytes.end());
    return out;
}

Result<GltfAccessor> open_accessor(GltfFile& file, std::uint64_t index) {
    const auto item = gltf_item(file, "accessors", index);
    if (!item) return tl::unexpected(item.error());
    const json& json_of = **item;
    const auto wrong = [&](const std::string& why) {
        return not_readable("accessor " + std::to_string(index) + " " + why);
    };
    if (find_member(json_of, "sparse"))
        return fail(ErrorKind::unsupported,
                    "accessor " + std::to_string(index) + " of the glTF is sparse, which is not read");
    const auto view_index = gltf_index(json_of, "bufferView");
    const auto offset = gltf_number(json_of, "byteOffset", 0);
    const auto component = gltf_number(json_of, "componentType", 0);
    const auto count = gltf_number(json_of, "count", 0);
    if (!view_index) return tl::unexpected(view_index.error());
    for (const auto* number : {&offset, &component, &count})
        if (!*number) return tl::unexpected(number->error());
    GltfAccessor out;
    out.components = components_of(json_of);
    const auto row = bytes_of(*component) * out.components;
    if (row == 0) return wrong("is of a type that is not read here");
    if (!*view_index) return wrong("has no values");
    out.component = static_cast<GltfComponent>(*component);
    out.count = *count;
    const auto* normalised = find_member(json_of, "normalized");
    out.normalised = normalised && normalised->is_boolean() && normalised->get<bool>();

    const auto view = open_view(file, **view_index);
    if (!view) return tl::unexpected(view.error());
    if (!*view) return wrong("lies in a view that goes beyond its buffer");
    const auto& [bytes, given_stride] = **view;
    const std::uint64_t stride = given_stride.value_or(row);
    if (stride < row || stride > 252) return wrong("has rows that overlap or lie too far apart");
    out.stride = static_cast<std::size_t>(stride);
    const auto room = *offset > bytes.size() ? 0 : bytes.size() - *offset;
    if (out.count > 0 && (room < row || (out.count - 1) > (room - row) / stride)) return wrong("goes beyond its view");
    out.bytes = bytes.subspan(static_cast<std::size_t>(room > 0 ? *offset : 0));
    return out;
}

}  // namespace htvm::internal
