#include "codec/reference/transforms.h"

#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

// Written once for both directions (entropy/models.h): what is handed in is written, or becomes what is read.

// Kept within twice the lattice, so that sums of a few of them cannot overflow.
template <class Coder>
void code_point(Coder& coder, SignedModel& model, LatticePoint& p) {
    for (std::int32_t* c : {&p.x, &p.y, &p.z}) *c = coder.signed_number(model, *c) % (2 * lattice_limit + 1);
}

// False where a component is out of range: in a corrupt stream.
template <class Coder>
bool code_rotation(Coder& coder, SignedModel& model, QuantisedRotation& rotation) {
    rotation.largest = static_cast<std::uint8_t>(coder.raw(rotation.largest, 2));
    for (auto& c : rotation.others) {
        const std::int32_t v = coder.signed_number(model, c);
        if (v > (1 << rotation_bits) || v < -(1 << rotation_bits)) return false;
        c = static_cast<std::int16_t>(v);
    }
    return true;
}

template <class Coder>
bool code_transforms(Coder coder, std::span<QuantisedTransform> transforms) {
    BinaryModel still;
    SignedModel rotation, shift;
    for (auto& transform : transforms) {
        if (coder.bit(still, transform == QuantisedTransform{})) continue;
        if (!code_rotation(coder, rotation, transform.rotation)) return false;
        code_point(coder, shift, transform.shift);
    }
    return true;
}

}  // namespace

std::vector<std::uint8_t> encode_transforms(std::span<const QuantisedTransform> transforms) {
    std::vector<QuantisedTransform> coded(transforms.begin(), transforms.end());
    RangeEncoder encoder;
    code_transforms(WritingCoder<RangeEncoder>{encoder}, std::span(coded));
    return encoder.finish();
}

Result<std::vector<QuantisedTransform>> decode_transforms(std::span<const std::uint8_t> bytes, std::size_t bones) {
    RangeDecoder decoder(bytes);
    std::vector<QuantisedTransform> out(bones);
    if (!code_transforms(ReadingCoder<RangeDecoder>{decoder}, std::span(out)))
        return fail(ErrorKind::corrupt_stream, "transforms layer: a rotation is out of range");
    if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "transforms layer: it ends too early");
    return out;
}

std::vector<std::uint8_t> encode_pose(const CodedPose& pose) {
    RangeEncoder encoder;
    WritingCoder<RangeEncoder> coder{encoder};
    SignedModel rotation, position;
    LatticePoint previous;
    for (const auto joint : pose.joints) {
        LatticePoint step = joint - previous;
        code_point(coder, position, step);
        previous = joint;
    }
    for (QuantisedRotation orientation : pose.orientations) code_rotation(coder, rotation, orientation);
    return encoder.finish();
}

Result<CodedPose> decode_pose(std::span<const std::uint8_t> bytes, std::size_t joints, std::size_t bones) {
    RangeDecoder decoder(bytes);
    ReadingCoder<RangeDecoder> coder{decoder};
    SignedModel rotation, position;
    CodedPose out;
    LatticePoint previous;
    for (std::size_t k = 0; k < joints; ++k) {
        LatticePoint step;
        code_point(coder, position, step);
        previous = previous + step;
        if (!on_lattice(previous) || decoder.exhausted())
            return fail(ErrorKind::corrupt_stream, "pose layer: a joint is out of range or missing");
        out.joints.push_back(previous);
    }
    out.orientations.resize(bones);
    for (auto& orientation : out.orientations)
        if (!code_rotation(coder, rotation, orientation))
            return fail(ErrorKind::corrupt_stream, "pose layer: an orientation is out of range");
    if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "pose layer: it ends too early");
    return out;
}

}  // namespace htvm::internal
