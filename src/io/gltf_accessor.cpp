#include "io/gltf_accessor.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>

namespace htvm::internal {
namespace {

using nlohmann::json;

tl::unexpected<Error> not_readable(std::uint64_t accessor, const std::string& why) {
    return gltf_not_readable("accessor " + std::to_string(accessor) + " " + why);
}

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
    const auto* type = gltf_member(accessor, "type");
    if (!type || !type->is_string()) return 0;
    const auto& name = type->get_ref<const std::string&>();
    if (name == "SCALAR") return 1;
    if (name == "MAT4") return 16;
    const bool vector = name.size() == 4 && name.starts_with("VEC") && name[3] >= '2' && name[3] <= '4';
    return vector ? static_cast<std::size_t>(name[3] - '0') : 0;
}

template <class T>
T loaded(const std::uint8_t* at) {
    T out;
    std::memcpy(&out, at, sizeof out);
    return out;
}

double loaded_number(GltfComponent component, const std::uint8_t* row, std::size_t column) {
    switch (component) {
        case GltfComponent::i8:
            return loaded<std::int8_t>(row + column);
        case GltfComponent::u8:
            return row[column];
        case GltfComponent::i16:
            return loaded<std::int16_t>(row + 2 * column);
        case GltfComponent::u16:
            return loaded<std::uint16_t>(row + 2 * column);
        case GltfComponent::u32:
            return loaded<std::uint32_t>(row + 4 * column);
        case GltfComponent::f32:
            break;
    }
    return static_cast<double>(loaded<float>(row + 4 * column));
}

// What an integer is divided by to be a share.
double most_of(GltfComponent component) {
    switch (component) {
        case GltfComponent::i8:
            return 127;
        case GltfComponent::u8:
            return 255;
        case GltfComponent::i16:
            return 32767;
        case GltfComponent::u16:
            return 65535;
        case GltfComponent::u32:
            return 4294967295.0;
        case GltfComponent::f32:
            break;
    }
    return 1;
}

std::uint32_t loaded_whole(GltfComponent component, const std::uint8_t* row) {
    if (component == GltfComponent::u8) return *row;
    return component == GltfComponent::u16 ? loaded<std::uint16_t>(row) : loaded<std::uint32_t>(row);
}

// Where a row's bytes are; nullptr: it is zero.
const std::uint8_t* row_of(const GltfAccessor& accessor, std::uint64_t row) {
    if (!accessor.replaced.empty()) {
        const auto at = std::lower_bound(accessor.replaced.begin(), accessor.replaced.end(), std::pair(row, 0u));
        if (at != accessor.replaced.end() && at->first == row)
            return accessor.replacing.data() +
                   at->second * accessor.components * bytes_of(static_cast<std::uint64_t>(accessor.component));
    }
    return accessor.bytes.empty() ? nullptr : accessor.bytes.data() + row * accessor.stride;
}

// `count` rows of a view, from an offset on.
Result<GltfView> rows_in(GltfFile& file, std::uint64_t accessor, std::uint64_t view_index, std::uint64_t offset,
                         std::uint64_t count, std::size_t row) {
    const auto view = open_gltf_view(file, view_index);
    if (!view) return tl::unexpected(view.error());
    const std::uint64_t stride = view->stride.value_or(row);
    if (stride < row || stride > 252) return not_readable(accessor, "has rows that overlap or lie too far apart");
    const auto room = offset > view->bytes.size() ? 0 : view->bytes.size() - offset;
    if (count > 0 && (room < row || (count - 1) > (room - row) / stride))
        return not_readable(accessor, "goes beyond its view");
    return GltfView{view->bytes.subspan(static_cast<std::size_t>(room > 0 ? offset : 0)), stride};
}

// The rows that a sparse accessor has instead of those of its view, or of zeros.
Result<void> add_sparse(GltfFile& file, std::uint64_t index, const json& sparse, std::size_t row, GltfAccessor& out) {
    const auto count = gltf_number(sparse, "count", 0);
    if (!count) return tl::unexpected(count.error());
    const auto *indices = gltf_member(sparse, "indices"), *values = gltf_member(sparse, "values");
    if (*count == 0) return {};
    if (!indices || !values) return not_readable(index, "is sparse without indices or values");
    const auto component = gltf_number(*indices, "componentType", 0);
    if (!component) return tl::unexpected(component.error());
    const auto index_bytes = bytes_of(*component);
    const auto type = static_cast<GltfComponent>(index_bytes > 0 ? *component : 0);
    if (type != GltfComponent::u8 && type != GltfComponent::u16 && type != GltfComponent::u32)
        return not_readable(index, "is sparse with indices that are no whole numbers");
    const auto rows_of = [&](const json& part, std::size_t part_row) -> Result<GltfView> {
        const auto view = gltf_index(part, "bufferView");
        const auto offset = gltf_number(part, "byteOffset", 0);
        if (!view) return tl::unexpected(view.error());
        if (!offset) return tl::unexpected(offset.error());
        if (!*view) return not_readable(index, "is sparse without values");
        return rows_in(file, index, **view, *offset, *count, part_row);
    };
    const auto places = rows_of(*indices, index_bytes);
    if (!places) return tl::unexpected(places.error());
    const auto replacing = rows_of(*values, row);
    if (!replacing) return tl::unexpected(replacing.error());
    if (*count > std::numeric_limits<std::uint32_t>::max() || *replacing->stride != row ||
        *places->stride != index_bytes)
        return not_readable(index, "is sparse with rows that do not lie side by side");
    out.replacing = replacing->bytes;
    for (std::uint32_t n = 0; n < *count; ++n) {
        const auto place = loaded_whole(type, places->bytes.data() + std::size_t{n} * index_bytes);
        if (place >= out.count) return not_readable(index, "replaces a row that is not there");
        out.replaced.emplace_back(place, n);
    }
    std::sort(out.replaced.begin(), out.replaced.end());
    // A row that is replaced twice is found where it is first.
    const auto same_row = [](const auto& a, const auto& b) { return a.first == b.first; };
    out.replaced.erase(std::unique(out.replaced.begin(), out.replaced.end(), same_row), out.replaced.end());
    return {};
}

}  // namespace

