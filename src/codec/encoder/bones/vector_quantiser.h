// Entropy-constrained vector quantisation (paper, section IV-C2; Chou, Lookabaugh and Gray 1989), encoder side: trains
// a codebook on a frame's residuals, and chooses for each residual the codeword that minimises squared error + lambda *
// bits.
#pragma once

#include <span>

#include "codec/bones/codebook.h"
#include "core/thread.h"

namespace htvm::internal {

struct QuantiserOptions {
    std::int32_t step = 64;        // cell size of the starting codebook and of the escape, in the residuals' units; >=
                                   // 1
    double lambda = 0.12;          // squared error that is worth one bit, in units of step^2; 0: the nearest codeword
    int iterations = 2;            // rounds of the generalised Lloyd iteration
    std::size_t training = 16384;  // number of residuals to train on, evenly spread; 0: all
    Threads threads = {};
};

// Starts from those cells of a cubic lattice of the given step that hold at least three residuals. Then alternates
// between finding the best codeword of each residual, and setting each codeword's centroid and code length. Codewords
// that no longer pay for their place in the codebook are dropped; their residuals become escapes.
Codebook train_codebook(std::span<const ResidualVector> residuals, const QuantiserOptions& options);

// The best codeword, or the escape, for every residual.
QuantisedResiduals quantise(std::span<const ResidualVector> residuals, const Codebook& codebook,
                            const QuantiserOptions& options);

// Squared error + lambda * bits over all residuals, with the codebook's code lengths as bits: what training minimises.
double lagrangian(std::span<const ResidualVector> residuals, const QuantisedResiduals& quantised,
                  const Codebook& codebook, const QuantiserOptions& options);

}  // namespace htvm::internal
