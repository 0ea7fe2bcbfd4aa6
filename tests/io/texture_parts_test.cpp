#include "io/texture_parts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace htvm {
namespace {

constexpr Colour red{200, 0, 0}, blue{0, 0, 100}, white{255, 255, 255}, grey{204, 204, 204};

// Three triangles in a row, of which the second is three times as large as the others; a vertex without any.
Mesh strip() {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {3, 1, 0}, {4, 1, 0}, {9, 9, 9}};
    mesh.triangles = {{0, 1, 2}, {1, 3, 2}, {1, 4, 3}};
    return mesh;
}

TextureReference with_parts(std::vector<TextureReference::Part> parts, std::vector<std::uint16_t> part_of = {}) {
    TextureReference out;
    out.parts = std::move(parts);
    out.part_of_triangle = std::move(part_of);
    return out;
}

TEST(TextureParts, VerticesTakeTheMeanOfTheColoursAroundByArea) {
    const auto colours = colours_of_parts(strip(), with_parts({{"a", {}, red}, {"b", {}, blue}}, {0, 1, 1}));
    ASSERT_EQ(colours.size(), 6u);
    EXPECT_EQ(colours[0], red);
    EXPECT_EQ(colours[2], (Colour{50, 0, 75})) << "a quarter and three quarters";
    EXPECT_EQ(colours[3], blue);
    EXPECT_EQ(colours[5], white) << "of no triangle";
}

TEST(TextureParts, OneColourThatSaysNothingIsNone) {
    for (const auto& colour : {std::optional<Colour>(), std::optional(white), std::optional(grey)})
        EXPECT_TRUE(colours_of_parts(strip(), with_parts({{"a", {}, colour}})).empty());
    EXPECT_TRUE(colours_of_parts(strip(), {}).empty());
    EXPECT_EQ(colours_of_parts(strip(), with_parts({{"a", {}, red}}))[3], red);
    EXPECT_EQ(colours_of_parts(strip(), with_parts({{"a", {}, grey}, {"b", {}, white}}, {0, 1, 1}))[0], grey);
    EXPECT_TRUE(colours_of_parts(strip(), with_parts({{"a", {}, grey}, {"b", {}, red}}, {0, 0, 0})).empty())
        << "a part that nothing wears";
}

TEST(TextureParts, WithAnImageThereAreNone) {
    EXPECT_TRUE(colours_of_parts(strip(), with_parts({{"a", {}, red}, {"b", 0, {}}}, {0, 1, 1})).empty());
    EXPECT_FALSE(colours_of_parts(strip(), with_parts({{"a", {}, red}, {"b", 0, {}}}, {0, 0, 0})).empty());
}

TEST(TextureParts, PartsBeyondTheirNumberAreTheFirst) {
    const auto texture = with_parts({{"a", {}, red}}, {0, 9});
    for (const std::size_t triangle : {0u, 1u, 2u}) EXPECT_EQ(part_of_triangle(texture, triangle), 0u);
    EXPECT_THAT(worn_parts(strip(), texture), testing::ElementsAre(true));
}

TEST(TextureParts, OneColourIsThatOfAllVertices) {
    EXPECT_FALSE(is_one_colour({}));
    EXPECT_TRUE(is_one_colour({red}));
    EXPECT_TRUE(is_one_colour({red, red}));
    EXPECT_FALSE(is_one_colour({red, blue}));
}

}  // namespace
}  // namespace htvm
