// What encoder and decoder of node motion share: the prediction of each node's transform, the axes in which its shift
// is coded, and the code of its residual.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "codec/reference/transforms.h"
#include "codec/tracked/node_motion.h"
#include "core/geometry.h"
#include "entropy/models.h"

namespace htvm::internal::node_motion_detail {

inline constexpr std::int32_t shift_limit = 2 * lattice_limit, rotation_limit = 1 << rotation_bits;

using Transforms = std::span<const QuantisedTransform>;

inline std::int32_t within(std::int64_t value, std::int32_t limit) {
    return static_cast<std::int32_t>(std::clamp<std::int64_t>(value, -std::int64_t{limit}, std::int64_t{limit}));
}

// ---- Prediction -----------------------------------------------------------------------------------------------------

// Sums of whole vectors, and their mean, rounded to the nearest.
struct VectorSum {
    std::array<std::int64_t, 3> sum{};
    std::int64_t count = 0;
    void add(std::int64_t x, std::int64_t y, std::int64_t z) {
        sum[0] += x, sum[1] += y, sum[2] += z;
        ++count;
    }
    std::int64_t mean(std::size_t axis) const { return count == 0 ? 0 : divide_rounded(sum[axis], count); }
};

// Where a node would be if it moved rigidly with a neighbour, relative to its pivot.
inline LatticePoint shift_with(std::size_t node, std::uint32_t neighbour, Transforms decoded, const NodeGraph& graph) {
    const auto& of_neighbour = decoded[neighbour];
    return move(graph.pivots[node], rotation_matrix(of_neighbour.rotation), graph.pivots[neighbour],
                of_neighbour.shift) -
           graph.pivots[node];
}

// From the reference alone: the mean of where the neighbours would take the node.
inline QuantisedTransform predict_from_reference(std::size_t node, Transforms decoded, const NodeGraph& graph) {
    QuantisedTransform out;
    const auto& lower = graph.lower[node];
    if (lower.empty()) return out;
    out.rotation.largest = decoded[lower.front()].rotation.largest;
    VectorSum shifts, turns;
    for (const auto neighbour : lower) {
        const auto shift = shift_with(node, neighbour, decoded, graph);
        shifts.add(shift.x, shift.y, shift.z);
        const auto& rotation = decoded[neighbour].rotation;
        if (rotation.largest == out.rotation.largest)
            turns.add(rotation.others[0], rotation.others[1], rotation.others[2]);
    }
    out.shift = {within(shifts.mean(0), shift_limit), within(shifts.mean(1), shift_limit),
                 within(shifts.mean(2), shift_limit)};
    for (std::size_t c = 0; c < 3; ++c) out.rotation.others[c] = static_cast<std::int16_t>(turns.mean(c));
    return out;
}

// From the previous frame: as the node was, moved by the mean step of the neighbours since.
inline QuantisedTransform predict_from_before(std::size_t node, Transforms decoded, Transforms before,
                                              std::span<const std::uint32_t> neighbours) {
    QuantisedTransform out = before[node];
    VectorSum steps, turns;
    for (const auto neighbour : neighbours) {
        const auto &now = decoded[neighbour], &then = before[neighbour];
        steps.add(std::int64_t{now.shift.x} - then.shift.x, std::int64_t{now.shift.y} - then.shift.y,
                  std::int64_t{now.shift.z} - then.shift.z);
        if (now.rotation.largest == then.rotation.largest && out.rotation.largest == now.rotation.largest)
            turns.add(now.rotation.others[0] - then.rotation.others[0],
                      now.rotation.others[1] - then.rotation.others[1],
                      now.rotation.others[2] - then.rotation.others[2]);
    }
    out.shift = {within(out.shift.x + steps.mean(0), shift_limit), within(out.shift.y + steps.mean(1), shift_limit),
                 within(out.shift.z + steps.mean(2), shift_limit)};
    for (std::size_t c = 0; c < 3; ++c)
        out.rotation.others[c] =
            static_cast<std::int16_t>(within(out.rotation.others[c] + turns.mean(c), rotation_limit));
    return out;
}

inline QuantisedTransform predict(std::size_t node, Transforms decoded, Transforms before, const NodeGraph& graph) {
    return before.empty() ? predict_from_reference(node, decoded, graph)
                          : predict_from_before(node, decoded, before, graph.lower[node]);
}

// ---- Across and along the surface -----------------------------------------------------------------------------------

using Axes = std::array<Vector3d, 3>;
inline constexpr Axes axes_of_space = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

inline Vector3d unit_product(const Vector3d& a, const Vector3d& b) {
    const Vector3d out = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    const double length = std::sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    return {out[0] / length, out[1] / length, out[2] / length};
}

// The first across the surface at a node as it is predicted to be turned, the others along it; those of space if the
// surface has no normal there.
inline Axes surface_axes(const Vector3d& normal, const QuantisedRotation& rotation) {
    const auto m = rotation_matrix(rotation);
    Vector3d across{};
    for (std::size_t i = 0; i < 3; ++i)
        across[i] = static_cast<double>(m[3 * i]) * normal[0] + static_cast<double>(m[3 * i + 1]) * normal[1] +
                    static_cast<double>(m[3 * i + 2]) * normal[2];
    const double length = std::sqrt(across[0] * across[0] + across[1] * across[1] + across[2] * across[2]);
    if (!(length > 0)) return axes_of_space;
    std::size_t least = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        across[i] /= length;
        if (std::abs(across[i]) < std::abs(across[least])) least = i;
    }
    const Vector3d along = unit_product(across, axes_of_space[least]);
    return {across, along, unit_product(across, along)};
}

