#include "codec/paper/mapping.h"
#include "codec/paper/mapping_models.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

struct Writer {
    RangeEncoder& encoder;
    bool bit(BinaryModel& model, bool wanted) {
        encoder.bit(model, wanted);
        return wanted;
    }
};

}  // namespace

std::vector<std::uint8_t> encode_mapping(std::span<const std::uint32_t> residuals_of, const MappingPrior& prior,
                                         std::span<const std::uint8_t> eligible) {
    std::uint64_t left = 0;
    for (const auto n : residuals_of) left += n;
    RangeEncoder encoder;
    Writer writer{encoder};
    MappingContext context(prior);
    const auto references = eligible_references(eligible, residuals_of.size());
    // Behind the last residual, and behind the last reference vertex, both sides know what follows.
    for (std::size_t i = 0; i + 1 < references.size() && left > 0; ++i) {
        const std::uint32_t k = references[i], n = residuals_of[k];
        context.stand_on(k, residuals_of);
        context.code(writer, 0, n > 0);
        for (std::uint32_t r = 1; r <= n; ++r) {
            --left;
            if (left > 0) context.code(writer, r, r == n);
        }
        context.leave(n);
    }
    return encoder.finish();
}

}  // namespace htvm::internal
