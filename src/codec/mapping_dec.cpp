#include "codec/mapping.h"
#include "codec/mapping_models.h"
#include "entropy/range_decoder.h"

namespace htvm {

Result<std::vector<std::uint32_t>> decode_mapping(std::span<const std::uint8_t> bytes, std::size_t references,
                                                  std::size_t residuals) {
    std::vector<std::uint32_t> out(references, 0);
    RangeDecoder decoder(bytes);
    MappingContext context;
    std::size_t left = residuals;
    for (std::size_t k = 0; k + 1 < references && left > 0; ++k) {
        std::uint32_t n = 0;
        if (decoder.bit(context.at_reference())) {
            do {
                ++n;
                --left;
            } while (left > 0 && !decoder.bit(context.at_residual(n)));
        }
        out[k] = n;
        context.next(n);
        if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "mapping layer: it ends too early");
    }
    if (references > 0) out[references - 1] += static_cast<std::uint32_t>(left);
    return out;
}

}  // namespace htvm
