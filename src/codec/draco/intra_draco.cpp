// Draco as the coder of I-frames (paper, section III-C: "a low-complexity real-time algorithm can be preferred").
//
// The mesh's integers are passed as integer attributes, which Draco codes losslessly. Draco reorders vertices and
// triangles, drops isolated vertices and degenerate triangles, and splits non-manifold vertices.
#include <draco/compression/decode.h>
#include <draco/compression/encode.h>

#include <algorithm>
#include <exception>
#include <new>
#include <string>

#include "codec/format/frame_payload.h"
#include "core/bytes.h"
#include "core/lattice.h"
#include "htvm/intra_coder.hpp"

namespace htvm {

using namespace internal;
namespace {

constexpr int draco_speed = 3;  // compression level 7

template <class Component, class Values>
int add_attribute(draco::PointCloud& cloud, draco::GeometryAttribute::Type type, draco::DataType data_type,
                  std::int8_t components, const Values& values) {
    draco::GeometryAttribute attribute;
    attribute.Init(type, nullptr, components, data_type, false,
                   static_cast<std::int64_t>(sizeof(Component)) * components, 0);
    const int id = cloud.AddAttribute(attribute, true, static_cast<std::uint32_t>(values.size()));
    for (std::uint32_t k = 0; k < values.size(); ++k)
        cloud.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(k), &values[k]);
    return id;
}

// Normals and texture coordinates are distinguished by their number of components.
void fill(draco::PointCloud& cloud, const LatticeMesh& mesh) {
    using draco::GeometryAttribute;
    cloud.set_num_points(static_cast<std::uint32_t>(mesh.positions.size()));
    add_attribute<std::int32_t>(cloud, GeometryAttribute::POSITION, draco::DT_INT32, 3, mesh.positions);
    if (!mesh.colours.empty())
        add_attribute<std::uint8_t>(cloud, GeometryAttribute::COLOR, draco::DT_UINT8, 3, mesh.colours);
    if (!mesh.normals.empty())
        add_attribute<std::int32_t>(cloud, GeometryAttribute::GENERIC, draco::DT_INT32, 3, mesh.normals);
    if (!mesh.texcoords.empty())
        add_attribute<std::int32_t>(cloud, GeometryAttribute::GENERIC, draco::DT_INT32, 2, mesh.texcoords);
}

Result<std::vector<std::uint8_t>> encode(const LatticeMesh& mesh) {
    draco::Encoder encoder;
    encoder.SetSpeedOptions(draco_speed, draco_speed);
    draco::EncoderBuffer buffer;
    draco::Status status;
    if (mesh.triangles.empty()) {
        if (mesh.positions.empty()) return std::vector<std::uint8_t>{};
        draco::PointCloud cloud;
        fill(cloud, mesh);
        status = encoder.EncodePointCloudToBuffer(cloud, &buffer);
    } else {
        draco::Mesh packed;
        fill(packed, mesh);
        for (const auto& t : mesh.triangles)
            packed.AddFace({draco::PointIndex(t[0]), draco::PointIndex(t[1]), draco::PointIndex(t[2])});
        status = encoder.EncodeMeshToBuffer(packed, &buffer);
    }
    if (!status.ok())
        return fail(ErrorKind::unsupported, std::string("Draco cannot code this mesh: ") + status.error_msg());
    const auto* data = reinterpret_cast<const std::uint8_t*>(buffer.data());
    return std::vector<std::uint8_t>(data, data + buffer.size());
}

template <class Value>
bool read_values(const draco::PointCloud& cloud, const draco::PointAttribute* attribute, std::size_t components,
                 draco::DataType type, std::vector<Value>& out) {
    if (!attribute) return true;
    if (attribute->num_components() != static_cast<int>(components) || attribute->data_type() != type) return false;
    out.resize(cloud.num_points());
    for (std::uint32_t k = 0; k < cloud.num_points(); ++k) {
        const auto value = attribute->mapped_index(draco::PointIndex(k));
        if (value.value() >= attribute->size()) return false;
        attribute->GetValue(value, &out[k]);
    }
    return true;
}

Result<LatticeMesh> decode(std::span<const std::uint8_t> bytes) {
    LatticeMesh mesh;
    if (bytes.empty()) return mesh;
    const auto corrupt = fail(ErrorKind::corrupt_stream, "I-frame: its Draco data is damaged");
    try {
        draco::DecoderBuffer buffer;
        buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        draco::Decoder decoder;
        auto type = draco::Decoder::GetEncodedGeometryType(&buffer);
        if (!type.ok()) return corrupt;
        std::unique_ptr<draco::PointCloud> cloud;
        if (type.value() == draco::TRIANGULAR_MESH) {
            auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
            if (!decoded.ok()) return corrupt;
            auto packed = std::move(decoded).value();
            for (draco::FaceIndex f(0); f < packed->num_faces(); ++f) {
                const auto& face = packed->face(f);
                mesh.triangles.push_back({face[0].value(), face[1].value(), face[2].value()});
            }
            cloud = std::move(packed);
        } else {
            auto decoded = decoder.DecodePointCloudFromBuffer(&buffer);
            if (!decoded.ok()) return corrupt;
            cloud = std::move(decoded).value();
        }
        using draco::GeometryAttribute;
        const auto* positions = cloud->GetNamedAttribute(GeometryAttribute::POSITION);
        bool sound =
            positions && read_values(*cloud, positions, 3, draco::DT_INT32, mesh.positions) &&
            read_values(*cloud, cloud->GetNamedAttribute(GeometryAttribute::COLOR), 3, draco::DT_UINT8, mesh.colours);
        for (int i = 0; sound && i < cloud->NumNamedAttributes(GeometryAttribute::GENERIC); ++i) {
            const auto* attribute = cloud->GetNamedAttribute(GeometryAttribute::GENERIC, i);
            sound = attribute->num_components() == 3
                        ? read_values(*cloud, attribute, 3, draco::DT_INT32, mesh.normals)
                        : read_values(*cloud, attribute, 2, draco::DT_INT32, mesh.texcoords);
        }
        if (!sound) return corrupt;
    } catch (const std::bad_alloc&) {
        throw;  // rethrown: the decoder reports it
    } catch (const std::exception&) {
        return corrupt;
    }
    return mesh;
}

// The counts at the beginning of Draco's bytes. They are checked first, because Draco's decoder would spend memory and
// time on whatever they claim.
Result<ClaimedCounts> claims(std::span<const std::uint8_t> bytes) {
    ClaimedCounts out;
    if (bytes.empty()) return out;
    ByteReader in(bytes);
    const auto name = in.bytes(5);
    const unsigned major = in.u8(), minor = in.u8(), type = in.u8(), method = in.u8(), flags = in.u16();
    const bool known = in.ok() && std::equal(name.begin(), name.end(), "DRACO") && major == 2 && minor >= 2 &&
                       type <= draco::TRIANGULAR_MESH && method <= 1 && flags == 0;
    if (!known) return fail(ErrorKind::corrupt_stream, "I-frame: its Draco data is damaged or of an older version");
    if (type == draco::POINT_CLOUD) {
        out.vertices = in.u32();
    } else if (method == draco::MESH_SEQUENTIAL_ENCODING) {
        out.triangles = in.varint();
        out.vertices = in.varint();
    } else {
        in.u8();  // the method of traversal
        out.vertices = in.varint();
        out.triangles = in.varint();
    }
    if (!in.ok()) return fail(ErrorKind::corrupt_stream, "I-frame: its Draco data ends too early");
    return out;
}

}  // namespace

ExternalIntraCoder draco_intra_coder() { return {intra_coder_draco, "draco", encode, decode, claims}; }

}  // namespace htvm
