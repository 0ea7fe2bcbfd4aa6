// The encoder's side of node motion: which residual of each node is sent.
//
// What the registration found is partly jitter: along the surface the data leave a node's motion open. So each node's
// residual is the one with the least D + price R: R are the bits that it takes under the models as they are, D is what
// it adds to the squared distances from the captured surface, by the form that the registration leaves. What the nodes
// before it were sent with counts: a node makes up for what they left.
#pragma once

#include <span>
#include <vector>

#include "codec/tracked/node_motion.h"
#include "entropy/decision_log.h"
#include "surface/tracked_registration.h"

namespace htvm::internal {

struct NodeMotionOptions {
    NodeMotionSteps steps;
    const DeformationForm* form = nullptr;  // of the wanted motion, in lattice units; null, or without handles: each
                                            // residual is rounded for itself
    double price = 0;                       // what a bit is worth, in the form's units
};

struct EncodedNodeMotion {
    DecisionLog decisions;
    std::vector<QuantisedTransform> transforms;  // the transforms that the decoder will have
};

// wanted: one per node, as registered. before: the transforms of the frame that predicts them, or empty.
EncodedNodeMotion encode_node_motion(std::span<const QuantisedTransform> wanted, const NodeGraph& graph,
                                     std::span<const QuantisedTransform> before, const NodeMotionOptions& options);

}  // namespace htvm::internal
