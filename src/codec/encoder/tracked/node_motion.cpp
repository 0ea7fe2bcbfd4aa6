#include "codec/encoder/tracked/node_motion.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>

#include "codec/tracked/node_motion_walk.h"
#include "entropy/cost.h"
#include "entropy/models.h"

namespace htvm::internal {

namespace {

using namespace node_motion_detail;

// Rounded slightly towards zero: a step that hardly helps is not worth its bits.
std::int32_t quantised(double difference, int exponent) {
    constexpr double dead_zone = 0.6;
    const double size = static_cast<double>(std::int64_t{1} << exponent);
    const double magnitude = std::floor(std::abs(difference) / size + (1 - dead_zone));
    return static_cast<std::int32_t>(std::copysign(magnitude, difference));
}

MotionSteps steps_between(const QuantisedTransform& predicted, const QuantisedTransform& wanted, const Axes& axes,
                          const NodeMotionSteps& exponents) {
    MotionSteps out;
    out.largest = wanted.rotation.largest;
    out.same_largest = predicted.rotation.largest == out.largest;
    const auto start = start_of(predicted.rotation, out);
    for (std::size_t c = 0; c < 3; ++c)
        out.rotation[c] = quantised(wanted.rotation.others[c] - start.others[c], exponents.rotation_exponent);
    const Vector3d off = {static_cast<double>(wanted.shift.x) - predicted.shift.x,
                          static_cast<double>(wanted.shift.y) - predicted.shift.y,
                          static_cast<double>(wanted.shift.z) - predicted.shift.z};
    for (std::size_t k = 0; k < 3; ++k)
        out.shift[k] =
            quantised(off[0] * axes[k][0] + off[1] * axes[k][1] + off[2] * axes[k][2], exponents.shift_exponent);
    return out;
}

Eigen::Quaterniond quaternion_of(const QuantisedRotation& rotation) {
    std::array<double, 4> q{};
    for (std::size_t i = 0, other = 0; i < 4; ++i)
        q[i] = i == rotation.largest ? static_cast<double>(1 << rotation_bits) : rotation.others[other++];
    return {q[0], q[1], q[2], q[3]};
}

// How a node moves from one transform to another, as DeformationForm has it; for small turns.
Vector6 change_between(const QuantisedTransform& from, const QuantisedTransform& to) {
    const auto turn = quaternion_of(to.rotation) * quaternion_of(from.rotation).conjugate();
    Vector6 out;
    out << 2 * turn.vec() / turn.w(), 1.0 * to.shift.x - from.shift.x, 1.0 * to.shift.y - from.shift.y,
        1.0 * to.shift.z - from.shift.z;
    return out;
}

// What one step of each of the six numbers changes, near the wanted transform.
Matrix6 change_by_steps(const QuantisedTransform& coded, const QuantisedTransform& wanted, const Axes& axes,
                        const NodeMotionSteps& exponents) {
    const auto back = quaternion_of(wanted.rotation).conjugate();
    const auto turn = quaternion_of(coded.rotation) * back;
    Matrix6 out = Matrix6::Zero();
    int column = 0;
    for (std::size_t i = 0; i < 4; ++i) {
        if (i == coded.rotation.largest) continue;
        const auto by = Eigen::Quaterniond(i == 0, i == 1, i == 2, i == 3) * back;
        out.col(column++).head<3>() = 2 * (by.vec() - turn.vec() * (by.w() / turn.w())) / turn.w() *
                                      static_cast<double>(std::int64_t{1} << exponents.rotation_exponent);
    }
    for (std::size_t k = 0; k < 3; ++k, ++column)
        for (std::size_t axis = 0; axis < 3; ++axis)
            out(3 + static_cast<int>(axis), column) =
                axes[k][axis] * static_cast<double>(std::int64_t{1} << exponents.shift_exponent);
    return out;
}

double bits_of(SignedModel& model, std::int32_t value) {
    CostOfNext cost;
    encode_signed(cost, model, value);
    return cost.bits();
}

// What a node's residual costs: x' F x + 2 x' g + price * bits, where x are the steps beyond `origin`, three of the
// turn and three of the shift.
struct ResidualCost {
    MotionModels& models;
    std::array<std::int32_t, 6> origin;
    Matrix6 form;
    Vector6 gradient;
    double price;

