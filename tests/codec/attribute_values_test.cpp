#include "codec/intra/attribute_values.h"

#include <gtest/gtest.h>

#include "codec/intra_test_meshes.h"

namespace htvm::internal {
namespace {

using Pair = std::array<std::int32_t, 2>;
using Three = std::array<std::int32_t, 3>;

template <class Value>
std::vector<Value> random_values(std::size_t count, unsigned seed) {
    std::mt19937 random(seed);
    const std::int32_t scale = seed % 5 == 0 ? attribute_limit : 127;
    std::vector<Value> out(count);
    for (auto& value : out)
        for (auto& c : value) c = static_cast<std::int32_t>(random() % (2u * scale + 1)) - scale;
    for (std::size_t i = 1; i < count; ++i)
        if (random() % 3) out[i] = out[i - 1];
    return out;
}

template <class Value>
void expect_exact_with_a_mesh() {
    unsigned seed = 0;
    for (const auto& mesh : intra_test::awkward()) {
        const auto neighbours = find_neighbours(mesh.triangles, mesh.vertex_count);
        const auto values = random_values<Value>(mesh.vertex_count, seed++);
        const auto decoded = decode_attribute_values<Value>(encode_attribute_values(values, *neighbours), *neighbours);
        ASSERT_TRUE(decoded) << decoded.error().message;
        EXPECT_EQ(*decoded, values);
    }
}

TEST(AttributeValues, TextureCoordinatesComeBackExactlyGivenTheMesh) { expect_exact_with_a_mesh<Pair>(); }

TEST(AttributeValues, NormalsComeBackExactlyGivenTheMesh) { expect_exact_with_a_mesh<Three>(); }

TEST(AttributeValues, ComeBackExactlyGivenPredictions) {
    for (unsigned seed = 0; seed < 100; ++seed) {
        const auto values = random_values<Three>(seed * 7, seed);
        auto predictions = seed % 2 ? values : random_values<Three>(values.size(), seed + 1);
        const auto decoded = decode_attribute_values(encode_attribute_values(values, predictions), predictions);
        ASSERT_TRUE(decoded) << decoded.error().message;
        EXPECT_EQ(*decoded, values);
    }
}

TEST(AttributeValues, NoVerticesTakeNoBytes) {
    EXPECT_TRUE(encode_attribute_values(std::vector<Pair>{}, Neighbours{}).empty());
    EXPECT_TRUE(encode_attribute_values(std::vector<Three>{}, std::vector<Three>{}).empty());
}

TEST(AttributeValues, AGoodPredictionCostsNextToNothing) {
    const auto values = random_values<Three>(5000, 1);
    EXPECT_LT(encode_attribute_values(values, values).size(), 60u);
}

TEST(AttributeValues, AUselessPredictionLosesToTheVertexBefore) {
    const std::vector<Three> values(5000, Three{1, 2, 3});
    EXPECT_LT(encode_attribute_values(values, random_values<Three>(5000, 2)).size(), 60u);
}

TEST(AttributeValues, APredictorThatIsNotAtHandIsAnError) {
    const std::vector<Pair> predictions(3);
    for (const int number : {2, 3, 4, 5, 255}) {
        const std::vector<std::uint8_t> bytes{static_cast<std::uint8_t>(number), 1, 2, 3, 4, 5, 6, 7};
        const auto decoded = decode_attribute_values(bytes, predictions);
        ASSERT_FALSE(decoded);
        EXPECT_EQ(decoded.error().kind, ErrorKind::corrupt_stream);
    }
    const auto mesh = intra_test::grid(2);
    const auto neighbours = find_neighbours(mesh.triangles, mesh.vertex_count);
    const std::vector<std::uint8_t> given{1, 1, 2, 3, 4, 5, 6, 7};
    EXPECT_FALSE(decode_attribute_values<Pair>(given, *neighbours));
}

TEST(AttributeValues, ALayerCutShortIsAnError) {
    const auto mesh = intra_test::grid(12);
    const auto neighbours = find_neighbours(mesh.triangles, mesh.vertex_count);
    const auto bytes = encode_attribute_values(random_values<Three>(mesh.vertex_count, 1), *neighbours);
    for (std::size_t size = 0; size + 8 < bytes.size(); ++size)
        ASSERT_FALSE(decode_attribute_values<Three>(std::span(bytes).first(size), *neighbours)) << size;
}

TEST(AttributeValues, DamagedBytesGiveAnErrorOrValuesWithinTheLimit) {
    for (unsigned seed = 0; seed < 300; ++seed) {
        std::mt19937 random(seed);
        const auto mesh = seed % 2 ? intra_test::grid(10) : intra_test::soup(random);
        const auto neighbours = find_neighbours(mesh.triangles, mesh.vertex_count);
        auto bytes = encode_attribute_values(random_values<Pair>(mesh.vertex_count, seed), *neighbours);
        for (int i = 0; i < 4; ++i) bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
        const auto decoded = decode_attribute_values<Pair>(bytes, *neighbours);
        if (!decoded) continue;
        for (const auto& value : *decoded)
            for (const auto c : value) EXPECT_LE(std::abs(c), attribute_limit);
    }
}

}  // namespace
}  // namespace htvm::internal
