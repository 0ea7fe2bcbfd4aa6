#include "codec/reference/transforms.h"
#include "entropy/range_encoder.h"

namespace htvm::internal {
namespace {

void encode_point(RangeEncoder& encoder, SignedModel& model, LatticePoint p) {
    encode_signed(encoder, model, p.x);
    encode_signed(encoder, model, p.y);
    encode_signed(encoder, model, p.z);
}

void encode_rotation(RangeEncoder& encoder, SignedModel& model, const QuantisedRotation& rotation) {
    encoder.raw(rotation.largest, 2);
    for (const auto c : rotation.others) encode_signed(encoder, model, c);
}

}  // namespace

std::vector<std::uint8_t> encode_transforms(std::span<const QuantisedTransform> transforms) {
    RangeEncoder encoder;
    BinaryModel still;
    SignedModel rotation, shift;
    for (const auto& transform : transforms) {
        const bool none = transform == QuantisedTransform{};
        encoder.bit(still, none);
        if (none) continue;
        encode_rotation(encoder, rotation, transform.rotation);
        encode_point(encoder, shift, transform.shift);
    }
    return encoder.finish();
}

std::vector<std::uint8_t> encode_pose(const CodedPose& pose) {
    RangeEncoder encoder;
    SignedModel rotation, position;
    LatticePoint previous;
    for (const auto joint : pose.joints) {
        encode_point(encoder, position, joint - previous);
        previous = joint;
    }
    for (const auto& orientation : pose.orientations) encode_rotation(encoder, rotation, orientation);
    return encoder.finish();
}

}  // namespace htvm::internal
