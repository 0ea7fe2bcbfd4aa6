// The range decoder and its symbol models: what any bytes decode to must, when encoded again, decode to the same.
#include "codec/intra/attribute_residual.h"
#include "entropy/range_coder.h"
#include "fuzz_input.h"

namespace {

using namespace htvm;
using namespace htvm::internal;

enum class Kind : std::uint8_t { bit, raw, symbol, number, signed_number, residual, count };

struct Step {
    Kind kind = Kind::bit;
    std::uint8_t size = 1;  // for raw numbers, bits
};

struct Models {
    BinaryModel bit;
    SymbolModel symbol{5};
    UnsignedModel number;
    SignedModel signed_number;
    std::array<ResidualContext, 2> residual;
    ResidualMantissa mantissa;
};

std::int64_t decode(RangeDecoder& decoder, Models& models, Step step) {
    ReadingCoder<RangeDecoder> reading{decoder};
    switch (step.kind) {
        case Kind::bit:
            return decoder.bit(models.bit);
        case Kind::raw:
            return decoder.raw(step.size);
        case Kind::symbol:
            return decode_symbol(decoder, models.symbol);
        case Kind::number:
            return decode_unsigned(decoder, models.number);
        case Kind::signed_number:
            return decode_signed(decoder, models.signed_number);
        default:
            return code_residual(reading, models.residual[0], models.residual[1], models.mantissa, 0);
    }
}

void encode(RangeEncoder& encoder, Models& models, Step step, std::int64_t value) {
    WritingCoder<RangeEncoder> writing{encoder};
    switch (step.kind) {
        case Kind::bit:
            return encoder.bit(models.bit, value != 0);
        case Kind::raw:
            return encoder.raw(static_cast<std::uint32_t>(value), step.size);
        case Kind::symbol:
            return encode_symbol(encoder, models.symbol, static_cast<std::uint32_t>(value));
        case Kind::number:
            return encode_unsigned(encoder, models.number, static_cast<std::uint32_t>(value));
        case Kind::signed_number:
            return encode_signed(encoder, models.signed_number, static_cast<std::int32_t>(value));
        default:
            code_residual(writing, models.residual[0], models.residual[1], models.mantissa,
                          static_cast<std::int32_t>(value));
            return;
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    std::vector<Step> steps;
    for (std::uint32_t n = input.below(256); n > 0; --n) {
        const std::uint8_t b = input.u8();
        steps.push_back(
            {static_cast<Kind>(b % static_cast<std::uint8_t>(Kind::count)), static_cast<std::uint8_t>(1 + b / 8)});
    }
    RangeDecoder first(input.rest());
    Models models;
    std::vector<std::int64_t> values;
    for (const auto step : steps) {
        values.push_back(decode(first, models, step));
        // The one number that bytes can represent and the encoder cannot.
        if (step.kind == Kind::number && values.back() == 0xFFFFFFFF) values.back() = 0;
    }
    RangeEncoder encoder;
    models = {};
    for (std::size_t i = 0; i < steps.size(); ++i) encode(encoder, models, steps[i], values[i]);
    const auto bytes = encoder.finish();
    RangeDecoder second(bytes);
    models = {};
    for (std::size_t i = 0; i < steps.size(); ++i)
        fuzz::require(decode(second, models, steps[i]) == values[i], "numbers come back as they were encoded");
    fuzz::require(!second.exhausted(), "what was encoded does not end too early");
    return 0;
}
