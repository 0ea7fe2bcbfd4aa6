// The mapping layer: counts of residuals come back; damaged layers give counts with the right sum, or an error.
#include "codec/bones/mapping.h"

#include <numeric>

#include "small_mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    using namespace htvm::internal;
    using fuzz::require;
    fuzz::FuzzInput input(data, size);
    const auto mesh = fuzz::small_mesh(input);
    const auto prior = make_mapping_prior(mesh.positions, mesh.triangles);
    std::vector<std::uint8_t> eligible;
    if (input.flag())
        for (std::size_t k = 0; k < mesh.positions.size(); ++k) eligible.push_back(input.u8() % 3);
    std::vector<std::uint32_t> residuals_of;
    for (std::size_t k = 0; k < mesh.positions.size(); ++k) {
        const std::uint8_t b = input.u8();
        residuals_of.push_back(eligible.empty() || eligible[k] ? (b < 250 ? b % 4 : 10u * b) : 0);
    }
    const auto sum = std::accumulate(residuals_of.begin(), residuals_of.end(), std::size_t{0});
    const auto bytes = encode_mapping(residuals_of, prior, eligible);
    const auto again = decode_mapping(bytes, sum, prior, eligible);
    require(again && *again == residuals_of, "a mapping comes back as it was encoded");
    const std::size_t count = input.u16();
    const auto bad = input.flag() ? fuzz::damaged(bytes, input) : [&] {
        const auto rest = input.rest();
        return std::vector<std::uint8_t>(rest.begin(), rest.end());
    }();
    const auto decoded = decode_mapping(bad, count, prior, eligible);
    if (!decoded) return 0;
    require(decoded->size() == mesh.positions.size(), "one count a reference vertex");
    const auto found = std::accumulate(decoded->begin(), decoded->end(), std::size_t{0});
    require(found == count || eligible_references(eligible, decoded->size()).empty(), "every residual has a vertex");
    for (std::size_t k = 0; k < eligible.size(); ++k)
        require(eligible[k] || (*decoded)[k] == 0, "residuals refer to eligible vertices alone");
    return 0;
}
