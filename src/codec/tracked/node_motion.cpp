#include "codec/tracked/node_motion.h"

#include <algorithm>
#include <span>

#include "codec/tracked/node_motion_walk.h"
#include "entropy/models.h"

namespace htvm::internal {

namespace {

using namespace node_motion_detail;

// As version 1 of the stream has it: only the lowest neighbour counts.
QuantisedTransform predict_by_one(std::size_t node, Transforms decoded, Transforms before, const NodeGraph& graph) {
    const auto& lower = graph.lower[node];
    if (!before.empty())
        return predict_from_before(node, decoded, before,
                                   std::span(lower).first(std::min<std::size_t>(lower.size(), 1)));
    if (lower.empty()) return {};
    return {decoded[lower.front()].rotation, shift_with(node, lower.front(), decoded, graph)};
}

}  // namespace

Result<std::vector<QuantisedTransform>> decode_node_motion(RangeDecoder& decoder, const NodeMotionSteps& steps,
                                                           const NodeGraph& graph,
                                                           std::span<const QuantisedTransform> before,
                                                           NodeMotionSyntax syntax) {
    const std::size_t nodes = graph.pivots.size();
    const bool along = syntax == NodeMotionSyntax::surface;
    ReadingCoder<RangeDecoder> coder{decoder};
    MotionModels models;
    if (along) models.of_axis = surface_models;
    std::vector<QuantisedTransform> out;
    out.reserve(nodes);
    for (std::size_t node = 0; node < nodes; ++node) {
        const auto predicted = along ? predict(node, out, before, graph) : predict_by_one(node, out, before, graph);
        const auto axes = along ? surface_axes(graph.normals[node], predicted.rotation) : axes_of_space;
        out.push_back(moved_on(predicted, code_steps(coder, models, {}), axes, steps));
        if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "node motion: its run ends too early");
    }
    return out;
}

}  // namespace htvm::internal
