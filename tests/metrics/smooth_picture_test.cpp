#include "metrics/smooth_picture.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace htvm {
namespace {

// A red square of 10 mm, and a camera that sees 20 mm at a pixel per mm.
struct Square {
    Mesh mesh;
    Camera camera;
    explicit Square(float left = -5) {
        mesh.positions = {{left, -5, 0}, {5, -5, 0}, {5, 5, 0}, {left, 5, 0}};
        mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
        mesh.colours.assign(4, {200, 10, 0});
        camera.position = {0, 0, 100};
        camera.right = {1, 0, 0};
        camera.up = {0, 1, 0};
        camera.backward = {0, 0, 1};
        camera.width = camera.height = 20;
        camera.orthographic = true;
    }
    SmoothPicture draw(int samples) const {
        Canvas canvas;
        RenderOptions options;
        options.shading = Shading::unlit;
        return draw_smoothly(make_drawable(mesh, options), camera, samples, canvas);
    }
};

std::array<int, 4> pixel(const SmoothPicture& picture, int x, int y) {
    const auto* at = &picture.rgba[static_cast<std::size_t>(4 * (y * picture.width + x))];
    return {at[0], at[1], at[2], at[3]};
}

TEST(SmoothPicture, IsTheColourWithinAndNothingWithout) {
    const auto picture = Square().draw(3);
    EXPECT_EQ(picture.width, 20);
    EXPECT_EQ(picture.height, 20);
    EXPECT_EQ(pixel(picture, 10, 10), (std::array{200, 10, 0, 255}));
    EXPECT_EQ(pixel(picture, 5, 5), (std::array{200, 10, 0, 255}));
    EXPECT_EQ(pixel(picture, 4, 10), (std::array{0, 0, 0, 0}));
}

TEST(SmoothPicture, AnEdgeHasTheShareOfTheSamplesBehindIt) {
    // The left edge lies in the middle of pixel 4.
    EXPECT_EQ(pixel(Square(-5.5f).draw(4), 4, 10), (std::array{200, 10, 0, 128}));
    EXPECT_EQ(pixel(Square(-5.5f).draw(1), 4, 10)[3] % 255, 0) << "one sample is there or not";
}

TEST(SmoothPicture, OnABackgroundLightIsAdded) {
    auto picture = Square(-5.5f).draw(4);
    const auto rgb = on_background(picture, {0, 0, 0});
    const auto at = [&](int x) { return rgb[static_cast<std::size_t>(3 * (10 * 20 + x))]; };
    EXPECT_EQ(at(0), 0);
    EXPECT_EQ(at(10), 200);
    EXPECT_NEAR(at(4), 146, 1);  // half of the light of 200
    const auto on_white = on_background(picture, {255, 255, 255});
    EXPECT_EQ(on_white[0], 255);
}

TEST(SmoothPicture, AZoomedCameraIsFilledUpToItsMargin) {
    Square square;
    square.camera = zoomed_to(square.mesh, square.camera, 0.1);
    EXPECT_DOUBLE_EQ(square.camera.scale, 1.6);  // 16 of 20 pixels
    square.camera.orthographic = false;
    square.camera.height = 40;
    square.camera = zoomed_to(square.mesh, square.camera, 0);
    EXPECT_DOUBLE_EQ(square.camera.scale, 200);  // half a picture's width at a twentieth of the distance
    EXPECT_DOUBLE_EQ(zoomed_to(Mesh(), square.camera, 0).scale, 200);
}

TEST(SmoothPicture, IsTheSameForAnyThreadCount) {
    const Square square;
    Canvas canvas;
    const internal::ThreadPool pool(3);
    const auto drawable = make_drawable(square.mesh);
    const auto alone = draw_smoothly(drawable, square.camera, 3, canvas);
    EXPECT_EQ(draw_smoothly(drawable, square.camera, 3, canvas, pool.threads()).rgba, alone.rgba);
}

TEST(SmoothPicture, APngHasAnAlphaChannelUnlessThereIsABackground) {
    const auto picture = Square().draw(2);
    const auto header = [](const std::vector<std::uint8_t>& png) {
        return std::array<int, 3>{png[19], png[23], png[25]};  // width, height, colour type
    };
    const auto transparent = png_of(picture, {}), white = png_of(picture, Colour{255, 255, 255});
    ASSERT_TRUE(transparent && white);
    EXPECT_EQ(header(*transparent), (std::array{20, 20, 6}));
    EXPECT_EQ(header(*white), (std::array{20, 20, 2}));
}

}  // namespace
}  // namespace htvm
