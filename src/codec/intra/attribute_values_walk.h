// What encoder and decoder of attribute values share: the predictors, and the walk over the vertices with its contexts.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "codec/intra/attribute_residual.h"
#include "codec/intra/attribute_values.h"
#include "core/lattice.h"

namespace htvm::internal {

// As written in the layer's first byte.
enum class AttributePredictor : std::uint8_t {
    previous,        // the vertex before, in coding order
    given,           // what the caller predicts
    neighbours,      // mean of the known neighbours
    parallelograms,  // mean of the parallelograms; of the neighbours where there are none
    between,         // midway between the two means
};

// Where predictions come from: one of the two is null.
template <class Value>
struct AttributeSource {
    const Neighbours* neighbours = nullptr;
    const std::vector<Value>* given = nullptr;

    std::size_t vertex_count() const { return neighbours ? neighbours->vertex_count() : given->size(); }
    bool offers(AttributePredictor predictor) const {
        if (predictor == AttributePredictor::previous) return true;
        if (predictor == AttributePredictor::given) return given != nullptr;
        return neighbours != nullptr && predictor <= AttributePredictor::between;
    }
    std::size_t vertex_at(std::size_t rank) const { return neighbours ? neighbours->order[rank] : rank; }
};

template <class Value>
std::array<std::int64_t, std::tuple_size_v<Value>> predict_from_mesh(const std::vector<Value>& values,
                                                                     const Neighbours& neighbours, std::size_t rank,
                                                                     AttributePredictor predictor) {
    const auto around = neighbours.neighbours_of(rank);
    const auto parallelograms = neighbours.parallelograms_of(rank);
    const bool use_parallelograms = predictor != AttributePredictor::neighbours && !parallelograms.empty();
    const bool use_neighbours = predictor != AttributePredictor::parallelograms || !use_parallelograms;
    constexpr std::size_t components = std::tuple_size_v<Value>;
    std::array<std::int64_t, components> out{};
    for (std::size_t c = 0; c < components; ++c) {
        std::int64_t near = 0, far = 0;
        const auto near_count = static_cast<std::int64_t>(around.size());
        const auto far_count = static_cast<std::int64_t>(parallelograms.size());
        if (use_neighbours)
            for (const std::uint32_t v : around) near += values[v][c];
        if (use_parallelograms)
            for (const Parallelogram& p : parallelograms)
                far += std::int64_t{values[p.a][c]} + values[p.b][c] - values[p.opposite][c];
        if (use_neighbours && use_parallelograms)
            out[c] = divide_rounded(near * far_count + far * near_count, 2 * near_count * far_count);
        else
            out[c] = use_neighbours ? divide_rounded(near, near_count) : divide_rounded(far, far_count);
    }
    return out;
}

// Contexts of one component's residual: by the residuals round the vertex (or of the last vertices), and by those of
// the vertex's own components before.
struct AttributeContexts {
    static constexpr std::size_t classes = 12;
    std::array<ResidualContext, classes> by_surroundings;
    std::array<ResidualContext, classes * classes> by_components;
    ResidualMantissa mantissa;

    // The class of a magnitude in quarters.
    static std::size_t class_of(std::int64_t quarters) {
        const auto q = static_cast<std::uint64_t>(quarters);
        return std::min<std::size_t>(static_cast<std::size_t>(std::bit_width(q)), classes - 1);
    }
};

// Codes all vertices up to `end`. code(context, context, mantissa, residual) puts the residual into the stream and
// returns it, or, decoding, returns what the stream says. False where a value leaves the limit.
template <class Value, class Code>
bool walk_attribute_values(std::vector<Value>& values, const AttributeSource<Value>& source,
                           AttributePredictor predictor, std::size_t end, std::vector<AttributeContexts>& contexts,
                           Code&& code) {
    constexpr std::size_t components = std::tuple_size_v<Value>;
    std::vector<Value> residuals(source.neighbours ? values.size() : 0);
    std::array<std::int64_t, components> recent{};  // running mean of the magnitudes, in sixteenths
    for (std::size_t rank = 0; rank < end; ++rank) {
        const std::size_t v = source.vertex_at(rank);
        std::span<const std::uint32_t> around;
        if (source.neighbours) around = source.neighbours->neighbours_of(rank);
        std::array<std::int64_t, components> predicted{};
        if (predictor == AttributePredictor::given) {
            for (std::size_t c = 0; c < components; ++c) predicted[c] = (*source.given)[v][c];
        } else if (predictor == AttributePredictor::previous || around.empty()) {
            if (rank > 0)
                for (std::size_t c = 0; c < components; ++c) predicted[c] = values[source.vertex_at(rank - 1)][c];
        } else {
            predicted = predict_from_mesh(values, *source.neighbours, rank, predictor);
        }
        std::int64_t own = 0;  // of the components before
        for (std::size_t c = 0; c < components; ++c) {
            predicted[c] = std::clamp<std::int64_t>(predicted[c], -attribute_limit, attribute_limit);
            std::int64_t surroundings = recent[c] / 4;
            if (!around.empty()) {
                surroundings = 0;
                for (const std::uint32_t n : around) surroundings += std::abs(residuals[n][c]);
                surroundings = surroundings * 4 / static_cast<std::int64_t>(around.size());
            }
            AttributeContexts& context = contexts[c];
            const std::size_t before = AttributeContexts::class_of(own * 2) * AttributeContexts::classes;
            const std::int64_t residual =
                code(context.by_surroundings[AttributeContexts::class_of(surroundings)],
                     context.by_components[before + AttributeContexts::class_of(recent[c] / 4)], context.mantissa,
                     static_cast<std::int32_t>(values[v][c] - predicted[c]));
            const std::int64_t value = predicted[c] + residual;
            if (value < -attribute_limit || value > attribute_limit) return false;
            values[v][c] = static_cast<std::int32_t>(value);
            if (source.neighbours) residuals[v][c] = static_cast<std::int32_t>(residual);
            own += std::abs(residual);
            recent[c] += (16 * std::abs(residual) - recent[c]) / 8;
        }
    }
    return true;
}

}  // namespace htvm::internal
