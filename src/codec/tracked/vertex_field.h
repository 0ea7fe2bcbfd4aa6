// A smooth vector field on the vertices of a mesh that both sides know: how far a tracked surface lies from where its
// reference was moved to, or how its colours differ from the reference's.
//
// The field is coded from coarse to fine over a VertexHierarchy: the mean of all vertices, then for each pair of nodes
// the difference of their two means, predicted from the slopes of the decoded means round the pair (and, where there is
// a history, from the frame before), quantised by a step that makes every difference count by the squared error it
// causes. Closed loop: no error builds up. The encoder zeroes what costs more bits than it is worth.
//
// Range coded: the mean of each component, and level by level, component by component, whether all differences are as
// predicted, how they are predicted, and the quantised rests.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "codec/reference/vertex_hierarchy.h"
#include "core/thread.h"
#include "entropy/decision_log.h"
#include "entropy/range_coder.h"
#include "htvm/result.hpp"

namespace htvm::internal {

inline constexpr std::size_t most_field_components = 3;
inline constexpr std::int32_t field_limit = 1 << 20;  // of every component's absolute value

struct FieldOptions {
    // By component, in the values' unit: what a vertex's own error is quantised by, 1/256 to 2^20; 0: not coded, the
    // component decodes to 0 everywhere. A turned field has the step of a direction in space for each.
    std::array<double, most_field_components> step{32, 32, 32};
    // What a bit is worth, in squared steps: from 0 (always the nearest) on. 0.1 to 0.15 gives the least error for the
    // bits at every rate; more wastes bits on large errors, which a larger step would spare.
    double lambda = 0.12;
    // Code sum, and two differences, of three components that resemble each other: red, green and blue.
    bool turned = false;
    // Says of each vertex whether its value counts; none: all do. The others take what is predicted, and cost nothing.
    std::span<const std::uint8_t> counts = {};
    double first_weight = 1;  // of a turned field: the sum's step is step[0] / first_weight
};

// How a field is quantised, which the decoder must know.
struct FieldSteps {
    static constexpr std::uint32_t most = 1u << 28;
    bool turned = false;
    std::array<std::uint32_t, most_field_components> step{};  // in 1/256 of the values' unit; 0: not coded
    bool operator==(const FieldSteps&) const = default;
};

// One component of a decoded field in 1/256 of the values' unit, with what predicts the next frame.
struct FieldPlane {
    std::vector<std::vector<std::int32_t>> mean;       // [0]: by vertex, [1 + k]: by node of level k
    std::vector<std::vector<std::int32_t>> slope;      // [k]: by node of level k, the difference that the means predict
    std::vector<std::vector<std::uint8_t>> magnitude;  // [k]: by node of level k, of the quantised rest, at most 255
};

// What a frame leaves for the next on the same hierarchy; the same on both sides.
struct FieldHistory {
    bool turned = false;
    std::vector<FieldPlane> planes;  // one per component
};

struct EncodedField {
    FieldSteps steps;
    DecisionLog decisions;
    std::vector<std::int32_t> values;  // as decode_field gives them
    FieldHistory history;
};

struct DecodedField {
    std::vector<std::int32_t> values;  // vertices x components, |.| <= 4 * field_limit whatever the bytes say
    FieldHistory history;
};

// values: vertices x components, the components of a vertex side by side. before: the history of a frame on the same
// hierarchy, or null; it is used where it predicts better. Errors: bad_input where sizes do not fit, a value is beyond
// field_limit, a step or lambda out of range, or a field other than of three components is to be turned.
// threads: two at most serve, three components side by side; any number gives the same decisions. beside: other work
// for the second of them, done when the call returns, but for one that fails.
Result<EncodedField> encode_field(const VertexHierarchy& hierarchy, std::span<const std::int32_t> values,
                                  std::size_t components, const FieldOptions& options = {},
                                  const FieldHistory* before = nullptr, Threads threads = {},
                                  const std::function<void()>& beside = {});

// steps, before: as the encoder had them. Errors: corrupt_stream where the run ends too early; bad_input where steps
// cannot be, or `before` is of another mesh.
Result<DecodedField> decode_field(RangeDecoder& decoder, const FieldSteps& steps, const VertexHierarchy& hierarchy,
                                  std::size_t components, const FieldHistory* before = nullptr);

}  // namespace htvm::internal
