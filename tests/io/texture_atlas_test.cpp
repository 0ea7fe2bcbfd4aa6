#include "io/texture_atlas.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "io/image_samples.h"

namespace htvm {
namespace {

using samples::gradient;
using samples::plain;

std::shared_ptr<const Image> shared(Image image) { return std::make_shared<const Image>(std::move(image)); }

constexpr Colour red{250, 10, 10}, green{10, 250, 10}, blue{10, 10, 250}, white{255, 255, 255};

// A square of two triangles that share an edge, over the whole image.
Mesh square() {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    mesh.texcoords = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}

const std::vector<std::size_t> first_second{0, 1};

// The atlas's colour at a corner, drawn towards the middle of its triangle by that share.
Colour seen(const Mesh& mesh, const Atlas& atlas, std::size_t triangle, std::size_t corner, float inwards = 0,
            std::size_t level = 0) {
    const internal::ImagePyramid image(*atlas.image);
    Vector2f at{};
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t i = 0; i < 2; ++i)
            at[i] += mesh.texcoords[mesh.triangles[triangle][c]][i] * (inwards / 3 + (c == corner ? 1 - inwards : 0));
    const auto colour = image.at(at[0], at[1], level);
    Colour out;
    for (std::size_t i = 0; i < 3; ++i) out[i] = static_cast<std::uint8_t>(std::lround(colour[i]));
    return out;
}

TEST(TextureAtlas, PartsShowTheirOwnImagesAndColours) {
    Mesh mesh = square();
    mesh.normals.assign(4, {0, 0, 1});
    const std::vector<AtlasPart> parts{{"a", shared(plain(20, 12, red)), white}, {"b", nullptr, blue}};
    const auto made = put_into_atlas(mesh, parts, first_second);
    ASSERT_TRUE(made.has_value());
    EXPECT_FALSE(made->is_folded);
    EXPECT_EQ(made->atlas.scale, 1);
    for (std::size_t corner = 0; corner < 3; ++corner)
        for (const std::size_t level : {0u, 1u, 2u, 3u}) {
            EXPECT_EQ(seen(mesh, made->atlas, 0, corner, 0, level), red) << "level " << level;
            EXPECT_EQ(seen(mesh, made->atlas, 1, corner, 0, level), blue) << "level " << level;
        }
    // The two vertices of the edge between are split.
    EXPECT_EQ(mesh.positions.size(), 6u);
    EXPECT_EQ(mesh.normals.size(), 6u);
    EXPECT_EQ(mesh.triangles[0], (Triangle{0, 1, 2}));
    EXPECT_EQ(mesh.triangles[1], (Triangle{4, 5, 3}));
    EXPECT_EQ(mesh.positions[4], (Vector3f{0, 0, 0}));
    EXPECT_EQ(mesh.positions[5], (Vector3f{1, 1, 0}));
}

TEST(TextureAtlas, TexelsStayWhatTheyWere) {
    Mesh mesh = square();
    const auto image = shared(gradient(30, 17));
    const internal::ImagePyramid before(*image);
    const auto made =
        put_into_atlas(mesh, std::vector<AtlasPart>{{"a", image, white}, {"b", shared(plain(9, 9, red)), white}},
                       std::vector<std::size_t>{0, 0});
    ASSERT_TRUE(made.has_value());
    const internal::ImagePyramid after(*made->atlas.image);
    const Vector2f low = mesh.texcoords[0], high = mesh.texcoords[2];
    for (const float u : {0.0f, 0.1f, 0.5f, 0.93f, 1.0f})
        for (const float v : {0.0f, 0.3f, 0.77f, 1.0f}) {
            const auto a = before.at(u, v),
                       b = after.at(low[0] + u * (high[0] - low[0]), low[1] + v * (high[1] - low[1]));
            for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 0.02) << u << ' ' << v;
        }
}

