// The vertex hierarchy of any mesh, and fields on it: they come back as the encoder promised, frame after frame;
// damaged layers give values in range, or an error.
#include "codec/tracked/vertex_field.h"

#include <cstdlib>
#include <optional>

#include "small_mesh.h"

namespace {

htvm::Result<htvm::internal::DecodedField> decoded_from(std::span<const std::uint8_t> run,
                                                        const htvm::internal::FieldSteps& steps,
                                                        const htvm::internal::VertexHierarchy& hierarchy,
                                                        std::size_t components,
                                                        const htvm::internal::FieldHistory* before) {
    htvm::internal::RangeDecoder decoder(run);
    return htvm::internal::decode_field(decoder, steps, hierarchy, components, before);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace htvm;
    using namespace htvm::internal;
    using fuzz::require;
    fuzz::FuzzInput input(data, size);
    const auto mesh = fuzz::small_mesh(input);
    const auto hierarchy = build_vertex_hierarchy(mesh.positions, mesh.triangles);
    require(hierarchy.has_value(), "any mesh has a hierarchy");
    const std::size_t components = 1 + input.below(3);
    FieldOptions options;
    options.turned = components == 3 && input.flag();
    for (auto& step : options.step) step = input.below(6) ? (1 + input.below(5000)) / 16.0 : 0;
    options.lambda = input.below(4) / 8.0;
    std::optional<FieldHistory> before;
    FieldSteps steps;
    for (int frame = 0; frame < 2; ++frame) {
        std::vector<std::int32_t> values;
        for (std::size_t k = 0; k < mesh.positions.size() * components; ++k)
            values.push_back(input.number(field_limit));
        const auto encoded = encode_field(*hierarchy, values, components, options, before ? &*before : nullptr);
        require(encoded.has_value(), "any field in range can be encoded");
        const auto run = encoded->decisions.run();
        const auto again = decoded_from(run, encoded->steps, *hierarchy, components, before ? &*before : nullptr);
        require(again && again->values == encoded->values, "the field that the encoder promised");
        for (std::size_t c = 0; c < components; ++c)
            require(again->history.planes[c].mean == encoded->history.planes[c].mean &&
                        again->history.planes[c].magnitude == encoded->history.planes[c].magnitude,
                    "both sides leave the same for the next frame");
        const auto bytes = input.flag() ? fuzz::damaged(run, input) : std::vector<std::uint8_t>{};
        const auto bad = decoded_from(bytes, encoded->steps, *hierarchy, components, before ? &*before : nullptr);
        if (bad)
            for (const auto value : bad->values) require(std::abs(value) <= 4 * field_limit, "values stay in range");
        steps = encoded->steps;
        before = bad ? bad->history : again->history;
    }
    const auto bad = decoded_from(input.rest(), steps, *hierarchy, components, &*before);
    if (bad)
        for (const auto value : bad->values) require(std::abs(value) <= 4 * field_limit, "values stay in range");
    return 0;
}
