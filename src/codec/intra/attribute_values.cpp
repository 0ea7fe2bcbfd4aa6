#include "codec/intra/attribute_values.h"

#include <algorithm>
#include <bit>
#include <cstdlib>

#include "codec/intra/attribute_residual.h"
#include "core/lattice.h"
#include "entropy/cost.h"
#include "entropy/range_coder.h"

namespace htvm::internal {
namespace {

// As written in the first byte of the layer.
enum class AttributePredictor : std::uint8_t {
    previous,        // the previous vertex in coding order
    given,           // a prediction passed in by the caller
    neighbours,      // mean of the known neighbours
    parallelograms,  // mean of the parallelograms; of the neighbours if there are none
    between,         // midway between these two means
};

// The sources of predictions; one of the two is null.
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

template <class Value>
std::array<std::int64_t, std::tuple_size_v<Value>> predict(const std::vector<Value>& values,
                                                           const AttributeSource<Value>& source, std::size_t rank,
                                                           AttributePredictor predictor) {
    std::array<std::int64_t, std::tuple_size_v<Value>> out{};
    const auto predict_by = [&](const Value& value) { std::copy(value.begin(), value.end(), out.begin()); };
    const bool by_mesh = predictor != AttributePredictor::previous && predictor != AttributePredictor::given &&
                         !source.neighbours->neighbours_of(rank).empty();
    if (by_mesh) return predict_from_mesh(values, *source.neighbours, rank, predictor);
    if (predictor == AttributePredictor::given)
        predict_by((*source.given)[rank]);
    else if (rank > 0)
        predict_by(values[source.vertex_at(rank - 1)]);
    return out;
}

// Contexts of the residual of one component: by the residuals around the vertex (or of the last vertices), and by the
// residuals of the vertex's previous components.
struct AttributeContexts {
    static constexpr std::size_t classes = 12;
    std::array<ResidualContext, classes> by_surroundings;
    std::array<ResidualContext, classes * classes> by_components;
    ResidualMantissa mantissa;