    SignedModel& model(std::size_t k) const { return k < 3 ? models.rotation : models.shift[models.of_axis[k - 3]]; }
    double of(const Vector6& x) const {
        double bits = 0;
        for (std::size_t k = 0; k < 6; ++k)
            bits += bits_of(model(k), origin[k] + static_cast<std::int32_t>(x[static_cast<int>(k)]));
        return x.dot(form * x) + 2 * gradient.dot(x) + price * bits;
    }
};

// Number by number, each the best that there is while the others stay, until none changes.
Vector6 descend(const ResidualCost& cost, Vector6 x) {
    constexpr int rounds = 3;
    constexpr double most = 1 << 20;  // steps
    for (int round = 0; round < rounds; ++round) {
        const Vector6 last = x;
        for (std::size_t k = 0; k < 6; ++k) {
            const auto i = static_cast<int>(k);
            const double curve = cost.form(i, i);
            const double best = x[i] - (cost.gradient[i] + cost.form.row(i).dot(x)) / curve;
            if (!(curve > 0 && std::abs(best) < most)) continue;
            double least = std::numeric_limits<double>::max();
            const double down = std::floor(best), as_predicted = -cost.origin[k];
            for (const double candidate : {x[i], as_predicted, down - 1, down, down + 1, down + 2}) {
                const auto coded = cost.origin[k] + static_cast<std::int32_t>(candidate);
                const double off = candidate - best;
                const double value = curve * off * off + cost.price * bits_of(cost.model(k), coded);
                if (value >= least) continue;
                least = value;
                x[i] = candidate;
            }
        }
        if (x == last) break;
    }
    return x;
}

// The residual with the least cost. form: of this node; pull: by what the nodes before it were sent with. Searched from
// the nearest residual and from none.
MotionSteps cheapest(MotionModels& models, const QuantisedTransform& predicted, const QuantisedTransform& wanted,
                     const Axes& axes, const NodeMotionOptions& options, const Matrix6& form, const Vector6& pull) {
    MotionSteps out = steps_between(predicted, wanted, axes, options.steps);
    const auto nearest = moved_on(predicted, out, axes, options.steps);
    const Matrix6 change = change_by_steps(nearest, wanted, axes, options.steps);
    ResidualCost cost{models,
                      {},
                      change.transpose() * form * change,
                      change.transpose() * (form * change_between(wanted, nearest) + pull),
                      options.price};
    Vector6 none;
    for (std::size_t k = 0; k < 3; ++k) {
        cost.origin[k] = out.rotation[k];
        cost.origin[3 + k] = out.shift[k];
    }
    for (std::size_t k = 0; k < 6; ++k) none[static_cast<int>(k)] = -cost.origin[k];
    Vector6 best = descend(cost, Vector6::Zero());
    const Vector6 other = descend(cost, none);
    if (cost.of(other) < cost.of(best)) best = other;
    for (std::size_t k = 0; k < 3; ++k) {
        out.rotation[k] = cost.origin[k] + static_cast<std::int32_t>(best[static_cast<int>(k)]);
        out.shift[k] = cost.origin[3 + k] + static_cast<std::int32_t>(best[static_cast<int>(3 + k)]);
    }
    return out;
}

}  // namespace

EncodedNodeMotion encode_node_motion(std::span<const QuantisedTransform> wanted, const NodeGraph& graph,
                                     std::span<const QuantisedTransform> before, const NodeMotionOptions& options) {
    EncodedNodeMotion out;
    WritingCoder<DecisionLog> coder{out.decisions};
    MotionModels models;
    models.of_axis = surface_models;
    const bool weighed = options.form && options.form->diagonal.size() == wanted.size();
    std::vector<Vector6> pull(weighed ? wanted.size() : 0, Vector6::Zero());  // on each node, by those before it
    auto block = weighed ? options.form->above.begin() : std::vector<DeformationForm::Block>::const_iterator{};
    for (std::size_t node = 0; node < wanted.size(); ++node) {
        const auto predicted = predict(node, out.transforms, before, graph);
        const auto axes = surface_axes(graph.normals[node], predicted.rotation);
        const auto steps =
            weighed ? cheapest(models, predicted, wanted[node], axes, options, options.form->diagonal[node], pull[node])
                    : steps_between(predicted, wanted[node], axes, options.steps);
        code_steps(coder, models, steps);
        out.transforms.push_back(moved_on(predicted, steps, axes, options.steps));
        if (!weighed) continue;
        const Vector6 left = change_between(wanted[node], out.transforms[node]);
        for (; block != options.form->above.end() && block->row == node; ++block)
            pull[block->column].noalias() += block->matrix.transpose() * left;
    }
    return out;
}

}  // namespace htvm::internal
