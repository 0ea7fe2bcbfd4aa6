#include "metrics/render.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <numeric>
#include <random>

#include "metrics/picture_error.h"
#include "metrics/shapes.h"

namespace htvm {
namespace {

// One pixel is one mm; the picture's centre is the origin, seen along -z.
Camera pixel_camera(int width, int height) {
    Camera camera;
    camera.position = {{0, 0, 1000}};
    camera.right = {{1, 0, 0}};
    camera.up = {{0, 1, 0}};
    camera.backward = {{0, 0, 1}};
    camera.width = width;
    camera.height = height;
    camera.orthographic = true;
    return camera;
}

std::size_t covered_pixels(const Picture& picture) {
    return static_cast<std::size_t>(std::accumulate(picture.covered.begin(), picture.covered.end(), 0));
}

Colour pixel_at(const Picture& picture, int x, int y) {
    const std::size_t i = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) + x);
    return {picture.rgb[i], picture.rgb[i + 1], picture.rgb[i + 2]};
}

RenderOptions unlit() {
    RenderOptions options;
    options.shading = Shading::unlit;
    return options;
}

Box box_of(const Mesh& mesh) { return bounding_box(mesh); }

TEST(Render, ASquareOfTenByTwentyMillimetresCoversTwoHundredPixels) {
    Mesh square;
    square.positions = {{-5, -10, 0}, {5, -10, 0}, {5, 10, 0}, {-5, 10, 0}};
    square.triangles = {{0, 1, 2}, {0, 2, 3}};
    EXPECT_EQ(covered_pixels(render(square, pixel_camera(40, 40), unlit())), 200u);
}

TEST(Render, ARightTriangleCoversTheCentresInsideAndThoseOnItsTopOrLeftEdges) {
    Mesh triangle;  // pixel centres of the diagonal lie exactly on the slanted edge
    triangle.positions = {{-5, 5, 0}, {-5, -5, 0}, {5, -5, 0}};
    triangle.triangles = {{0, 1, 2}};
    EXPECT_EQ(covered_pixels(render(triangle, pixel_camera(20, 20), unlit())), 45u);  // right edge: not included
    Mesh other;
    other.positions = {{-5, 5, 0}, {5, -5, 0}, {5, 5, 0}};
    other.triangles = {{0, 1, 2}};
    EXPECT_EQ(covered_pixels(render(other, pixel_camera(20, 20), unlit())), 55u);  // left edge: included
}

TEST(Render, TrianglesThatShareEdgesLeaveNoGapAndNoPixelIsDrawnTwice) {
    std::mt19937 random(11);
    std::uniform_real_distribution<float> coordinate(-30, 30);
    for (int round = 0; round < 50; ++round) {
        Mesh fan;  // a square cut into a fan about a point inside
        fan.positions = {
            {-30, -30, 0}, {30, -30, 0}, {30, 30, 0}, {-30, 30, 0}, {coordinate(random), coordinate(random), 0}};
        fan.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
        std::size_t apart = 0;
        for (const auto& t : fan.triangles) {
            Mesh one = fan;
            one.triangles = {t};
            apart += covered_pixels(render(one, pixel_camera(80, 80), unlit()));
        }
        EXPECT_EQ(apart, 3600u);
        EXPECT_EQ(covered_pixels(render(fan, pixel_camera(80, 80), unlit())), 3600u);
    }
}

TEST(Render, TheNearerSurfaceHidesTheFarther) {
    Mesh mesh;
    mesh.positions = {{-9, -9, 0}, {9, -9, 0}, {0, 9, 0}, {-9, -9, 5}, {9, -9, 5}, {0, 9, 5}};
    mesh.colours = {{255, 0, 0}, {255, 0, 0}, {255, 0, 0}, {0, 0, 255}, {0, 0, 255}, {0, 0, 255}};
    mesh.triangles = {{3, 4, 5}, {0, 1, 2}};
    EXPECT_EQ(pixel_at(render(mesh, pixel_camera(20, 20), unlit()), 10, 10), (Colour{0, 0, 255}));
    std::swap(mesh.triangles[0], mesh.triangles[1]);
    EXPECT_EQ(pixel_at(render(mesh, pixel_camera(20, 20), unlit()), 10, 10), (Colour{0, 0, 255}));
}

