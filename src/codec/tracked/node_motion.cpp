#include "codec/tracked/node_motion.h"

#include <algorithm>
#include <cmath>

#include "codec/reference/transforms.h"
#include "entropy/range_coder.h"

namespace htvm::internal {

namespace {

constexpr std::int32_t shift_limit = 2 * lattice_limit;

std::int32_t within(std::int64_t value, std::int32_t limit) {
    return static_cast<std::int32_t>(std::clamp<std::int64_t>(value, -std::int64_t{limit}, std::int64_t{limit}));
}

LatticePoint sum_of(LatticePoint a, LatticePoint b, LatticePoint minus) {
    return {within(std::int64_t{a.x} + b.x - minus.x, shift_limit),
            within(std::int64_t{a.y} + b.y - minus.y, shift_limit),
            within(std::int64_t{a.z} + b.z - minus.z, shift_limit)};
}

// Rounded slightly towards zero: a step that hardly helps is not worth its bits.
std::int32_t steps(std::int64_t difference, int exponent) {
    constexpr double dead_zone = 0.6;
    const double size = static_cast<double>(std::int64_t{1} << exponent);
    const double magnitude = std::floor(std::abs(static_cast<double>(difference)) / size + (1 - dead_zone));
    return static_cast<std::int32_t>(std::copysign(magnitude, static_cast<double>(difference)));
}

}  // namespace

QuantisedTransform predict_node_transform(std::size_t node, std::uint32_t parent,
                                          std::span<const QuantisedTransform> decoded,
                                          std::span<const LatticePoint> pivots,
                                          std::span<const QuantisedTransform> before) {
    if (parent == no_parent) return before.empty() ? QuantisedTransform{} : before[node];
    const auto& of_parent = decoded[parent];
    if (before.empty()) {
        QuantisedTransform out;
        out.rotation = of_parent.rotation;
        out.shift =
            move(pivots[node], rotation_matrix(of_parent.rotation), pivots[parent], of_parent.shift) - pivots[node];
        return out;
    }
    // As the node was, moved by the step that its parent has made since.
    QuantisedTransform out = before[node];
    const auto& parent_before = before[parent];
    out.shift = sum_of(out.shift, of_parent.shift, parent_before.shift);
    if (of_parent.rotation.largest == parent_before.rotation.largest &&
        out.rotation.largest == of_parent.rotation.largest)
        for (std::size_t c = 0; c < 3; ++c)
            out.rotation.others[c] = static_cast<std::int16_t>(within(
                std::int64_t{out.rotation.others[c]} + of_parent.rotation.others[c] - parent_before.rotation.others[c],
                1 << rotation_bits));
    return out;
}

EncodedNodeMotion encode_node_motion(std::span<const QuantisedTransform> wanted, std::span<const std::uint32_t> parents,
                                     std::span<const LatticePoint> pivots, std::span<const QuantisedTransform> before,
                                     const NodeMotionOptions& options) {
    EncodedNodeMotion out;
    RangeEncoder encoder;
    BinaryModel same_largest;
    SignedModel rotation, shift;
    for (std::size_t node = 0; node < wanted.size(); ++node) {
        auto transform = predict_node_transform(node, parents[node], out.transforms, pivots, before);
        const bool same = transform.rotation.largest == wanted[node].rotation.largest;
        encoder.bit(same_largest, same);
        if (!same) {
            transform.rotation = {};
            transform.rotation.largest = wanted[node].rotation.largest;
            encoder.raw(transform.rotation.largest, 2);
        }
        for (std::size_t c = 0; c < 3; ++c) {
            auto& value = transform.rotation.others[c];
            const auto n = steps(wanted[node].rotation.others[c] - value, options.rotation_exponent);
            encode_signed(encoder, rotation, n);
            value = static_cast<std::int16_t>(
                within(value + std::int64_t{n} * (std::int64_t{1} << options.rotation_exponent), 1 << rotation_bits));
        }
        const auto code_shift = [&](std::int32_t& value, std::int32_t target) {
            const auto n = steps(std::int64_t{target} - value, options.shift_exponent);
            encode_signed(encoder, shift, n);
            value = within(value + std::int64_t{n} * (std::int64_t{1} << options.shift_exponent), shift_limit);
        };
        code_shift(transform.shift.x, wanted[node].shift.x);
        code_shift(transform.shift.y, wanted[node].shift.y);
        code_shift(transform.shift.z, wanted[node].shift.z);
        out.transforms.push_back(transform);
    }
    out.bytes = {static_cast<std::uint8_t>(before.empty() ? 0 : 1),
                 static_cast<std::uint8_t>(options.rotation_exponent),
                 static_cast<std::uint8_t>(options.shift_exponent)};
    const auto coded = encoder.finish();
    out.bytes.insert(out.bytes.end(), coded.begin(), coded.end());
    return out;
}

Result<std::vector<QuantisedTransform>> decode_node_motion(std::span<const std::uint8_t> bytes,
                                                           std::span<const std::uint32_t> parents,
                                                           std::span<const LatticePoint> pivots,
                                                           std::span<const QuantisedTransform> before) {
    if (bytes.size() < 3 || bytes[0] > 1 || bytes[1] > 10 || bytes[2] > 20)
        return fail(ErrorKind::corrupt_stream, "node motion layer: its steps are out of range");
    const bool temporal = bytes[0] == 1;
    if (temporal && before.size() != parents.size())
        return fail(ErrorKind::corrupt_stream, "node motion layer: the frame that it refers to is not there");
    const int rotation_exponent = bytes[1], shift_exponent = bytes[2];
    RangeDecoder decoder(bytes.subspan(3));
    BinaryModel same_largest;
    SignedModel rotation, shift;
    std::vector<QuantisedTransform> out;
    out.reserve(parents.size());
    for (std::size_t node = 0; node < parents.size(); ++node) {
        auto transform = predict_node_transform(node, parents[node], out, pivots,
                                                temporal ? before : std::span<const QuantisedTransform>{});
        if (!decoder.bit(same_largest)) {
            transform.rotation = {};
            transform.rotation.largest = static_cast<std::uint8_t>(decoder.raw(2));
        }
        for (auto& c : transform.rotation.others)
            c = static_cast<std::int16_t>(within(
                c + std::int64_t{decode_signed(decoder, rotation)} * (1 << rotation_exponent), 1 << rotation_bits));
        for (auto* c : {&transform.shift.x, &transform.shift.y, &transform.shift.z})
            *c = within(*c + std::int64_t{decode_signed(decoder, shift)} * (std::int64_t{1} << shift_exponent),
                        shift_limit);
        out.push_back(transform);
        if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "node motion layer: it ends too early");
    }
    return out;
}

}  // namespace htvm::internal
