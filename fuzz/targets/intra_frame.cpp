// What an I-frame predicts from its mesh: positions come back exactly, colours within half a step, other attributes
// exactly, for any connectivity; damaged layers give values in range, or an error.
#include <cstdlib>

#include "codec/intra/attribute_values.h"
#include "codec/intra/colours.h"
#include "codec/intra/positions.h"
#include "small_mesh.h"

namespace {

using namespace htvm;
using namespace htvm::internal;
using fuzz::require;

template <class Value>
void check_attribute(std::size_t count, const Neighbours& neighbours, fuzz::FuzzInput& input) {
    std::vector<Value> values(count), predictions(count);
    for (auto& value : values)
        for (auto& c : value) c = input.number(attribute_limit);
    for (auto& value : predictions)
        for (auto& c : value) c = input.number(attribute_limit);
    const auto check = [&](const auto& from) {
        const auto bytes = encode_attribute_values(values, from);
        const auto again = decode_attribute_values<Value>(bytes, from);
        require(again && *again == values, "attributes come back as they were encoded");
        const auto bad = decode_attribute_values<Value>(fuzz::damaged(bytes, input), from);
        if (!bad) return;
        for (const auto& value : *bad)
            for (const auto c : value) require(std::abs(c) <= attribute_limit, "attributes stay in range");
    };
    check(neighbours);
    check(predictions);
}

void check_colours(const std::vector<LatticePoint>& positions, const Neighbours& neighbours, fuzz::FuzzInput& input) {
    std::vector<Colour> colours(positions.size());
    for (auto& colour : colours)
        for (auto& c : colour) c = input.u8();
    const auto step = static_cast<std::int32_t>(1 + input.below(255));
    const auto encoded = encode_intra_colours(colours, positions, neighbours, step);
    const auto again = decode_intra_colours(encoded.bytes, positions, neighbours, step);
    require(again && *again == encoded.decoded, "the colours that the encoder promised");
    for (std::size_t k = 0; k < colours.size(); ++k)
        for (std::size_t c = 0; c < 3; ++c)
            require(std::abs(colours[k][c] - (*again)[k][c]) <= step / 2, "colours within half a step");
    (void)decode_intra_colours(fuzz::damaged(encoded.bytes, input), positions, neighbours, step);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::FuzzInput input(data, size);
    const auto mesh = fuzz::small_mesh(input);
    const auto neighbours = find_neighbours(mesh.triangles, mesh.positions.size());
    require(neighbours.has_value(), "any mesh has neighbours");
    const auto bytes = encode_intra_positions(mesh.positions, *neighbours);
    const auto again = decode_intra_positions(bytes, *neighbours);
    require(again && *again == mesh.positions, "positions come back as they were encoded");
    const std::uint8_t what = input.u8() % 4;
    if (what == 0) {
        const bool raw = input.flag();
        const auto flipped = fuzz::damaged(bytes, input);
        const auto bad = decode_intra_positions(raw ? input.rest() : flipped, *neighbours);
        if (bad) require(fuzz::all_on_lattice(*bad), "positions stay on the lattice");
    }
    if (what == 1) check_colours(mesh.positions, *neighbours, input);
    if (what == 2) check_attribute<std::array<std::int32_t, 2>>(mesh.positions.size(), *neighbours, input);
    if (what == 3) check_attribute<std::array<std::int32_t, 3>>(mesh.positions.size(), *neighbours, input);
    return 0;
}
