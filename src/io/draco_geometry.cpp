#include "io/draco_geometry.h"

#include <draco/compression/decode.h>
#include <draco/metadata/geometry_metadata.h>
#include <draco/metadata/metadata_decoder.h>

#include <algorithm>
#include <array>
#include <exception>
#include <limits>
#include <new>
#include <string>
#include <utility>

#include "core/bytes.h"

namespace htvm::internal {
namespace {

constexpr std::size_t most_components = 4;

tl::unexpected<Error> not_readable(const std::string& why) {
    return fail(ErrorKind::bad_input, "the Draco file cannot be read: " + why);
}

struct Counts {
    std::uint64_t faces = 0;
    std::uint64_t points = 0;  // at least, for a mesh; attribute seams add more
};

constexpr int version_of(int major, int minor) { return major * 256 + minor; }

// The counts behind the header and the metadata, whose places changed with the versions of the bitstream.
Counts counts_behind_header(ByteReader& in, int version, bool is_mesh, bool edgebreaker) {
    const bool is_fixed = version < (edgebreaker ? version_of(2, 0) : version_of(2, 2));
    const auto next = [&] { return is_fixed ? std::uint64_t{in.u32()} : in.varint(); };
    Counts counts;
    if (!is_mesh) {
        counts.points = in.u32();
    } else if (edgebreaker) {
        in.u8();                                       // the method of traversal
        if (version < version_of(2, 2)) (void)next();  // vertices that are split
        counts.points = next();
        counts.faces = next();
    } else {
        counts.faces = next();
        counts.points = next();
    }
    return counts;
}

// The counts that libdraco is going to allocate for, read from the beginning of the file: "DRACO", version, type and
// method, flags; metadata if the flags say so; counts.
Result<Counts> claimed_counts(std::span<const std::uint8_t> bytes) {
    constexpr std::size_t header_bytes = 11;
    if (bytes.size() < header_bytes || !std::equal(bytes.begin(), bytes.begin() + 5, "DRACO"))
        return not_readable("it does not begin with \"DRACO\"");
    const int version = version_of(bytes[5], bytes[6]);
    if (version < version_of(1, 0))
        return fail(ErrorKind::unsupported, "the Draco file is of bitstream version " + std::to_string(bytes[5]) + "." +
                                                std::to_string(bytes[6]) + "; encode it again with a later Draco");
    const bool is_mesh = bytes[7] == 1;
    const bool edgebreaker = bytes[8] == 1;
    const bool metadata = (bytes[10] & 0x80) != 0 && version >= version_of(1, 3);
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
    const auto counts = counts_behind_header(in, version, is_mesh, edgebreaker);
    if (!in.ok()) return not_readable("it ends within its header");
    return counts;
}

Result<void> check_counts(const Counts& counts, std::size_t file_bytes, const MeshLimits& limits) {
    if (auto ok = check_count(counts.points, limits.most_vertices, "vertices"); !ok) return ok;
    if (auto ok = check_count(counts.faces, limits.most_triangles, "triangles"); !ok) return ok;
    // Draco never gets below a hundredth of a bit per vertex, except in small meshes, which may be one repeated value.
    const std::uint64_t believable = 65536 + std::uint64_t{1000} * file_bytes;
    if (counts.points > believable || counts.faces > believable)
        return not_readable("it claims " + std::to_string(counts.points) + " vertices and " +
                            std::to_string(counts.faces) + " triangles in " + std::to_string(file_bytes) + " bytes");
    return {};
}

DracoKind kind_of(const draco::PointAttribute& attribute) {
    switch (attribute.attribute_type()) {
        case draco::GeometryAttribute::POSITION:
            return DracoKind::position;
        case draco::GeometryAttribute::NORMAL:
            return DracoKind::normal;
        case draco::GeometryAttribute::COLOR:
            return DracoKind::colour;
        case draco::GeometryAttribute::TEX_COORD:
            return DracoKind::texcoord;
        default:
            return DracoKind::other;
    }
}

template <class T>
constexpr double most = static_cast<double>(std::numeric_limits<T>::max());

std::optional<double> most_of(draco::DataType type) {
    switch (type) {
        case draco::DT_INT8:
            return most<std::int8_t>;
        case draco::DT_UINT8:
            return most<std::uint8_t>;
        case draco::DT_INT16:
            return most<std::int16_t>;
        case draco::DT_UINT16:
            return most<std::uint16_t>;
        case draco::DT_INT32:
            return most<std::int32_t>;
        case draco::DT_UINT32:
            return most<std::uint32_t>;
        case draco::DT_INT64:
            return most<std::int64_t>;
        case draco::DT_UINT64:
            return most<std::uint64_t>;
        case draco::DT_BOOL:
            return 1;
        default:
            return std::nullopt;
    }
}

Result<DracoGeometry> geometry_of(std::shared_ptr<const draco::PointCloud> cloud, const draco::Mesh* faces,
                                  const MeshLimits& limits) {
    DracoGeometry out;
    out.points = cloud->num_points();
    if (auto ok = check_count(out.points, limits.most_vertices, "vertices"); !ok) return tl::unexpected(ok.error());
    for (std::int32_t a = 0; a < cloud->num_attributes(); ++a) {
        const auto& attribute = *cloud->attribute(a);
        out.attributes.push_back({kind_of(attribute), attribute.unique_id(), attribute.num_components(),
                                  most_of(attribute.data_type()), attribute.normalized(),
                                  static_cast<std::uint32_t>(a)});
    }
    const std::uint32_t face_count = faces ? faces->num_faces() : 0;
    for (std::uint32_t f = 0; f < face_count; ++f) {
        const draco::Mesh::Face& face = faces->face(draco::FaceIndex(f));
        out.triangles.push_back({face[0].value(), face[1].value(), face[2].value()});
        for (const auto index : out.triangles.back())
            if (index >= out.points) return not_readable("a triangle uses a vertex that is not there");
    }
    out.cloud = std::move(cloud);
    return out;
}

Result<DracoGeometry> decode(std::span<const std::uint8_t> bytes, const MeshLimits& limits) {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const auto type = draco::Decoder::GetEncodedGeometryType(&buffer);
    if (!type.ok()) return not_readable(type.status().error_msg_string());
    draco::Decoder decoder;
    if (type.value() == draco::TRIANGULAR_MESH) {
        auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
        if (!decoded.ok()) return not_readable(decoded.status().error_msg_string());
        const std::shared_ptr<const draco::Mesh> mesh = std::move(decoded).value();
        return geometry_of(mesh, mesh.get(), limits);
    }
    if (type.value() != draco::POINT_CLOUD) return not_readable("it is neither a mesh nor a point cloud");
    auto decoded = decoder.DecodePointCloudFromBuffer(&buffer);
    if (!decoded.ok()) return not_readable(decoded.status().error_msg_string());
    return geometry_of(std::move(decoded).value(), nullptr, limits);
}

// The rows of an attribute whose numbers are of type T. Through libdraco's own conversion normalised integers would be
// scaled.
template <class T>
Result<std::vector<double>> rows_of(const draco::PointAttribute& attribute, std::uint32_t points) {
    const auto incomplete = [] { return not_readable("an attribute is incomplete"); };
    const auto components = static_cast<std::size_t>(attribute.num_components());
    if (!attribute.IsValid()) return incomplete();
    if (!attribute.is_mapping_identity() && attribute.indices_map_size() < points) return incomplete();
    const auto data_bytes = static_cast<std::int64_t>(attribute.buffer()->data_size());
    const auto row_bytes = static_cast<std::int64_t>(components * sizeof(T));
    std::vector<double> out;
    out.reserve(components * points);
    std::array<T, most_components> row{};
    for (std::uint32_t p = 0; p < points; ++p) {
        const draco::AttributeValueIndex index = attribute.mapped_index(draco::PointIndex(p));
        if (index.value() >= attribute.size() || attribute.GetBytePos(index) + row_bytes > data_bytes)
            return incomplete();
        attribute.buffer()->Read(attribute.GetBytePos(index), row.data(), static_cast<std::size_t>(row_bytes));
        for (std::size_t c = 0; c < components; ++c) out.push_back(static_cast<double>(row[c]));
    }
    return out;
}

}  // namespace

Result<DracoGeometry> read_draco_geometry(std::span<const std::uint8_t> bytes, const MeshLimits& limits) {
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

Result<std::vector<double>> draco_rows(const DracoGeometry& geometry, const DracoAttribute& attribute) {
    const auto& of = *geometry.cloud->attribute(static_cast<std::int32_t>(attribute.number));
    const auto points = geometry.points;
    if (attribute.components == 0 || attribute.components > most_components)
        return not_readable("an attribute has " + std::to_string(attribute.components) + " numbers for each vertex");
    switch (of.data_type()) {
        case draco::DT_INT8:
            return rows_of<std::int8_t>(of, points);
        case draco::DT_UINT8:
        case draco::DT_BOOL:
            return rows_of<std::uint8_t>(of, points);
        case draco::DT_INT16:
            return rows_of<std::int16_t>(of, points);
        case draco::DT_UINT16:
            return rows_of<std::uint16_t>(of, points);
        case draco::DT_INT32:
            return rows_of<std::int32_t>(of, points);
        case draco::DT_UINT32:
            return rows_of<std::uint32_t>(of, points);
        case draco::DT_INT64:
            return rows_of<std::int64_t>(of, points);
        case draco::DT_UINT64:
            return rows_of<std::uint64_t>(of, points);
        case draco::DT_FLOAT32:
            return rows_of<float>(of, points);
        case draco::DT_FLOAT64:
            return rows_of<double>(of, points);
        default:
            return not_readable("an attribute is of an unknown type");
    }
}

}  // namespace htvm::internal