// The shift moved by so many steps along each axis.
inline LatticePoint moved_along(LatticePoint shift, const Axes& axes, const std::array<std::int32_t, 3>& steps,
                                int exponent) {
    std::array<double, 3> length{};
    for (std::size_t k = 0; k < 3; ++k)
        length[k] = static_cast<double>(steps[k]) * static_cast<double>(std::int64_t{1} << exponent);
    const auto moved = [&](std::int32_t value, std::size_t i) {
        const double by = axes[0][i] * length[0] + axes[1][i] * length[1] + axes[2][i] * length[2];
        return within(value + static_cast<std::int64_t>(std::floor(by + 0.5)), shift_limit);
    };
    return {moved(shift.x, 0), moved(shift.y, 1), moved(shift.z, 2)};
}

// ---- Coding ---------------------------------------------------------------------------------------------------------

struct MotionModels {
    BinaryModel same_largest;
    SignedModel rotation;
    std::array<SignedModel, 2> shift;      // across the surface, along it
    std::array<std::size_t, 3> of_axis{};  // which of them
};

inline constexpr std::array<std::size_t, 3> surface_models = {0, 1, 1};

struct MotionSteps {
    bool same_largest = true;
    std::uint8_t largest = 0;
    std::array<std::int32_t, 3> rotation{}, shift{};
};

// Codes one node's residual; `wanted` is ignored when decoding. See entropy/models.h for coders.
template <class Coder>
MotionSteps code_steps(Coder& coder, MotionModels& models, const MotionSteps& wanted) {
    MotionSteps out;
    out.same_largest = coder.bit(models.same_largest, wanted.same_largest);
    if (!out.same_largest) out.largest = static_cast<std::uint8_t>(coder.raw(wanted.largest, 2));
    for (std::size_t c = 0; c < 3; ++c) out.rotation[c] = coder.signed_number(models.rotation, wanted.rotation[c]);
    for (std::size_t c = 0; c < 3; ++c)
        out.shift[c] = coder.signed_number(models.shift[models.of_axis[c]], wanted.shift[c]);
    return out;
}

// What the rotation's residual is relative to.
inline QuantisedRotation start_of(const QuantisedRotation& predicted, const MotionSteps& steps) {
    return steps.same_largest ? predicted : QuantisedRotation{steps.largest, {}};
}

inline QuantisedTransform moved_on(const QuantisedTransform& predicted, const MotionSteps& steps, const Axes& axes,
                                   const NodeMotionSteps& exponents) {
    QuantisedTransform out{start_of(predicted.rotation, steps), {}};
    for (std::size_t c = 0; c < 3; ++c)
        out.rotation.others[c] = static_cast<std::int16_t>(within(
            out.rotation.others[c] + std::int64_t{steps.rotation[c]} * (std::int64_t{1} << exponents.rotation_exponent),
            rotation_limit));
    out.shift = moved_along(predicted.shift, axes, steps.shift, exponents.shift_exponent);
    return out;
}

}  // namespace htvm::internal::node_motion_detail
