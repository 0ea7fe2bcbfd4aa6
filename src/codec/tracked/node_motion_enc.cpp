#include <algorithm>
#include <cmath>

#include "codec/tracked/node_motion.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

// Rounded towards zero a little: a step that hardly helps is not worth its bits.
std::int32_t steps(std::int64_t difference, int exponent) {
    constexpr double dead_zone = 0.6;
    const double size = static_cast<double>(std::int64_t{1} << exponent);
    const double magnitude = std::floor(std::abs(static_cast<double>(difference)) / size + (1 - dead_zone));
    return static_cast<std::int32_t>(std::copysign(magnitude, static_cast<double>(difference)));
}

}  // namespace

EncodedNodeMotion encode_node_motion(std::span<const QuantisedTransform> wanted, std::span<const std::uint32_t> parents,
                                     std::span<const LatticePoint> pivots, std::span<const QuantisedTransform> before,
                                     const NodeMotionOptions& options) {
    EncodedNodeMotion out;
    RangeEncoder encoder;
    BinaryModel same_largest;
    SignedModel rotation, shift;
    constexpr std::int64_t rotation_limit = 1 << rotation_bits, shift_limit = 2 * std::int64_t{lattice_limit};
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
                std::clamp<std::int64_t>(value + std::int64_t{n} * (std::int64_t{1} << options.rotation_exponent),
                                         -rotation_limit, rotation_limit));
        }
        const auto code_shift = [&](std::int32_t& value, std::int32_t target) {
            const auto n = steps(std::int64_t{target} - value, options.shift_exponent);
            encode_signed(encoder, shift, n);
            value = static_cast<std::int32_t>(std::clamp<std::int64_t>(
                value + std::int64_t{n} * (std::int64_t{1} << options.shift_exponent), -shift_limit, shift_limit));
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

}  // namespace htvm::internal
