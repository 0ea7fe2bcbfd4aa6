#include "codec/tracked/node_motion.h"

#include <algorithm>

#include "codec/reference/blending.h"
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
    // As the node was, and the step that its parent has made since.
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
