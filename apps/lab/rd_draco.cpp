// Draco as a coder under test.
#include <draco/compression/decode.h>
#include <draco/compression/encode.h>
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "rd_coders.h"
#include "rd_stopwatch.h"

namespace htvm::lab {
namespace {

using draco::GeometryAttribute;

struct DracoSettings {
    int speed = 0;  // 10 - compression level
    int position_bits = 11;
    int colour_step = 1;
};

template <class Value>
void add_attribute(draco::PointCloud& cloud, GeometryAttribute::Type type, draco::DataType data_type,
                   const std::vector<Value>& values) {
    GeometryAttribute attribute;
    attribute.Init(type, nullptr, 3, data_type, false, sizeof(Value), 0);
    const int id = cloud.AddAttribute(attribute, true, static_cast<std::uint32_t>(values.size()));
    for (std::uint32_t i = 0; i < values.size(); ++i)
        cloud.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), &values[i]);
}

void fill(draco::PointCloud& cloud, const Mesh& mesh, bool colours, int colour_step) {
    cloud.set_num_points(static_cast<std::uint32_t>(mesh.positions.size()));
    add_attribute(cloud, GeometryAttribute::POSITION, draco::DT_FLOAT32, mesh.positions);
    if (!colours) return;
    auto numbered = mesh.colours;
    for (auto& colour : numbered)
        for (auto& c : colour) c = static_cast<std::uint8_t>((c + colour_step / 2) / colour_step);
    add_attribute(cloud, GeometryAttribute::COLOR, draco::DT_UINT8, numbered);
}

Result<std::vector<char>> encode(const Mesh& mesh, const DracoSettings& settings, bool colours, double& milliseconds) {
    draco::Encoder encoder;
    encoder.SetSpeedOptions(settings.speed, settings.speed);
    encoder.SetAttributeQuantization(GeometryAttribute::POSITION, settings.position_bits);
    draco::EncoderBuffer buffer;
    draco::Status status;
    if (mesh.triangles.empty()) {
        draco::PointCloud cloud;
        fill(cloud, mesh, colours, settings.colour_step);
        const Stopwatch watch(1);
        status = encoder.EncodePointCloudToBuffer(cloud, &buffer);
        milliseconds = watch.milliseconds();
    } else {
        draco::Mesh packed;
        fill(packed, mesh, colours, settings.colour_step);
        for (const auto& t : mesh.triangles)
            packed.AddFace({draco::PointIndex(t[0]), draco::PointIndex(t[1]), draco::PointIndex(t[2])});
        packed.DeduplicateAttributeValues();
        packed.DeduplicatePointIds();
        const Stopwatch watch(1);
        status = encoder.EncodeMeshToBuffer(packed, &buffer);
        milliseconds = watch.milliseconds();
    }
    if (!status.ok())
        return fail(ErrorKind::unsupported, std::string("Draco cannot code this mesh: ") + status.error_msg());
    return std::vector<char>(buffer.data(), buffer.data() + buffer.size());
}

void take_vertices(const draco::PointCloud& cloud, int colour_step, Mesh& mesh) {
    const auto* positions = cloud.GetNamedAttribute(GeometryAttribute::POSITION);
    const auto* colours = cloud.GetNamedAttribute(GeometryAttribute::COLOR);
    mesh.positions.resize(cloud.num_points());
    if (colours) mesh.colours.resize(cloud.num_points());
    for (std::uint32_t i = 0; i < cloud.num_points(); ++i) {
        positions->GetMappedValue(draco::PointIndex(i), &mesh.positions[i]);
        if (!colours) continue;
        colours->GetMappedValue(draco::PointIndex(i), &mesh.colours[i]);
        for (auto& c : mesh.colours[i]) c = static_cast<std::uint8_t>(std::min(c * colour_step, 255));
    }
}

Result<Mesh> decode(const std::vector<char>& bytes, const DracoSettings& settings, double& milliseconds) {
    draco::DecoderBuffer buffer;
    buffer.Init(bytes.data(), bytes.size());
    draco::Decoder decoder;
    const auto type = draco::Decoder::GetEncodedGeometryType(&buffer);
    if (!type.ok()) return fail(ErrorKind::corrupt_stream, "Draco cannot decode what it coded");
    std::unique_ptr<draco::PointCloud> cloud;
    Mesh mesh;
    const Stopwatch watch(1);
    if (type.value() == draco::TRIANGULAR_MESH) {
        auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
        milliseconds = watch.milliseconds();
        if (!decoded.ok()) return fail(ErrorKind::corrupt_stream, "Draco cannot decode what it coded");
        auto packed = std::move(decoded).value();
        for (draco::FaceIndex f(0); f < packed->num_faces(); ++f) {
            const auto& face = packed->face(f);
            mesh.triangles.push_back({face[0].value(), face[1].value(), face[2].value()});
        }
        cloud = std::move(packed);
    } else {
        auto decoded = decoder.DecodePointCloudFromBuffer(&buffer);
        milliseconds = watch.milliseconds();
        if (!decoded.ok()) return fail(ErrorKind::corrupt_stream, "Draco cannot decode what it coded");
        cloud = std::move(decoded).value();
    }
    take_vertices(*cloud, settings.colour_step, mesh);
    return mesh;
}

Result<CodedFrame> code_frame(const SourceFrame& frame, const DracoSettings& settings) {
    CodedFrame out;
    if (frame.mesh.positions.empty()) return out;
    const bool colours = !frame.mesh.colours.empty();
    const auto bytes = encode(frame.mesh, settings, colours, out.encode_ms);
    if (!bytes) return tl::unexpected(bytes.error());
    out.bytes.external_intra = bytes->size();
    if (colours) {
        // Its colours' share: what the same frame takes less without them.
        double not_counted = 0;
        const auto geometry = encode(frame.mesh, settings, false, not_counted);
        if (!geometry) return tl::unexpected(geometry.error());
        out.bytes.external_intra = std::min(geometry->size(), bytes->size());
        out.bytes.colour = bytes->size() - out.bytes.external_intra;
        out.bytes.overhead = 1;
    }
    out.decode_ms = 0;
    auto decoded = decode(*bytes, settings, *out.decode_ms);
    if (!decoded) return tl::unexpected(decoded.error());
    out.decoded = std::move(*decoded);
    return out;
}

}  // namespace

int draco_position_bits(double side, double step) {
    if (!(side > 0 && step > 0)) return 1;
    return static_cast<int>(std::clamp(std::lround(std::log2(side / step + 1)), 1L, 30L));
}

CoderUnderTest draco_under_test(const std::string& name, int compression_level) {
    CoderUnderTest out;
    out.name = name;
    out.description = fmt::format("Draco at compression level {}, every frame by itself", compression_level);
    out.settings = fmt::format("compression level {}", compression_level);
    out.start = [compression_level](const SequenceFacts& facts, const QualityPoint& quality) -> Result<FrameCoder> {
        DracoSettings settings;
        settings.speed = 10 - compression_level;
        settings.position_bits = draco_position_bits(facts.frame_side, quality.geometry_step);
        settings.colour_step = std::max(1, static_cast<int>(std::lround(quality.colour_step)));
        return FrameCoder([settings](const SourceFrame& frame) { return code_frame(frame, settings); });
    };
    out.describe_quality = [](const SequenceFacts& facts, const QualityPoint& quality) {
        const int bits = draco_position_bits(facts.frame_side, quality.geometry_step);
        return fmt::format("{} bits ({:.2f} mm)", bits, facts.frame_side / (std::exp2(bits) - 1));
    };
    return out;
}

}  // namespace htvm::lab