TEST(Render, UnlitColoursAreInterpolatedBetweenTheVertices) {
    Mesh mesh;
    mesh.positions = {{-10, -10, 0}, {10, -10, 0}, {10, 10, 0}, {-10, 10, 0}};
    mesh.colours = {{0, 50, 0}, {200, 50, 0}, {200, 50, 0}, {0, 50, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    const Picture picture = render(mesh, pixel_camera(20, 20), unlit());
    for (int x = 0; x < 20; ++x)
        EXPECT_EQ(pixel_at(picture, x, 7), (Colour{static_cast<std::uint8_t>(10 * x + 5), 50, 0}));
}

TEST(Render, BothSidesOfATriangleLookTheSame) {
    Mesh mesh;
    mesh.positions = {{-9, -9, 0}, {9, -9, 3}, {0, 9, 0}};
    mesh.triangles = {{0, 1, 2}};
    Mesh turned = mesh;
    turned.triangles = {{0, 2, 1}};
    for (Shading shading : {Shading::flat, Shading::smooth}) {
        RenderOptions options;
        options.shading = shading;
        EXPECT_EQ(render(mesh, pixel_camera(20, 20), options).rgb, render(turned, pixel_camera(20, 20), options).rgb);
    }
}

TEST(Render, SmoothShadingOfAFlatSurfaceIsFlatShading) {
    const Mesh flat = shapes::moved(shapes::plane(30, 3, 0), -15, -15, 0);
    RenderOptions smooth, faceted;
    faceted.shading = Shading::flat;
    EXPECT_EQ(render(flat, pixel_camera(40, 40), smooth).rgb, render(flat, pixel_camera(40, 40), faceted).rgb);
}

TEST(Render, IsTheSameForAnyThreadCount) {
    std::mt19937 random(12);
    for (Shading shading : {Shading::flat, Shading::smooth, Shading::unlit}) {
        const Mesh mesh = shapes::soup(random, 300, 300);
        const auto cameras = cameras_round(box_of(mesh), ViewOptions{.views = 2, .width = 320, .height = 256});
        ASSERT_TRUE(cameras.has_value());
        RenderOptions options;
        options.shading = shading;
        EXPECT_EQ(render(mesh, cameras->at(1), options, {}).rgb,
                  render(mesh, cameras->at(1), options, internal::ThreadPool(3)).rgb);
        EXPECT_GT(covered_pixels(render(mesh, cameras->at(1), options)), 1000u);
        const Mesh shifted = shapes::moved(mesh, 1, 0, 0);
        const DrawableMesh a = make_drawable(mesh, options), b = make_drawable(shifted, options);
        EXPECT_EQ(compare_views(a, b, *cameras, {}).squared,
                  compare_views(a, b, *cameras, internal::ThreadPool(4)).squared);
    }
}

TEST(Render, SurvivesMeshesThatCannotBeDrawn) {
    std::mt19937 random(13);
    const Camera camera = pixel_camera(16, 16);
    EXPECT_EQ(covered_pixels(render(Mesh{}, camera)), 0u);
    Mesh behind = shapes::moved(shapes::plane(10, 2, 0), 0, 0, 5000);
    EXPECT_EQ(covered_pixels(render(behind, camera)), 0u);
    Mesh far_off = shapes::moved(shapes::plane(10, 2, 0), 9e8f, 0, 0);
    EXPECT_EQ(covered_pixels(render(far_off, camera)), 0u);
    Mesh line;
    line.positions = {{0, 0, 0}, {5, 5, 0}, {7, 7, 0}};
    line.triangles = {{0, 1, 2}, {0, 0, 1}};
    EXPECT_EQ(covered_pixels(render(line, camera)), 0u);
    Mesh huge;
    huge.positions = {{-1e6f, -1e6f, 0}, {1e6f, -1e6f, 0}, {0, 1e6f, 0}};
    huge.triangles = {{0, 1, 2}};
    EXPECT_EQ(covered_pixels(render(huge, camera)), 256u);
}

TEST(Cameras, SeeTheWholeBoxFromEverySide) {
    Mesh corners;
    for (float x : {-300.0f, 250.0f})
        for (float y : {0.0f, 1800.0f})
            for (float z : {-100.0f, 400.0f}) corners.positions.push_back({x, y, z});
    for (bool orthographic : {false, true})
        for (double elevation : {0.0, 35.0})
            for (UpAxis up : {UpAxis::plus_y, UpAxis::minus_y, UpAxis::plus_z, UpAxis::minus_x}) {
                const auto cameras = cameras_round(
                    box_of(corners), ViewOptions{.up = up, .elevation = elevation, .orthographic = orthographic});
                ASSERT_TRUE(cameras.has_value());
                EXPECT_EQ(cameras->size(), 10u);
                for (const auto& camera : *cameras)
                    for (const auto& p : corners.positions) {
                        const Point3 d = to_point(p) - camera.position;
                        const double depth = -dot(d, camera.backward), scale = camera.orthographic ? 1 : depth;
                        EXPECT_GT(depth, 0);
                        EXPECT_LE(std::abs(dot(d, camera.right)) * camera.scale / scale, 640);
                        EXPECT_LE(std::abs(dot(d, camera.up)) * camera.scale / scale, 512);
                    }
            }
}

TEST(Cameras, StandUprightAndTheFirstLooksAlongMinusZ) {
    const auto cameras = cameras_round(box_of(shapes::sphere(100, 2)), ViewOptions{});
    ASSERT_TRUE(cameras.has_value());
    EXPECT_NEAR(cameras->front().backward[2], 1, 1e-12);
    for (const auto& camera : *cameras) EXPECT_NEAR(camera.up[1], 1, 1e-12);
}

TEST(Cameras, RefuseImpossibleOptions) {
    EXPECT_FALSE(cameras_round(Box{}, ViewOptions{.views = 0}).has_value());
    EXPECT_FALSE(cameras_round(Box{}, ViewOptions{.width = 1 << 20}).has_value());
    EXPECT_FALSE(cameras_round(Box{}, ViewOptions{.elevation = 90}).has_value());
    EXPECT_TRUE(cameras_round(Box{}, ViewOptions{}).has_value());
}

TEST(PictureError, OfEqualMeshesIsInfinite) {
    const Mesh mesh = shapes::sphere(100, 3);
    const auto cameras = cameras_round(box_of(mesh), ViewOptions{.views = 3, .width = 160, .height = 128});
    const DrawableMesh drawable = make_drawable(mesh);
    const auto error = compare_views(drawable, drawable, *cameras);
    EXPECT_EQ(error.squared, 0u);
    EXPECT_EQ(error.pixels, 3u * 160 * 128);
    EXPECT_GT(error.foreground_pixels, 1000u);
    EXPECT_TRUE(std::isinf(psnr_foreground(error)) && psnr_foreground(error) > 0);
    EXPECT_TRUE(std::isinf(psnr_full(PictureErrorSums{})));
}

TEST(PictureError, OfARecolouredMeshFollowsFromTheLevelsChanged) {
    Mesh square;
    square.positions = {{-5, -5, 0}, {5, -5, 0}, {5, 5, 0}, {-5, 5, 0}};
    square.triangles = {{0, 1, 2}, {0, 2, 3}};
    square.colours.assign(4, {100, 100, 100});
    Mesh recoloured = square;
    recoloured.colours.assign(4, {110, 100, 100});
    const Camera camera = pixel_camera(20, 20);
    const auto error = picture_error(render(square, camera, unlit()), render(recoloured, camera, unlit()));
    EXPECT_EQ(error.foreground_pixels, 100u);
    EXPECT_EQ(error.squared, 100u * 100u);
    EXPECT_NEAR(psnr_foreground(error), 10 * std::log10(255.0 * 255 / (100.0 / 3)), 1e-12);
    EXPECT_NEAR(psnr_full(error), psnr_foreground(error) + 10 * std::log10(4.0), 1e-12);
}

TEST(PictureError, OfAShiftedMeshCountsTheOutline) {
    Mesh square;
    square.positions = {{-5, -5, 0}, {5, -5, 0}, {5, 5, 0}, {-5, 5, 0}};
    square.triangles = {{0, 1, 2}, {0, 2, 3}};
    const Camera camera = pixel_camera(20, 20);
    const auto error =
        picture_error(render(square, camera, unlit()), render(shapes::moved(square, 2, 0, 0), camera, unlit()));
    EXPECT_EQ(error.foreground_pixels, 120u);
    EXPECT_EQ(error.outline_pixels, 40u);
    EXPECT_EQ(error.squared, 40u * 3 * 55 * 55);  // material 200 against background 255
}

TEST(PictureError, ItsPictureIsWhiteWhereNothingDiffers) {
    Picture a;
    a.width = 2;
    a.height = 1;
    a.rgb = {10, 20, 30, 40, 50, 60};
    a.covered = {1, 0};
    Picture b = a;
    b.rgb[4] = 53;
    EXPECT_EQ(difference_picture(a, b, 10).rgb, (std::vector<std::uint8_t>{255, 255, 255, 225, 225, 225}));
}

TEST(Png, IsWrittenAndAFolderThatDoesNotExistIsAnError) {
    const auto path = std::filesystem::temp_directory_path() / "htvm_render_test.png";
    const Picture picture = render(shapes::plane(10, 1, 0), pixel_camera(12, 8));
    const Picture pair = side_by_side({picture, picture});
    EXPECT_EQ(pair.width, 24);
    EXPECT_EQ(covered_pixels(pair), 2 * covered_pixels(picture));
    ASSERT_TRUE(write_png(pair, path.string()).has_value());
    std::ifstream file(path, std::ios::binary);
    char signature[4];
    file.read(signature, 4);
    EXPECT_EQ(std::string(signature + 1, 3), "PNG");
    std::filesystem::remove(path);
    EXPECT_FALSE(write_png(picture, "/nonexistent/folder/a.png").has_value());
}

// ---- Textures -------------------------------------------------------------------------------------------------------

// size x size mm around the origin, facing the camera, with an image spread over it.
TexturedMesh textured_square(float size, Image image) {
    Mesh mesh;
    const float half = size / 2;
    mesh.positions = {{-half, -half, 0}, {half, -half, 0}, {half, half, 0}, {-half, half, 0}};
    mesh.texcoords = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return {std::move(mesh), std::make_shared<const Image>(std::move(image))};
}

TEST(Render, ATextureAsLargeAsThePictureIsThePicture) {
    Image image{8, 8, {}};
    for (int i = 0; i < 3 * 64; ++i) image.rgb.push_back(static_cast<std::uint8_t>(i));
    const TexturedMesh square = textured_square(8, image);
    EXPECT_EQ(render(square, pixel_camera(8, 8), unlit()).rgb, image.rgb);
}

TEST(Render, ATextureComesBeforeVertexColoursAndGreyBeforeBoth) {
    TexturedMesh square = textured_square(8, {1, 1, {10, 20, 30}});
    square.mesh.colours.assign(4, {200, 0, 0});
    EXPECT_EQ(pixel_at(render(square, pixel_camera(8, 8), unlit()), 3, 3), (Colour{10, 20, 30}));
    EXPECT_EQ(pixel_at(render(square.mesh, pixel_camera(8, 8), unlit()), 3, 3), (Colour{200, 0, 0}));
    RenderOptions grey = unlit();
    grey.colours = false;
    EXPECT_EQ(pixel_at(render(square, pixel_camera(8, 8), grey), 3, 3), grey.material);
}

TEST(Render, TintsMultiplyTheTextureInLight) {
    TexturedMesh square = textured_square(8, {1, 1, {128, 128, 200}});
    square.tints.assign(square.mesh.positions.size(), {128, 255, 0});
    const Picture picture = render(square, pixel_camera(8, 8), unlit());
    EXPECT_EQ(picture.rgb[0], 61);
    EXPECT_EQ(picture.rgb[1], 128);
    EXPECT_EQ(picture.rgb[2], 0);
    square.texture = nullptr;
    EXPECT_EQ(render(square, pixel_camera(8, 8), unlit()).rgb[0], 200) << "without a texture there is nothing to tint";
}

TEST(Render, ATextureIsShadedAsVertexColoursAre) {
    const TexturedMesh square = textured_square(8, {1, 1, {200, 100, 50}});
    Mesh coloured = square.mesh;
    coloured.colours.assign(4, {200, 100, 50});
    for (const Shading shading : {Shading::flat, Shading::smooth}) {
        RenderOptions options;
        options.shading = shading;
        const Colour first = pixel_at(render(square, pixel_camera(8, 8), options), 2, 5);
        const Colour second = pixel_at(render(coloured, pixel_camera(8, 8), options), 2, 5);
        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(first[c], second[c], 1);
    }
}

TEST(Render, PixelsThatSeeManyTexelsShowTheirMean) {
    Image checks{64, 64, {}};
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x)
            checks.rgb.insert(checks.rgb.end(), 3, static_cast<std::uint8_t>((x + y) % 2 ? 200 : 0));
    const Picture picture = render(textured_square(16, checks), pixel_camera(16, 16), unlit());
    EXPECT_EQ(covered_pixels(picture), 256u);
    for (const auto level : picture.rgb) EXPECT_EQ(level, 100);
}

}  // namespace
}  // namespace htvm
