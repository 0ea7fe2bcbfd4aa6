#include "io/texture_colours.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/image_samples.h"

namespace htvm {
namespace {

// A unit square of two triangles whose texture coordinates are its own, turned so that the seam of `is_cut` ones runs
// along the diagonal.
Mesh square(bool is_cut = false) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    mesh.texcoords = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    if (!is_cut) return mesh;
    mesh.positions.insert(mesh.positions.end(), {{0, 0, 0}, {1, 1, 0}});
    mesh.texcoords.insert(mesh.texcoords.end(), {{0, 0}, {1, 1}});
    mesh.triangles[1] = {4, 5, 3};
    return mesh;
}

// The left half black, the right half white.
Image halves(int size) {
    Image image{size, size, {}};
    for (int p = 0; p < size * size; ++p)
        image.rgb.insert(image.rgb.end(), 3, static_cast<std::uint8_t>(p % size < size / 2 ? 0 : 255));
    return image;
}

TEST(TextureColours, OfOneColourAreThatColour) {
    for (const int size : {1, 3, 256}) {
        const Image image = samples::plain(size, size, {1, 100, 254});
        EXPECT_THAT(colours_from_texture(square(), image), testing::Each(Colour{1, 100, 254})) << size;
    }
}

TEST(TextureColours, EachIsTheMeanOfTheTrianglesAroundByNearness) {
    // Corner 1 has the share x - y of the triangle at the lower right: 1/6 over all of it, 7/48 where it is white.
    const auto colours = colours_from_texture(square(), halves(512));
    EXPECT_NEAR(colours[1][0], 255 * 7.0 / 8, 2);
    EXPECT_NEAR(colours[3][0], 255 * 1.0 / 8, 2);
    EXPECT_NEAR(int{colours[0][0]} + int{colours[2][0]}, 255, 2) << "by symmetry";
    EXPECT_LT(colours[0][0], colours[2][0]);
}

TEST(TextureColours, WhatIsFinerThanTheMeshDoesNotAlias) {
    Image stripes{1024, 1024, {}};
    for (int p = 0; p < 1024 * 1024; ++p)
        stripes.rgb.insert(stripes.rgb.end(), 3, static_cast<std::uint8_t>(p % 2 ? 255 : 0));
    for (const Colour& colour : colours_from_texture(square(), stripes)) EXPECT_NEAR(colour[0], 128, 3);
}

TEST(TextureColours, NothingIsReadBeyondTheTriangles) {
    // A chart in the lower left quarter; everything else is red, which is not to bleed into it.
    Mesh mesh = square();
    for (auto& texcoord : mesh.texcoords)
        for (auto& c : texcoord) c = 0.25f * c + 1.0f / 64;
    Image image = samples::plain(64, 64, {255, 0, 0});
    for (int y = 46; y < 64; ++y)
        for (int x = 0; x < 18; ++x)
            for (std::size_t c = 0; c < 3; ++c)
                image.rgb[3 * static_cast<std::size_t>(64 * y + x) + c] = c == 1 ? 200 : 0;
    EXPECT_THAT(colours_from_texture(mesh, image), testing::Each(Colour{0, 200, 0}));
}

TEST(TextureColours, VerticesWithoutTrianglesHaveTheColourAtTheirPlace) {
    Mesh mesh = square();
    mesh.positions.push_back({5, 5, 5});
    mesh.texcoords.push_back({0.9f, 0.5f});
    EXPECT_EQ(colours_from_texture(mesh, halves(64)).back(), (Colour{255, 255, 255}));
}

TEST(TextureColours, TheNumberOfThreadsChangesNothing) {
    const Image image = samples::gradient(31, 17);
    Mesh mesh;
    for (std::uint32_t v = 0; v < 3000; ++v) {
        mesh.positions.push_back({static_cast<float>(v % 7), static_cast<float>(v % 11), static_cast<float>(v)});
        mesh.texcoords.push_back({static_cast<float>(v % 13) / 13, static_cast<float>(v % 17) / 17});
        if (v > 1) mesh.triangles.push_back({v - 2, v - 1, v});
    }
    EXPECT_EQ(colours_from_texture(mesh, image), colours_from_texture(mesh, image, internal::ThreadPool(3)));
}

TEST(TextureColours, BothSidesOfASeamBecomeOneVertex) {
    const Image image = halves(128);
    const auto own = std::make_shared<const Image>(image);
    const Mesh whole = with_vertex_colours({square(), own}), sewn = with_vertex_colours({square(true), own});
    EXPECT_EQ(sewn.positions, square().positions);
    EXPECT_EQ(sewn.triangles, square().triangles);
    EXPECT_EQ(sewn.colours, whole.colours) << "the mean over both sides";
    EXPECT_TRUE(sewn.texcoords.empty());
    EXPECT_EQ(whole.colours, colours_from_texture(square(), image));
}

TEST(TextureColours, ColoursOfVerticesMultiplyThoseOfTheTextureInLight) {
    Mesh mesh = square(true);
    mesh.colours.assign(6, {255, 255, 255});
    mesh.colours[1] = {128, 0, 255};
    const Mesh made = with_vertex_colours({mesh, std::make_shared<const Image>(samples::plain(8, 8, {128, 128, 128}))});
    EXPECT_EQ(made.colours[0], (Colour{128, 128, 128}));
    EXPECT_EQ(made.colours[1], (Colour{61, 0, 128}));
    const auto shown =
        colours_with_texture({mesh, std::make_shared<const Image>(samples::plain(8, 8, {128, 128, 128}))});
    EXPECT_EQ(shown.size(), 6u) << "vertices stay apart";
    EXPECT_EQ(shown[1], (Colour{61, 0, 128}));
}

TEST(TextureColours, VerticesWithOtherNormalsStayApart) {
    Mesh mesh = square(true);
    mesh.normals.assign(4, {0, 0, 1});
    mesh.normals.insert(mesh.normals.end(), 2, {0, 1, 0});
    EXPECT_EQ(with_vertex_colours({mesh, std::make_shared<const Image>(halves(8))}).positions.size(), 6u);
}

TEST(TextureColours, TrianglesThatASeamHeldOpenAreDropped) {
    Mesh mesh = square(true);
    mesh.triangles.push_back({0, 4, 1});  // from one side of the seam to the other
    mesh.triangles.push_back({1, 1, 2});  // as captured
    const Mesh sewn = with_vertex_colours({mesh, std::make_shared<const Image>(halves(8))});
    EXPECT_EQ(sewn.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {1, 1, 2}}));
}

}  // namespace
}  // namespace htvm
