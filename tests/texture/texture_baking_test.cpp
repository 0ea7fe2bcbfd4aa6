// Baking: captured images drawn into the layout of a decoded mesh's charts.
#include "texture/texture_baking.h"

#include <gtest/gtest.h>

#include <cmath>

namespace htvm {
namespace {

// A square of 100 mm in the plane z = 0, of `cells` x `cells` squares of two triangles each, textured by its whole
// image.
Mesh square(std::uint32_t cells) {
    Mesh mesh;
    for (std::uint32_t j = 0; j <= cells; ++j)
        for (std::uint32_t i = 0; i <= cells; ++i) {
            const float x = static_cast<float>(i) / static_cast<float>(cells);
            const float y = static_cast<float>(j) / static_cast<float>(cells);
            mesh.positions.push_back({100 * x, 100 * y, 0});
            mesh.normals.push_back({0, 0, 1});
            mesh.texcoords.push_back({x, y});
        }
    for (std::uint32_t j = 0; j < cells; ++j)
        for (std::uint32_t i = 0; i < cells; ++i) {
            const std::uint32_t a = j * (cells + 1) + i, b = a + cells + 1;
            mesh.triangles.push_back({a, a + 1, b + 1});
            mesh.triangles.push_back({a, b + 1, b});
        }
    return mesh;
}

// Red rises to the right, green upwards; blue as given.
std::shared_ptr<Image> slopes(int side, int blue, double exposure = 1) {
    auto out = std::make_shared<Image>();
    out->width = out->height = side;
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            const double right = (x + 0.5) / side, up = 1 - (y + 0.5) / side;
            for (const double level : {40 + 160 * right, 40 + 160 * up, static_cast<double>(blue)})
                out->rgb.push_back(static_cast<std::uint8_t>(std::lround(exposure * level)));
        }
    return out;
}

std::array<int, 3> texel(const Image& picture, int x, int y) {
    const auto* p = &picture.rgb[3 * static_cast<std::size_t>(y * picture.width + x)];
    return {p[0], p[1], p[2]};
}

// The decoded mesh: the same square in the left half of the picture, upright, 64 texels of 128 wide, in the middle.
struct Decoded {
    Mesh mesh;
    std::vector<std::uint32_t> repeated;
};
Decoded one_chart() {
    Decoded out{square(2), {}};
    out.mesh.normals.clear();
    for (auto& t : out.mesh.texcoords) t = {0.0625F + 0.5F * t[0], 0.25F + 0.5F * t[1]};
    return out;
}

// The left and the right half of the square in charts of their own, the right one turned by a quarter.
Decoded two_charts() {
    Decoded out = one_chart();
    auto& mesh = out.mesh;
    std::vector<std::uint32_t> copy_of(mesh.positions.size(), 0);
    const auto own = mesh.positions.size();
    for (std::uint32_t v = 0; v < own; ++v) {
        if (mesh.positions[v][0] < 49) continue;
        const auto& p = mesh.positions[v];
        const Vector2f turned = {0.9375F - 0.005F * p[1] * 0.625F, 0.25F + 0.005F * (p[0] - 50)};
        if (p[0] > 51) {
            mesh.texcoords[v] = turned;
            continue;
        }
        copy_of[v] = static_cast<std::uint32_t>(mesh.positions.size());
        out.repeated.push_back(v);
        mesh.positions.push_back(p);
        mesh.texcoords.push_back(turned);
    }
    for (auto& t : mesh.triangles) {
        const bool right = mesh.positions[t[0]][0] + mesh.positions[t[1]][0] + mesh.positions[t[2]][0] > 150;
        for (auto& v : t)
            if (right && copy_of[v] != 0) v = copy_of[v];
    }
    return out;
}

TextureBakingOptions options_128() { return {.width = 128, .height = 128}; }

TEST(TextureBaking, DrawsTheCapturedImageWhereTheChartLies) {
    TextureBaker baker(options_128());
    const auto decoded = one_chart();
    const auto baked = baker.bake({square(7), slopes(64, 90)}, decoded.mesh, decoded.repeated);
    ASSERT_TRUE(baked) << baked.error().message;
    EXPECT_DOUBLE_EQ(baked->seen, 1);
    // The chart covers x 8..72 and, from the top, y 32..96.
    for (int y = 34; y < 94; y += 5)
        for (int x = 10; x < 70; x += 5) {
            const auto seen = texel(baked->picture, x, y);
            EXPECT_NEAR(seen[0], 40 + 160 * (x + 0.5 - 8) / 64, 2);
            EXPECT_NEAR(seen[1], 40 + 160 * (96 - y - 0.5) / 64, 2);
            EXPECT_EQ(seen[2], 90);
        }
}

TEST(TextureBaking, DrawsIntoEveryChartAcrossItsSeams) {
    TextureBaker baker(options_128());
    const auto decoded = two_charts();
    // Its edges do not lie on the seam.
    const auto baked = baker.bake({square(7), slopes(64, 90)}, decoded.mesh, decoded.repeated);
    ASSERT_TRUE(baked) << baked.error().message;
    EXPECT_DOUBLE_EQ(baked->seen, 1);
    // Both charts show the seam's colour at it, and beyond it go on as the surface does, or stay.
    for (int y = 36; y < 92; y += 4) {
        EXPECT_NEAR(texel(baked->picture, 39, y)[0], 40 + 160 * 31.5 / 64, 2);
        EXPECT_GE(texel(baked->picture, 41, y)[0], 40 + 160 * 31.5 / 64 - 2);
        EXPECT_LE(texel(baked->picture, 41, y)[0], 40 + 160 * 34.0 / 64);
    }
    for (int x = 84; x < 116; x += 4) {
        const auto seen = texel(baked->picture, x, 95);
        EXPECT_NEAR(seen[0], 40 + 160 * 0.5, 3);
        EXPECT_NEAR(seen[1], 40 + 160 * (120 - x - 0.5) / 40, 4);
    }
}

TEST(TextureBaking, GuttersGoOnWithTheBordersColours) {
    TextureBaker baker(options_128());
    const auto decoded = one_chart();
    const auto baked = baker.bake({square(7), slopes(64, 90)}, decoded.mesh, decoded.repeated);
    ASSERT_TRUE(baked);
    for (int out = 1; out <= 4; ++out) {
        EXPECT_EQ(texel(baked->picture, 8 - out, 64), texel(baked->picture, 8, 64));
        EXPECT_EQ(texel(baked->picture, 71 + out, 64), texel(baked->picture, 71, 64));
        EXPECT_EQ(texel(baked->picture, 40, 95 + out), texel(baked->picture, 40, 95));
    }
}

TEST(TextureBaking, WhatIsNotSeenStaysAsItWas) {
    auto options = options_128();
    options.exposure = false;
    TextureBaker baker(options);
    const auto decoded = one_chart();
    ASSERT_TRUE(baker.bake({square(8), slopes(64, 90)}, decoded.mesh, decoded.repeated));
    auto half = square(8);
    std::erase_if(half.triangles, [&](const Triangle& t) { return half.positions[t[0]][0] >= 50; });
    const auto baked = baker.bake({half, slopes(64, 200)}, decoded.mesh, decoded.repeated);
    ASSERT_TRUE(baked);
    EXPECT_NEAR(baked->seen, 0.5, 0.1);
    EXPECT_EQ(texel(baked->picture, 20, 64)[2], 200);
    EXPECT_EQ(texel(baked->picture, 60, 64)[2], 90);
}

TEST(TextureBaking, HolesOfTheFirstPictureAreFilledFromAround) {
    TextureBaker baker(options_128());
    const auto decoded = one_chart();
    auto open = square(8);
    std::erase_if(open.triangles, [&](const Triangle& t) {
        const auto& p = open.positions[t[0]];
        return p[0] > 30 && p[0] < 60 && p[1] > 30 && p[1] < 60;
    });
    const auto baked = baker.bake({open, slopes(64, 90)}, decoded.mesh, decoded.repeated);
    ASSERT_TRUE(baked);
    EXPECT_LT(baked->seen, 1);
    const auto hole = texel(baked->picture, 38, 64);
    EXPECT_NEAR(hole[0], 40 + 160 * 30.0 / 64, 30);
    EXPECT_NEAR(hole[2], 90, 1);
}

TEST(TextureBaking, ABackIsNotDrawnOnAFront) {
    TextureBaker baker(options_128());
    const auto decoded = one_chart();
    auto front_and_back = square(8);
    const auto back = square(8);
    const auto first = static_cast<std::uint32_t>(front_and_back.positions.size());
    for (std::size_t v = 0; v < back.positions.size(); ++v) {
        auto p = back.positions[v];
        p[2] = -1;
        front_and_back.positions.push_back(p);
        front_and_back.normals.push_back({0, 0, -1});
        front_and_back.texcoords.push_back({0, 0});
    }
    for (const auto& t : back.triangles) front_and_back.triangles.push_back({first + t[0], first + t[2], first + t[1]});
    const auto baked = baker.bake({front_and_back, slopes(64, 90)}, decoded.mesh, decoded.repeated);
    ASSERT_TRUE(baked);
    EXPECT_NEAR(texel(baked->picture, 60, 64)[0], 40 + 160 * 52.5 / 64, 2);
}

TEST(TextureBaking, AnExposureThatChangesIsTakenOutAndTold) {
    TextureBaker baker(options_128());
    const auto decoded = one_chart();
    const auto first = baker.bake({square(7), slopes(64, 90)}, decoded.mesh, decoded.repeated);
    ASSERT_TRUE(first);
    EXPECT_EQ(first->gains, (std::array<double, 3>{1, 1, 1}));
    const auto brighter = baker.bake({square(7), slopes(64, 90, 1.1)}, decoded.mesh, decoded.repeated);
    ASSERT_TRUE(brighter);
    for (const double gain : brighter->gains) EXPECT_NEAR(gain, 1.1, 0.01);
    for (int x = 10; x < 70; x += 7)
        for (std::size_t c = 0; c < 3; ++c)
            EXPECT_NEAR(texel(brighter->picture, x, 50)[c], texel(first->picture, x, 50)[c], 2);
    const auto again = baker.bake({square(7), slopes(64, 90)}, decoded.mesh, decoded.repeated);
    ASSERT_TRUE(again);
    EXPECT_EQ(again->gains, (std::array<double, 3>{1, 1, 1}));
}

TEST(TextureBaking, APartThatChangesIsNoExposure) {
    TextureBaker baker(options_128());
    const auto decoded = one_chart();
    ASSERT_TRUE(baker.bake({square(7), slopes(64, 90)}, decoded.mesh, decoded.repeated));
    auto changed = slopes(64, 90);
    for (std::size_t i = 0; i < changed->rgb.size() / 3; ++i) changed->rgb[i] = 230;
    const auto baked = baker.bake({square(7), changed}, decoded.mesh, decoded.repeated);
    ASSERT_TRUE(baked);
    EXPECT_EQ(baked->gains, (std::array<double, 3>{1, 1, 1}));
}

TEST(TextureBaking, TrianglesThatStayKeepWhatIsNotSeenWhenTheLayoutChanges) {
    auto options = options_128();
    options.exposure = false;
    TextureBaker baker(options);
    const auto before = one_chart();
    ASSERT_TRUE(baker.bake({square(8), slopes(64, 90)}, before.mesh, before.repeated));
    auto after = one_chart();
    after.mesh.triangles.pop_back();  // in the upper right
    auto nothing = square(8);
    std::erase_if(nothing.triangles, [&](const Triangle& t) { return nothing.positions[t[0]][0] > 10; });
    const auto baked = baker.bake({nothing, slopes(64, 200)}, after.mesh, after.repeated);
    ASSERT_TRUE(baked);
    EXPECT_EQ(texel(baked->picture, 60, 80)[2], 90);
}

TEST(TextureBaking, WithoutTextureOrCoordinatesIsAnError) {
    TextureBaker baker(options_128());
    const auto decoded = one_chart();
    EXPECT_FALSE(baker.bake({square(2)}, decoded.mesh, {}));
    auto bare = square(2);
    bare.texcoords.clear();
    EXPECT_FALSE(baker.bake({bare, slopes(8, 1)}, decoded.mesh, {}));
    auto unlaid = decoded.mesh;
    unlaid.texcoords.clear();
    EXPECT_FALSE(baker.bake({square(2), slopes(8, 1)}, unlaid, {}));
    const std::vector<std::uint32_t> beyond = {1000};
    EXPECT_FALSE(baker.bake({square(2), slopes(8, 1)}, decoded.mesh, beyond));
}

TEST(TextureBaking, PicturesAreAsFineAsTheCapturedImage) {
    EXPECT_EQ(picture_side_for({square(2), slopes(512, 1)}), 768);
    auto small = square(2);
    for (auto& t : small.texcoords) t = {t[0] / 4, t[1] / 4};
    EXPECT_EQ(picture_side_for({small, slopes(512, 1)}), 512);
    EXPECT_EQ(picture_side_for({small, slopes(64, 1)}), 256);
}

}  // namespace
}  // namespace htvm
