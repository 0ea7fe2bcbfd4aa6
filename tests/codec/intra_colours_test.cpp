#include <gtest/gtest.h>

#include <cstdlib>

#include "codec/intra/colours.h"
#include "codec/intra_test_meshes.h"

namespace htvm::internal {
namespace {

TEST(IntraColours, DecoderAndEncoderAgreeAndStayWithinHalfAStep) {
    unsigned seed = 0;
    for (const auto& mesh : intra_test::awkward()) {
        const auto neighbours = find_neighbours(mesh.triangles, mesh.vertex_count);
        ASSERT_TRUE(neighbours);
        const auto positions = intra_test::points(mesh.vertex_count, seed);
        const auto original = intra_test::colours(mesh.vertex_count, seed++);
        for (const std::int32_t step : {1, 2, 4, 7, 32, 255}) {
            const auto coded = encode_intra_colours(original, positions, *neighbours, step);
            const auto decoded = decode_intra_colours(coded.bytes, positions, *neighbours, step);
            ASSERT_TRUE(decoded) << decoded.error().message;
            EXPECT_EQ(*decoded, coded.decoded);
            for (std::size_t v = 0; v < original.size(); ++v)
                for (std::size_t c = 0; c < 3; ++c) ASSERT_LE(std::abs((*decoded)[v][c] - original[v][c]), step / 2);
        }
    }
}

TEST(IntraColours, AMeshWithoutVerticesTakesNoBytes) {
    EXPECT_TRUE(encode_intra_colours({}, {}, Neighbours{}, 1).bytes.empty());
}

TEST(IntraColours, OneColourAllOverCostsNextToNothing) {
    const auto mesh = intra_test::grid(60);
    const auto neighbours = find_neighbours(mesh.triangles, mesh.vertex_count);
    const std::vector<Colour> grey(mesh.vertex_count, Colour{90, 91, 92});
    EXPECT_LT(encode_intra_colours(grey, intra_test::points(mesh.vertex_count, 1), *neighbours, 1).bytes.size(), 100u);
}

TEST(IntraColours, ALayerCutShortIsAnError) {
    const auto mesh = intra_test::grid(12);
    const auto neighbours = find_neighbours(mesh.triangles, mesh.vertex_count);
    const auto positions = intra_test::points(mesh.vertex_count, 1);
    const auto coded = encode_intra_colours(intra_test::colours(mesh.vertex_count, 3), positions, *neighbours, 1);
    for (std::size_t size = 0; size + 8 < coded.bytes.size(); ++size) {
        const auto decoded = decode_intra_colours(std::span(coded.bytes).first(size), positions, *neighbours, 1);
        ASSERT_FALSE(decoded) << size;
        EXPECT_EQ(decoded.error().kind, ErrorKind::corrupt_stream);
    }
}

TEST(IntraColours, DamagedBytesDoNoHarm) {
    for (unsigned seed = 0; seed < 300; ++seed) {
        std::mt19937 random(seed);
        const auto mesh = seed % 2 ? intra_test::grid(10) : intra_test::soup(random);
        const auto neighbours = find_neighbours(mesh.triangles, mesh.vertex_count);
        const auto positions = intra_test::points(mesh.vertex_count, seed);
        const auto step = static_cast<std::int32_t>(1 + random() % 255);
        auto bytes =
            encode_intra_colours(intra_test::colours(mesh.vertex_count, seed), positions, *neighbours, step).bytes;
        for (int i = 0; i < 4; ++i) bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
        const auto decoded = decode_intra_colours(bytes, positions, *neighbours, step);
        EXPECT_TRUE(!decoded || decoded->size() == mesh.vertex_count);
    }
}

TEST(IntraColours, AStepOrPositionsThatCannotBeAreErrors) {
    const auto mesh = intra_test::grid(2);
    const auto neighbours = find_neighbours(mesh.triangles, mesh.vertex_count);
    const auto positions = intra_test::points(mesh.vertex_count, 1);
    const std::vector<std::uint8_t> bytes(64, 16);
    EXPECT_FALSE(decode_intra_colours(bytes, positions, *neighbours, 0));
    EXPECT_FALSE(decode_intra_colours(bytes, positions, *neighbours, 256));
    EXPECT_FALSE(decode_intra_colours(bytes, std::span(positions).first(3), *neighbours, 1));
}

}  // namespace
}  // namespace htvm::internal
