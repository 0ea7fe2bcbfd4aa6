#include "codec/mapping.h"
#include "codec/mapping_models.h"
#include "entropy/range_encoder.h"

namespace htvm {

std::vector<std::uint8_t> encode_mapping(std::span<const std::uint32_t> residuals_of) {
    std::uint64_t left = 0;
    for (const auto n : residuals_of) left += n;
    RangeEncoder encoder;
    MappingContext context;
    // Behind the last residual, and behind the last reference vertex, both sides know what follows.
    for (std::size_t k = 0; k + 1 < residuals_of.size() && left > 0; ++k) {
        const std::uint32_t n = residuals_of[k];
        encoder.bit(context.at_reference(), n > 0);
        for (std::uint32_t i = 1; i <= n; ++i) {
            --left;
            if (left > 0) encoder.bit(context.at_residual(i), i == n);
        }
        context.next(n);
    }
    return encoder.finish();
}

}  // namespace htvm
