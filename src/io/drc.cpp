#include "io/drc.h"

#include <draco/compression/decode.h>
#include <draco/metadata/geometry_metadata.h>
#include <draco/metadata/metadata_decoder.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <string>

#include "core/bytes.h"

namespace htvm {

using namespace internal;

namespace {

tl::unexpected<Error> not_readable(const std::string& why) {
    return fail(ErrorKind::bad_input, "the Draco file cannot be read: " + why);
}

struct DracoCounts {
    std::uint64_t faces = 0;
    std::uint64_t points = 0;  // at least, for a mesh; attribute seams add more
};

// The counts that libdraco is going to allocate for, read from the beginning of the file: "DRACO", version, type and
// method, flags; metadata if the flags say so; counts.
Result<DracoCounts> claimed_counts(std::span<const std::uint8_t> bytes) {
    constexpr std::size_t header_bytes = 11;
    if (bytes.size() < header_bytes || !std::equal(bytes.begin(), bytes.begin() + 5, "DRACO")) {
        return not_readable("it does not begin with \"DRACO\"");
    }
    const int version = bytes[5] * 256 + bytes[6];
    if (version < 2 * 256 + 2) {
        return fail(ErrorKind::unsupported, "the Draco file is of bitstream version " + std::to_string(bytes[5]) + "." +
                                                std::to_string(bytes[6]) + "; encode it again with Draco 1.2 or later");
    }
    const bool is_mesh = bytes[7] == 1;
    const bool edgebreaker = bytes[8] == 1;
    const bool metadata = (bytes[10] & 0x80) != 0;
    std::span<const std::uint8_t> rest = bytes.subspan(header_bytes);
    if (metadata) {
        draco::DecoderBuffer buffer;
        buffer.Init(reinterpret_cast<const char*>(rest.data()), rest.size());
        buffer.set_bitstream_version(static_cast<std::uint16_t>(version));
        draco::GeometryMetadata skipped;
        if (!draco::MetadataDecoder().DecodeGeometryMetadata(&buffer, &skipped)) return not_readable("bad metadata");
        rest = rest.subspan(static_cast<std::size_t>(buffer.decoded_size()));
    }
    ByteReader in(rest);
    DracoCounts counts;
    if (!is_mesh) {
        counts.points = in.u32();
    } else if (edgebreaker) {
        in.u8();  // the method of traversal
        counts.points = in.varint();
        counts.faces = in.varint();
    } else {
        counts.faces = in.varint();
        counts.points = in.varint();
    }
    if (!in.ok()) return not_readable("it ends within its header");
    return counts;
}

Result<void> check_counts(const DracoCounts& counts, std::size_t file_bytes, const MeshLimits& limits) {
    if (auto ok = check_count(counts.points, limits.most_vertices, "vertices"); !ok) return ok;
    if (auto ok = check_count(counts.faces, limits.most_triangles, "triangles"); !ok) return ok;
    // Draco never gets below a hundredth of a bit per vertex, except in small meshes, which may be one repeated value.
    const std::uint64_t believable = 65536 + std::uint64_t{1000} * file_bytes;
    if (counts.points > believable || counts.faces > believable) {
        return not_readable("it claims " + std::to_string(counts.points) + " vertices and " +
                            std::to_string(counts.faces) + " triangles in " + std::to_string(file_bytes) + " bytes");
    }
    return {};
}

// Calls take(point, components) for each point; false if the attribute does not have data for all points.
template <std::size_t N, class Take>
bool for_each_point(const draco::PointCloud& cloud, const draco::PointAttribute& attribute, Take take) {
    const std::uint32_t points = cloud.num_points();
    if (!attribute.IsValid()) return false;
    if (!attribute.is_mapping_identity() && attribute.indices_map_size() < points) return false;
    const std::int64_t value_bytes = std::int64_t{draco::DataTypeLength(attribute.data_type())} * N;
    const auto data_bytes = static_cast<std::int64_t>(attribute.buffer()->data_size());
    for (std::uint32_t p = 0; p < points; ++p) {
        const draco::AttributeValueIndex index = attribute.mapped_index(draco::PointIndex(p));
        if (index.value() >= attribute.size() || attribute.GetBytePos(index) + value_bytes > data_bytes) return false;
        std::array<double, N> value{};
        if (!attribute.ConvertValue<double, static_cast<int>(N)>(index, value.data())) return false;
        take(p, value);
    }
    return true;
}

Result<void> copy_positions(const draco::PointCloud& cloud, Mesh& mesh) {
    const draco::PointAttribute* attribute = cloud.GetNamedAttribute(draco::GeometryAttribute::POSITION);
    if (!attribute) {
        return cloud.num_points() == 0 ? Result<void>() : not_readable("it holds no positions");
    }
    if (attribute->num_components() != 3) {
        return fail(ErrorKind::unsupported, "the Draco file's positions do not have three components");
    }
    std::optional<std::uint32_t> broken;
    const bool complete =
        for_each_point<3>(cloud, *attribute, [&](std::uint32_t p, const std::array<double, 3>& value) {
            for (const double c : value) {
                if (!fits_float(c) && !broken) broken = p;
            }
            mesh.positions.push_back({finite_or_zero(value[0]), finite_or_zero(value[1]), finite_or_zero(value[2])});
        });
    if (!complete) return not_readable("its positions are incomplete");
    if (broken) {
        return fail(ErrorKind::bad_input, "the position of vertex " + std::to_string(*broken) + " is not finite");
    }
    return {};
}

Result<void> copy_colours(const draco::PointCloud& cloud, Mesh& mesh) {
    const draco::PointAttribute* attribute = cloud.GetNamedAttribute(draco::GeometryAttribute::COLOR);
    if (!attribute) return {};
    double scale = 1;
    switch (attribute->data_type()) {
        case draco::DT_UINT8:
            break;
        case draco::DT_UINT16:
            scale = 1.0 / 257;
            break;
        case draco::DT_FLOAT32:
        case draco::DT_FLOAT64:
            scale = 255;
            break;
        default:
            return fail(ErrorKind::unsupported, "the Draco file's colours are neither 8 nor 16 bits nor floats");
    }
    if (attribute->num_components() < 3 || attribute->num_components() > 4) {
        return fail(ErrorKind::unsupported, "the Draco file's colours do not have three or four components");
    }
    // libdraco scales normalised integers to 0..1.
    if (attribute->normalized()) scale = 255;
    const bool complete = for_each_point<3>(cloud, *attribute, [&](std::uint32_t, const std::array<double, 3>& value) {
        Colour colour{};
        for (std::size_t i = 0; i < 3; ++i) {
            const double c = value[i] * scale;
            colour[i] = c > 0 ? static_cast<std::uint8_t>(std::lround(std::min(c, 255.0))) : std::uint8_t{0};
        }
        mesh.colours.push_back(colour);
    });
    return complete ? Result<void>() : not_readable("its colours are incomplete");
}

template <std::size_t N>
Result<void> copy_floats(const draco::PointCloud& cloud, draco::GeometryAttribute::Type type, const char* name,
                         std::vector<std::array<float, N>>& out) {
    const draco::PointAttribute* attribute = cloud.GetNamedAttribute(type);
    if (!attribute) return {};
    if (attribute->num_components() != N) {
        return fail(ErrorKind::unsupported,
                    std::string("the Draco file's ") + name + " do not have " + std::to_string(N) + " components");
    }
    const bool complete = for_each_point<N>(cloud, *attribute, [&](std::uint32_t, const std::array<double, N>& value) {
        std::transform(value.begin(), value.end(), out.emplace_back().begin(), finite_or_zero);
    });
    return complete ? Result<void>() : not_readable(std::string("its ") + name + " are incomplete");
}

Result<Mesh> mesh_of(const draco::PointCloud& cloud, const draco::Mesh* faces, const MeshLimits& limits) {
    if (auto ok = check_count(cloud.num_points(), limits.most_vertices, "vertices"); !ok) {
        return tl::unexpected(ok.error());
    }
    Mesh mesh;
    Result<void> taken = copy_positions(cloud, mesh);
    if (taken) taken = copy_colours(cloud, mesh);
    if (taken) taken = copy_floats(cloud, draco::GeometryAttribute::NORMAL, "normals", mesh.normals);
    if (taken) taken = copy_floats(cloud, draco::GeometryAttribute::TEX_COORD, "texture coordinates", mesh.texcoords);
    if (!taken) return tl::unexpected(taken.error());
    const std::uint32_t face_count = faces ? faces->num_faces() : 0;
    for (std::uint32_t f = 0; f < face_count; ++f) {
        const draco::Mesh::Face& face = faces->face(draco::FaceIndex(f));
        mesh.triangles.push_back({face[0].value(), face[1].value(), face[2].value()});
    }
    if (auto ok = check_mesh(mesh); !ok) return tl::unexpected(ok.error());
    return mesh;
}

Result<Mesh> decode(std::span<const std::uint8_t> bytes, const MeshLimits& limits) {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const auto type = draco::Decoder::GetEncodedGeometryType(&buffer);
    if (!type.ok()) return not_readable(type.status().error_msg_string());
    draco::Decoder decoder;
    if (type.value() == draco::TRIANGULAR_MESH) {
        auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
        if (!decoded.ok()) return not_readable(decoded.status().error_msg_string());
        return mesh_of(*decoded.value(), decoded.value().get(), limits);
    }
    if (type.value() != draco::POINT_CLOUD) return not_readable("it is neither a mesh nor a point cloud");
    auto decoded = decoder.DecodePointCloudFromBuffer(&buffer);
    if (!decoded.ok()) return not_readable(decoded.status().error_msg_string());
    return mesh_of(*decoded.value(), nullptr, limits);
}

}  // namespace

Result<Mesh> read_drc(std::span<const std::uint8_t> bytes, const MeshReadOptions& options, MeshFindings*) {
    const auto& limits = options.limits;
    try {
        const auto counts = claimed_counts(bytes);
        if (!counts) return tl::unexpected(counts.error());
        if (auto ok = check_counts(*counts, bytes.size(), limits); !ok) return tl::unexpected(ok.error());
        return decode(bytes, limits);
    } catch (const std::bad_alloc&) {
        return fail(ErrorKind::limit, "the Draco file asks for more memory than there is");
    } catch (const std::exception& e) {
        return not_readable(e.what());
    }
}

}  // namespace htvm