TEST(TextureAtlas, TheOrderOfPartsChangesNothing) {
    Mesh one = square(), other = square();
    const AtlasPart a{"a", shared(plain(40, 20, red)), white}, b{"b", shared(plain(20, 40, green)), white};
    const auto made = put_into_atlas(one, std::vector<AtlasPart>{a, b}, first_second);
    const auto turned = put_into_atlas(other, std::vector<AtlasPart>{b, a}, std::vector<std::size_t>{1, 0});
    EXPECT_EQ(made->atlas.image->rgb, turned->atlas.image->rgb);
    EXPECT_EQ(one.texcoords, other.texcoords);
    // Other images of the same sizes lie in the same places.
    Mesh next = square();
    const auto later =
        put_into_atlas(next, std::vector<AtlasPart>{{"a", shared(plain(40, 20, blue)), white}, b}, first_second);
    EXPECT_EQ(later->atlas.image->width, made->atlas.image->width);
    EXPECT_EQ(next.texcoords, one.texcoords);
}

TEST(TextureAtlas, OfTheSameImagesIsNotMadeAgain) {
    Mesh mesh = square(), again = square(), changed = square();
    std::vector<AtlasPart> parts{{"a", shared(plain(8, 8, red)), white}, {"b", nullptr, blue}};
    const auto made = put_into_atlas(mesh, parts, first_second);
    EXPECT_EQ(put_into_atlas(again, parts, first_second, made->atlas)->atlas.image, made->atlas.image);
    EXPECT_EQ(again.texcoords, mesh.texcoords);
    parts[1].colour = green;
    EXPECT_NE(put_into_atlas(changed, parts, first_second, made->atlas)->atlas.image, made->atlas.image);
}

TEST(TextureAtlas, PartsThatShowTheSameShareATile) {
    Mesh mesh = square();
    const auto image = shared(plain(8, 8, red));
    const auto made =
        put_into_atlas(mesh, std::vector<AtlasPart>{{"a", image, white}, {"b", image, white}}, first_second);
    EXPECT_EQ(made->atlas.tiles.size(), 1u);
    EXPECT_EQ(mesh.positions.size(), 4u) << "and nothing is split";
}

TEST(TextureAtlas, ColoursMultiplyImagesInLight) {
    Mesh mesh = square();
    const auto image = shared(plain(8, 8, white));
    const auto made = put_into_atlas(
        mesh,
        std::vector<AtlasPart>{{"a", image, {128, 255, 0}}, {"b", shared(plain(8, 8, {128, 128, 128})), {128, 255, 0}}},
        first_second);
    EXPECT_EQ(seen(mesh, made->atlas, 0, 0), (Colour{128, 255, 0}));
    EXPECT_EQ(seen(mesh, made->atlas, 1, 0), (Colour{61, 128, 0}));
    EXPECT_EQ(multiplied(plain(1, 1, {128, 128, 128}), {128, 255, 0}).rgb, (std::vector<std::uint8_t>{61, 128, 0}));
}

TEST(TextureAtlas, TrianglesBeyondTheImageAreMovedByWholeNumbers) {
    Mesh plain_mesh = square(), moved = square();
    for (const std::size_t v : {0u, 1u, 2u, 3u}) {
        moved.texcoords[v][0] += 7;
        moved.texcoords[v][1] -= 3;
    }
    const std::vector<AtlasPart> parts{{"a", shared(gradient(16, 16)), white}, {"b", shared(plain(4, 4, red)), white}};
    const std::vector<std::size_t> all_first{0, 0};
    const auto made = put_into_atlas(plain_mesh, parts, all_first), beyond = put_into_atlas(moved, parts, all_first);
    EXPECT_EQ(made->atlas.image->rgb, beyond->atlas.image->rgb);
    for (std::size_t v = 0; v < 4; ++v)
        for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(plain_mesh.texcoords[v][i], moved.texcoords[v][i], 1e-6);
}

