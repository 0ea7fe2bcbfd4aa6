// Entropy-constrained vector quantisation (paper, section IV-C2; Chou, Lookabaugh and Gray 1989), encoder side:
// training a codebook on a frame's residuals, and choosing for each residual the codeword that minimises
// squared error + lambda * bits.
#pragma once

#include <span>

#include "codec/paper/codebook.h"
#include "core/thread.h"

namespace htvm::internal {

struct QuantiserOptions {
    std::int32_t step = 64;        // the cell of the starting codebook and of the escape, in the residuals' units; >= 1
    double lambda = 0.12;          // squared error worth one bit, in units of step^2; 0 takes the nearest codeword
    int iterations = 2;            // rounds of the generalised Lloyd iteration
    std::size_t training = 16384;  // residuals trained on, evenly spread; 0: all
    Threads threads = {};
};

// Starts from the cells of a cubic lattice of the given step that hold at least three residuals, then alternates the
// best codeword for each residual with the centroid and code length of each codeword. Codewords that stop paying for
// their place in the codebook are dropped; what they held escapes.
Codebook train_codebook(std::span<const ResidualVector> residuals, const QuantiserOptions& options);

// The best codeword, or the escape, for every residual.
QuantisedResiduals quantise(std::span<const ResidualVector> residuals, const Codebook& codebook,
                            const QuantiserOptions& options);

// Squared error + lambda * bits over all residuals, with the codebook's code lengths as bits: what training minimises.
double lagrangian(std::span<const ResidualVector> residuals, const QuantisedResiduals& quantised,
                  const Codebook& codebook, const QuantiserOptions& options);

}  // namespace htvm::internal
