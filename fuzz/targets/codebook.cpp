// Codebooks and their packets, and residual layers coded with them.
#include "codec/bones/codebook.h"

#include "core/lattice.h"
#include "fuzz_input.h"

namespace {

using namespace htvm;
using namespace htvm::internal;
using fuzz::require;

Codebook any_codebook(fuzz::FuzzInput& input) {
    Codebook out;
    out.escape_step = 1 + static_cast<std::int32_t>(input.below(input.flag() ? 1u << 24 : 200));
    const std::int32_t grid = 1 + input.between(0, 40);
    std::uint32_t length = 0;
    for (std::uint32_t n = input.below(48); n > 0; --n) {
        ResidualVector codeword{};
        for (auto& c : codeword) c = input.number((1 << 26) / grid) * grid;
        out.codewords.push_back(codeword);
        length = std::min<std::uint32_t>(length + input.below(12), max_length);
        out.lengths.push_back(static_cast<std::uint16_t>(length));
    }
    out.lengths.push_back(static_cast<std::uint16_t>(input.below(max_length + 1)));
    return out;
}

void check_residuals(const Codebook& codebook, fuzz::FuzzInput& input) {
    QuantisedResiduals wanted;
    const auto size = static_cast<std::uint32_t>(codebook.codewords.size());
    for (std::uint32_t n = input.below(100); n > 0; --n) {
        const auto index = static_cast<std::uint16_t>(input.below(size + 1));
        ResidualVector value{};
        if (index < size)
            value = codebook.codewords[index];
        else
            for (auto& c : value) c = input.number(4 * lattice_limit / codebook.escape_step) * codebook.escape_step;
        wanted.indices.push_back(index);
        wanted.values.push_back(value);
    }
    const auto bytes = encode_residuals(wanted, codebook);
    const auto again = decode_residuals(bytes, wanted.values.size(), codebook);
    require(again && *again == wanted.values, "residuals come back as they were encoded");
    const auto bad = fuzz::damaged(bytes, input);
    const auto decoded = decode_residuals(bad, input.u16(), codebook);
    if (decoded)
        for (const auto& value : *decoded)
            for (const auto c : value) require(std::abs(c) <= 4 * lattice_limit, "residuals stay in range");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    if (input.flag()) {
        const auto payload = input.rest();
        const auto read = read_codebook_payload(payload);
        if (!read) return 0;
        const auto bytes = write_codebook_payload(read->purpose, read->number, read->codebook);
        const auto again = read_codebook_payload(bytes);
        require(again && again->codebook == read->codebook && again->number == read->number,
                "a codebook that was read comes back");
        fuzz::FuzzInput more(payload.data(), payload.size());
        check_residuals(read->codebook, more);
        return 0;
    }
    const auto codebook = any_codebook(input);
    const auto bytes = encode_codebook(codebook);
    const auto again = decode_codebook(bytes);
    require(again && *again == codebook, "a codebook comes back as it was encoded");
    check_residuals(codebook, input);
    const auto bad = decode_codebook(fuzz::damaged(bytes, input));
    if (bad) check_residuals(*bad, input);
    return 0;
}