double GltfAccessor::number(std::uint64_t row, std::size_t column) const {
    double value = 0;
    if (decoded) {
        value = (*decoded)[static_cast<std::size_t>(row * components + column)];
    } else if (const auto* at = row_of(*this, row)) {
        value = loaded_number(component, at, column);
    }
    return normalised && component != GltfComponent::f32 ? std::max(value / most_of(component), -1.0) : value;
}

std::uint32_t GltfAccessor::whole(std::uint64_t row) const {
    const auto* at = row_of(*this, row);
    return at ? loaded_whole(component, at) : 0;
}

Result<GltfAccessor> open_accessor(GltfFile& file, std::uint64_t index) {
    const auto item = gltf_item(file, "accessors", index);
    if (!item) return tl::unexpected(item.error());
    const json& json_of = **item;
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
    if (row == 0) return not_readable(index, "is of a type that is not read here");
    out.component = static_cast<GltfComponent>(*component);
    out.count = *count;
    const auto* normalised = gltf_member(json_of, "normalized");
    out.normalised = normalised && normalised->is_boolean() && normalised->get<bool>();
    if (*view_index) {
        const auto rows = rows_in(file, index, **view_index, *offset, out.count, row);
        if (!rows) return tl::unexpected(rows.error());
        out.bytes = rows->bytes;
        out.stride = static_cast<std::size_t>(*rows->stride);
    }
    const auto* sparse = gltf_member(json_of, "sparse");
    if (sparse)
        if (auto ok = add_sparse(file, index, *sparse, row, out); !ok) return tl::unexpected(ok.error());
    return out;
}

}  // namespace htvm::internal