    // The class of a magnitude given in quarters.
    static std::size_t class_of(std::int64_t quarters) {
        const auto q = static_cast<std::uint64_t>(quarters);
        return std::min<std::size_t>(static_cast<std::size_t>(std::bit_width(q)), classes - 1);
    }
};

// Codes all vertices up to `end`. Encoding leaves the values as they are; decoding fills them in, and gives false if
// one leaves the limit.
template <class Value, class Coder>
bool code_values(Coder&& coder, std::vector<Value>& values, const AttributeSource<Value>& source,
                 AttributePredictor predictor, std::size_t end) {
    constexpr std::size_t components = std::tuple_size_v<Value>;
    std::vector<AttributeContexts> contexts(components);
    std::vector<Value> residuals(source.neighbours ? values.size() : 0);
    std::array<std::int64_t, components> recent{};  // running mean of the magnitudes, in sixteenths
    for (std::size_t rank = 0; rank < end; ++rank) {
        const std::size_t v = source.vertex_at(rank);
        std::span<const std::uint32_t> around;
        if (source.neighbours) around = source.neighbours->neighbours_of(rank);
        auto predicted = predict(values, source, rank, predictor);
        std::int64_t own = 0;  // of the previous components
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
                code_residual(coder, context.by_surroundings[AttributeContexts::class_of(surroundings)],
                              context.by_components[before + AttributeContexts::class_of(recent[c] / 4)],
                              context.mantissa, static_cast<std::int32_t>(values[v][c] - predicted[c]));
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

template <class Value>
std::vector<std::uint8_t> encode_from(std::vector<Value> values, const AttributeSource<Value>& source) {
    if (values.empty()) return {};
    constexpr std::size_t trial_size = 8192;  // enough vertices to tell which predictor is best
    AttributePredictor best = AttributePredictor::previous;
    double fewest_bits = 0;
    for (std::uint8_t number = 0; number <= static_cast<std::uint8_t>(AttributePredictor::between); ++number) {
        const auto predictor = static_cast<AttributePredictor>(number);
        if (!source.offers(predictor)) continue;
        CostCounter counter;
        code_values(WritingCoder<CostCounter>{counter}, values, source, predictor, std::min(values.size(), trial_size));
        if (number > 0 && counter.bits() >= fewest_bits) continue;
        best = predictor;
        fewest_bits = counter.bits();
    }
    RangeEncoder encoder;
    code_values(WritingCoder<RangeEncoder>{encoder}, values, source, best, values.size());
    std::vector<std::uint8_t> bytes{static_cast<std::uint8_t>(best)};
    const auto coded = encoder.finish();
    bytes.insert(bytes.end(), coded.begin(), coded.end());
    return bytes;
}

template <class Value>
Result<std::vector<Value>> decode_from(std::span<const std::uint8_t> bytes, const AttributeSource<Value>& source) {
    std::vector<Value> values(source.vertex_count());
    if (values.empty()) return values;
    if (bytes.empty()) return fail(ErrorKind::corrupt_stream, "attribute values: the layer is empty");
    const auto predictor = static_cast<AttributePredictor>(bytes[0]);
    if (!source.offers(predictor))
        return fail(ErrorKind::corrupt_stream,
                    "attribute values: the layer names a predictor that this frame does not have");
    RangeDecoder decoder(bytes.subspan(1));
    const bool complete = code_values(ReadingCoder<RangeDecoder>{decoder}, values, source, predictor, values.size());
    if (decoder.exhausted()) return fail(ErrorKind::corrupt_stream, "attribute values: the layer ends too early");
    if (!complete) return fail(ErrorKind::corrupt_stream, "attribute values: a decoded value is out of range");
    return values;
}

}  // namespace

template <class Value>
std::vector<std::uint8_t> encode_attribute_values(const std::vector<Value>& values, const Neighbours& neighbours) {
    return encode_from<Value>(values, {.neighbours = &neighbours});
}

template <class Value>
std::vector<std::uint8_t> encode_attribute_values(const std::vector<Value>& values,
                                                  const std::vector<Value>& predictions) {
    return encode_from<Value>(values, {.given = &predictions});
}

template <class Value>
Result<std::vector<Value>> decode_attribute_values(std::span<const std::uint8_t> bytes, const Neighbours& neighbours) {
    return decode_from<Value>(bytes, {.neighbours = &neighbours});
}

template <class Value>
Result<std::vector<Value>> decode_attribute_values(std::span<const std::uint8_t> bytes,
                                                   const std::vector<Value>& predictions) {
    return decode_from<Value>(bytes, {.given = &predictions});
}

// Texture coordinates have two components, normals three.
using Values2 = std::array<std::int32_t, 2>;
using Values3 = std::array<std::int32_t, 3>;
template std::vector<std::uint8_t> encode_attribute_values<Values2>(const std::vector<Values2>&, const Neighbours&);
template std::vector<std::uint8_t> encode_attribute_values<Values3>(const std::vector<Values3>&, const Neighbours&);
template std::vector<std::uint8_t> encode_attribute_values<Values2>(const std::vector<Values2>&,
                                                                    const std::vector<Values2>&);
template std::vector<std::uint8_t> encode_attribute_values<Values3>(const std::vector<Values3>&,
                                                                    const std::vector<Values3>&);
template Result<std::vector<Values2>> decode_attribute_values<Values2>(std::span<const std::uint8_t>,
                                                                       const Neighbours&);
template Result<std::vector<Values3>> decode_attribute_values<Values3>(std::span<const std::uint8_t>,
                                                                       const Neighbours&);
template Result<std::vector<Values2>> decode_attribute_values<Values2>(std::span<const std::uint8_t>,
                                                                       const std::vector<Values2>&);
template Result<std::vector<Values3>> decode_attribute_values<Values3>(std::span<const std::uint8_t>,
                                                                       const std::vector<Values3>&);

}  // namespace htvm::internal
