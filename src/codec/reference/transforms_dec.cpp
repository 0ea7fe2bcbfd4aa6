#include "codec/reference/transforms.h"
#include "entropy/range_decoder.h"

namespace htvm::internal {
namespace {

// Kept within twice the lattice, so that sums of a few of them cannot overflow.
std::int32_t decode_coordinate(RangeDecoder& decoder, SignedModel& model) {
    return decode_signed(decoder, model) % (2 * lattice_limit + 1);
}

LatticePoint decode_point(RangeDecoder& decoder, SignedModel& model) {
    LatticePoint p;
    p.x = decode_coordinate(decoder, model);
    p.y = decode_coordinate(decoder, model);
    p.z = decode_coordinate(decoder, model);
    return p;
}

bool decode_rotation(RangeDecoder& decoder, SignedModel& model, QuantisedRotation& rotation) {
    rotation.largest = static_cast<std::uint8_t>(decoder.raw(2));
    for (auto& c : rotation.others) {
        const std::int32_t v = decode_signed(decoder, model);
        if (v > (1 << rotation_bits) || v < -(1 << rotation_bits)) return false;
        c = static_cast<std::int16_t>(v);
    }
    return true;
}

}  // namespace

Result<std::vector<QuantisedTransform>> decode_transforms(std::span<const std::uint8_t> bytes, std::size_t bones) {
    RangeDecoder decoder(bytes);
    BinaryModel still;
    SignedModel rotation, shift;
    std::vector<QuantisedTransform> out(bones);
    for (auto& transform : out) {
        if (decoder.bit(still)) continue;
        if (!decode_rotation(decoder, rotation, transform.rotation))
            return fail(ErrorKind::corrupt_stream, "transforms layer: a rotation is out of range");
        transform.shift = decode_point(decoder, shift);
    }
    if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "transforms layer: it ends too early");
    return out;
}

Result<CodedPose> decode_pose(std::span<const std::uint8_t> bytes, std::size_t joints, std::size_t bones) {
    RangeDecoder decoder(bytes);
    SignedModel rotation, position;
    CodedPose out;
    LatticePoint previous;
    for (std::size_t k = 0; k < joints; ++k) {
        previous = previous + decode_point(decoder, position);
        if (!on_lattice(previous) || decoder.exhausted())
            return fail(ErrorKind::corrupt_stream, "pose layer: a joint is out of range or missing");
        out.joints.push_back(previous);
    }
    out.orientations.resize(bones);
    for (auto& orientation : out.orientations)
        if (!decode_rotation(decoder, rotation, orientation))
            return fail(ErrorKind::corrupt_stream, "pose layer: an orientation is out of range");
    if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "pose layer: it ends too early");
    return out;
}

}  // namespace htvm::internal