TEST(TextureAtlas, ImagesThatTrianglesReachOverAreRepeated) {
    Mesh mesh = square();
    for (auto& texcoord : mesh.texcoords) texcoord = {texcoord[0] * 1.5f + 0.25f, texcoord[1] * 0.5f};
    const auto image = shared(gradient(16, 16));
    const internal::ImagePyramid before(*image);
    const auto made = put_into_atlas(mesh, std::vector<AtlasPart>{{"a", image, white}, {"b", nullptr, red}},
                                     std::vector<std::size_t>{0, 0});
    ASSERT_FALSE(made->is_folded);
    EXPECT_EQ(made->atlas.tiles[0].across, 2);
    EXPECT_EQ(made->atlas.tiles[0].up, 1);
    const internal::ImagePyramid after(*made->atlas.image);
    const Vector2f low = mesh.texcoords[0], high = mesh.texcoords[2];
    for (const float u : {0.3f, 0.6f, 1.3f, 1.7f}) {
        const float share = (u - 0.25f) / 1.5f;
        const auto a = before.at(u, 0.25f), b = after.at(low[0] + share * (high[0] - low[0]), (low[1] + high[1]) / 2);
        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], 0.1) << u;
    }
}

TEST(TextureAtlas, TooManyRepetitionsAreFoldedAndMarked) {
    Mesh mesh = square();
    for (auto& texcoord : mesh.texcoords) texcoord = {texcoord[0] * 100, texcoord[1] * 1e30f};
    const auto made =
        put_into_atlas(mesh, std::vector<AtlasPart>{{"a", shared(gradient(8, 8)), white}, {"b", nullptr, red}},
                       std::vector<std::size_t>{0, 0});
    ASSERT_TRUE(made.has_value());
    EXPECT_TRUE(made->is_folded);
    for (const auto& texcoord : mesh.texcoords)
        for (const float c : texcoord) EXPECT_TRUE(c >= 0 && c <= 1);
}

TEST(TextureAtlas, ImagesThatDoNotFitAreAllMadeSmaller) {
    Mesh mesh = square();
    const std::vector<AtlasPart> parts{{"a", shared(plain(256, 256, red)), white},
                                       {"b", shared(plain(256, 128, green)), white}};
    const auto made = put_into_atlas(mesh, parts, first_second, {}, 256);
    ASSERT_TRUE(made.has_value());
    EXPECT_LE(made->atlas.image->width, 256);
    EXPECT_LE(made->atlas.image->height, 256);
    EXPECT_LT(made->atlas.scale, 1);
    EXPECT_GT(made->atlas.scale, 0.5);
    EXPECT_EQ(seen(mesh, made->atlas, 0, 0), red);
    EXPECT_EQ(seen(mesh, made->atlas, 1, 2), green);
}

TEST(TextureAtlas, ManyColoursFitOrAreAnError) {
    Mesh mesh;
    std::vector<AtlasPart> parts;
    std::vector<std::size_t> part_of;
    for (std::uint32_t p = 0; p < 5000; ++p) {
        const Mesh one = square();
        for (const std::size_t v : {0u, 1u, 2u}) {
            mesh.positions.push_back(one.positions[v]);
            mesh.texcoords.push_back(one.texcoords[v]);
        }
        mesh.triangles.push_back({3 * p, 3 * p + 1, 3 * p + 2});
        parts.push_back({"", nullptr, {static_cast<std::uint8_t>(p % 256), static_cast<std::uint8_t>(p / 256), 7}});
        part_of.push_back(p);
    }
    Mesh before = mesh;
    const auto made = put_into_atlas(mesh, parts, part_of);
    ASSERT_TRUE(made.has_value());
    for (const std::size_t p : {0u, 17u, 4999u}) EXPECT_EQ(seen(mesh, made->atlas, p, 1), parts[p].colour);
    EXPECT_EQ(put_into_atlas(before, parts, part_of, {}, 64).error().kind, ErrorKind::limit);
}

}  // namespace
}  // namespace htvm
