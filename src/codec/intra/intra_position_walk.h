// What encoder and decoder of intra positions share: the walk over the vertices, the prediction of each and the
// contexts of its residual. Integers throughout; positions and their differences are in sixteenths of a step.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "codec/intra/attribute_residual.h"
#include "codec/intra/intra_neighbours.h"
#include "core/lattice.h"

namespace htvm::internal {

using Triple = std::array<std::int64_t, 3>;

// Where the known vertices round a vertex suggest that it lies: offsets from the mean of its neighbours.
struct PositionFeatures {
    Triple mean{};            // of the neighbours; where there are none, the vertex coded before
    Triple across{};          // mean of the parallelograms across an edge, less `mean`; zero where there are none
    Triple ending{};          // likewise of the parallelograms whose shared edge the vertex ends
    Triple outer{};           // mean of the neighbours' own neighbour means, less `mean`
    Triple normal{};          // of the known triangles, components below 2^28; zero where there are none
    std::int64_t spread = 0;  // mean distance of the parallelograms from their mean, summed over the components
    std::size_t parallelograms = 0;
    bool has_ending = false;
};

inline constexpr std::size_t weight_count = 3;                                 // across, ending, outer
using PositionWeights = std::array<std::array<std::int8_t, weight_count>, 2>;  // by has_ending, in 1/64

// What the coding of a vertex leaves behind for the next ones, by vertex.
struct PositionHistory {
    explicit PositionHistory(std::size_t vertex_count)
        : ring_mean(vertex_count), along(vertex_count, 0), across(vertex_count, 0) {}
    std::vector<std::array<std::int32_t, 3>> ring_mean;  // mean of the neighbours known when it was coded
    std::vector<std::int32_t> along, across;             // its residual along the surface and across it
};

// Contexts by the component's role: roles 0 and 1 run along the surface, role 2 across it.
class PositionContexts {
public:
    ResidualContext& by_activity(std::size_t role, std::int64_t activity);
    ResidualContext& by_shape(std::size_t role, const PositionFeatures& features, std::int64_t fraction);
    ResidualMantissa& mantissa(std::size_t role) { return mantissa_[role]; }

private:
    static constexpr std::size_t activities = 12, counts = 5, fractions = 4, extents = 8;
    std::array<std::array<ResidualContext, activities>, 3> activity_;
    std::array<std::array<ResidualContext, counts * fractions * extents>, 3> shape_;
    std::array<ResidualMantissa, 3> mantissa_;
};

// The features of the vertex at `rank`; records its ring mean.
PositionFeatures position_features(std::span<const LatticePoint> points, const Neighbours& neighbours, std::size_t rank,
                                   PositionHistory& history);

// The mean and the weighted offsets, kept within reach of the lattice.
Triple predict_position(const PositionFeatures& features, const PositionWeights& weights);

// The activity round a vertex, per component along and across the surface, from the residuals of its neighbours.
struct Activity {
    std::int64_t along = 0, across = 0;
};
Activity activity_around(std::span<const std::uint32_t> around, const PositionHistory& history);

// Sixteenths to the nearest whole, halves upwards.
inline std::int64_t whole(std::int64_t sixteenths) { return (sixteenths + 8) >> 4; }

// Codes the vertex at `rank`, whose features are given. code(context, context, mantissa, residual) puts the residual
// into the stream and returns it, or, decoding, ignores it and returns what the stream says. The point is then set from
// what was returned; false where that is off the lattice.
template <class Code>
bool code_position(std::vector<LatticePoint>& points, const Neighbours& neighbours, std::size_t rank,
                   const PositionFeatures& features, const PositionWeights& weights, PositionHistory& history,
                   PositionContexts& contexts, Code&& code) {
    const std::uint32_t vertex = neighbours.order[rank];
    const Triple predicted = predict_position(features, weights);
    const Activity around = activity_around(neighbours.neighbours_of(rank), history);
    LatticePoint& point = points[vertex];
    std::array<std::int32_t*, 3> component{&point.x, &point.y, &point.z};
    const Triple& n = features.normal;
    std::size_t steep = std::abs(n[1]) > std::abs(n[0]) ? 1 : 0;
    if (std::abs(n[2]) > std::abs(n[steep])) steep = 2;
    const std::array<std::size_t, 3> axis{(steep + 1) % 3, (steep + 2) % 3, steep};
    Triple off{};  // by role
    for (std::size_t role = 0; role < 3; ++role) {
        std::int64_t at = predicted[axis[role]];
        std::int64_t activity = 3 * around.along + features.spread;
        if (role == 1) activity = 2 * around.along + features.spread / 2 + 2 * std::abs(off[0]);
        if (role == 2) {
            if (n[steep] != 0) at -= (n[axis[0]] * off[0] + n[axis[1]] * off[1]) / n[steep];
            activity = 3 * around.across + (features.spread + std::abs(off[0]) + std::abs(off[1])) / 2;
        }
        const std::int64_t nearest = whole(at), fraction = at - 16 * nearest;
        // Mirrored so that the prediction is always rounded downwards: one context learns both sides.
        const std::int64_t side = fraction < 0 ? -1 : 1;
        const std::int64_t wanted = side * (*component[axis[role]] - nearest);
        const std::int64_t value = nearest + side * code(contexts.by_activity(role, activity),
                                                         contexts.by_shape(role, features, side * fraction),
                                                         contexts.mantissa(role), static_cast<std::int32_t>(wanted));
        if (value < -lattice_limit || value > lattice_limit) return false;
        *component[axis[role]] = static_cast<std::int32_t>(value);
        off[role] = 16 * value - (role == 2 ? at : predicted[axis[role]]);
    }
    constexpr std::int64_t remembered = 1 << 20;  // no context tells more apart
    history.along[vertex] = static_cast<std::int32_t>(std::min((std::abs(off[0]) + std::abs(off[1])) / 2, remembered));
    history.across[vertex] = static_cast<std::int32_t>(std::min(std::abs(off[2]), remembered));
    return true;
}

}  // namespace htvm::internal
