#include "codec/bones/mapping.h"

#include <algorithm>
#include <array>

#include "entropy/mixing.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

// Walks the graph of Fig. 4 and codes the bit c_q of each node. The contexts: the last runs tell how dense residuals
// are here; the area tells that a large patch is hit more often; the surplus of the neighbours tells that a residual
// which a neighbour took is not taken twice. The contexts from the mesh save 6 % of the layer.
class MappingContext {
public:
    explicit MappingContext(const MappingPrior& prior) : prior_(prior) {}
    // Moves to reference vertex k; residuals_of holds the counts of the vertices before it.
    void stand_on(std::size_t k, std::span<const std::uint32_t> residuals_of) {
        area_ = prior_.area_class[k];
        std::uint32_t known = 0;
        std::int32_t surplus = 0;
        for (std::uint32_t i = prior_.first_neighbour[k]; i < prior_.first_neighbour[k + 1]; ++i) {
            ++known;
            surplus += static_cast<std::int32_t>(std::min<std::uint32_t>(residuals_of[prior_.neighbours[i]], 3)) - 1;
        }
        known_ = std::min<std::uint32_t>(known, 7);
        surplus_ = static_cast<std::uint32_t>(std::clamp(surplus, -4, 4) + 4);
    }
    // The n-th decision at this vertex. At its own node (n = 0): a residual follows (1) or the next reference vertex
    // (0). At the node of its n-th residual: there is no further residual (1) or one more (0).
    template <class Coder>
    bool code(Coder& coder, std::uint32_t n, bool wanted) {
        const std::uint32_t stage = std::min<std::uint32_t>(n, 5);
        return code_mixed(
            coder, mixers_[stage],
            std::array<BinaryModel*, 4>{&by_runs_[stage][last_][before_][before_that_], &by_area_[stage][area_][last_],
                                        &by_neighbours_[stage][known_][surplus_], &by_both_[stage][area_][surplus_]},
            wanted);
    }
    // Leaves a reference vertex that had n residuals.
    void leave(std::uint32_t n) {
        before_that_ = std::min<std::uint32_t>(before_, 2);
        before_ = last_;
        last_ = std::min<std::uint32_t>(n, 3);
    }

private:
    const MappingPrior& prior_;
    std::uint32_t area_ = 0, known_ = 0, surplus_ = 4;
    std::uint32_t last_ = 1, before_ = 1, before_that_ = 1;
    std::array<Mixer<4>, 6> mixers_;
    std::array<std::array<std::array<std::array<BinaryModel, 3>, 4>, 4>, 6> by_runs_;
    std::array<std::array<std::array<BinaryModel, 4>, 10>, 6> by_area_;
    std::array<std::array<std::array<BinaryModel, 9>, 8>, 6> by_neighbours_;
    std::array<std::array<std::array<BinaryModel, 9>, 10>, 6> by_both_;
};

// Codes how `left` residuals are distributed over the reference vertices. The encoder's counts stay as they are; the
// decoder's are set to what is read. After the last residual, and after the last reference vertex, nothing more needs
// to be coded. False if the bytes end too early.
template <class Coder>
bool code_counts(Coder coder, const MappingPrior& prior, std::span<const std::uint32_t> references, std::size_t left,
                 std::span<std::uint32_t> residuals_of) {
    if (references.empty()) return true;
    MappingContext context(prior);
    for (std::size_t i = 0; i + 1 < references.size() && left > 0; ++i) {
        const std::uint32_t k = references[i], wanted = residuals_of[k];
        std::uint32_t n = 0;
        context.stand_on(k, residuals_of);
        if (context.code(coder, 0, wanted > 0)) {
            do {
                ++n;
                --left;
            } while (left > 0 && !context.code(coder, n, n == wanted));
        }
        residuals_of[k] = n;
        context.leave(n);
        if constexpr (!Coder::writes)
            if (coder.reader.exhausted()) return false;
    }
    residuals_of[references.back()] = static_cast<std::uint32_t>(left);
    return true;
}

}  // namespace

std::vector<std::uint32_t> eligible_references(std::span<const std::uint8_t> eligible, std::size_t references) {
    std::vector<std::uint32_t> out;
    out.reserve(references);
    for (std::uint32_t k = 0; k < references; ++k)
        if (eligible.empty() || eligible[k] != 0) out.push_back(k);
    return out;
}

std::vector<std::uint8_t> encode_mapping(std::span<const std::uint32_t> residuals_of, const MappingPrior& prior,
                                         std::span<const std::uint8_t> eligible) {
    std::size_t residuals = 0;
    for (const auto n : residuals_of) residuals += n;
    std::vector<std::uint32_t> counts(residuals_of.begin(), residuals_of.end());
    RangeEncoder encoder;
    code_counts(WritingCoder<RangeEncoder>{encoder}, prior, eligible_references(eligible, counts.size()), residuals,
                std::span(counts));
    return encoder.finish();
}

Result<std::vector<std::uint32_t>> decode_mapping(std::span<const std::uint8_t> bytes, std::size_t residuals,
                                                  const MappingPrior& prior, std::span<const std::uint8_t> eligible) {
    std::vector<std::uint32_t> out(prior.area_class.size(), 0);
    RangeDecoder decoder(bytes);
    if (!code_counts(ReadingCoder<RangeDecoder>{decoder}, prior, eligible_references(eligible, out.size()), residuals,
                     std::span(out)))
        return fail(ErrorKind::corrupt_stream, "mapping layer: it ends too early");
    return out;
}

}  // namespace htvm::internal
