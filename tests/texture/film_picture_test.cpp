// What of a camera's film goes into a stream: the window around the subject, without what lies behind it.
#include "texture/film_picture.h"

#include <gtest/gtest.h>

#include <memory>

namespace htvm {
namespace {

constexpr Colour subject{200, 100, 50}, background{0, 0, 255};

Colour pixel_at(const Image& image, int x, int y) {
    const auto i =
        3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x));
    return {image.rgb[i], image.rgb[i + 1], image.rgb[i + 2]};
}

// A square sheet of quads, of which some may lack, that a camera 1 m before it sees between these pixels.
TexturedMesh sheet(int width, int height, int left, int top, int side, bool hole = false) {
    auto image = std::make_shared<Image>();
    image->width = width;
    image->height = height;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const bool inside = x >= left && x < left + side && y >= top && y < top + side;
            for (const auto c : inside ? subject : background) image->rgb.push_back(c);
        }
    TexturedMesh out;
    constexpr int quads = 8;
    for (int j = 0; j <= quads; ++j)
        for (int i = 0; i <= quads; ++i) {
            const double x = left + 1.0 * side * i / quads, y = top + 1.0 * side * j / quads;
            const double depth = 1000 + 15 * ((i * 5 + j * 3) % 7);
            out.mesh.positions.push_back({static_cast<float>((x - width / 2.0) * depth / 500),
                                          static_cast<float>((height / 2.0 - y) * depth / 500),
                                          static_cast<float>(-depth)});
            out.mesh.texcoords.push_back({static_cast<float>(x / width), static_cast<float>(1 - y / height)});
        }
    for (std::uint32_t j = 0; j < quads; ++j)
        for (std::uint32_t i = 0; i < quads; ++i) {
            if (hole && i == 4 && j == 4) continue;
            const std::uint32_t a = j * (quads + 1) + i, b = a + 1, c = a + quads + 1, d = c + 1;
            out.mesh.triangles.push_back({a, c, b});
            out.mesh.triangles.push_back({b, c, d});
        }
    out.texture = std::move(image);
    return out;
}

TEST(FilmPicture, IsNoticedAndAnAtlasIsNot) {
    auto captured = sheet(320, 240, 100, 80, 64);
    EXPECT_TRUE(is_film(captured));
    for (std::size_t v = 0; v < captured.mesh.texcoords.size(); v += 2) captured.mesh.texcoords[v][0] += 0.2f;
    EXPECT_FALSE(is_film(captured));
    captured.texture.reset();
    EXPECT_FALSE(is_film(captured));
}

TEST(FilmPicture, ShowsTheWindowAroundTheSubject) {
    const auto captured = sheet(320, 240, 100, 80, 64);
    const auto window = first_window(captured);
    EXPECT_LE(window.left, 100 - 8);
    EXPECT_LE(window.top, 80 - 8);
    EXPECT_GE(window.left + window.width, 164 + 8);
    EXPECT_GE(window.top + window.height, 144 + 8);
    EXPECT_LT(window.width * window.height, 320 * 240 / 4);
    const auto picture = film_picture(captured, window, window.width, window.height);
    ASSERT_EQ(picture.width, window.width);
    EXPECT_EQ(pixel_at(picture, 110 - window.left, 90 - window.top), subject);
}

TEST(FilmPicture, IsTheWholeFilmWhereTheSubjectFillsIt) {
    EXPECT_EQ(first_window(sheet(128, 128, 4, 4, 120)), (FilmWindow{0, 0, 128, 128}));
}

TEST(FilmPicture, HasNothingOfWhatLiesBehindTheSubject) {
    const auto captured = sheet(320, 240, 100, 80, 64);
    const auto window = first_window(captured);
    const auto picture = film_picture(captured, window, window.width, window.height);
    for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x) ASSERT_EQ(pixel_at(picture, x, y), subject) << x << ", " << y;
}

TEST(FilmPicture, ShowsTheFilmInHolesOfTheMesh) {
    auto captured = sheet(320, 240, 100, 80, 64, /*hole=*/true);
    auto image = *captured.texture;
    const auto middle = 3 * (116 * 320 + 136);  // in the middle of the hole
    image.rgb[middle] = 9;
    captured.texture = std::make_shared<const Image>(image);
    const auto picture = film_picture(captured, {0, 0, 320, 240}, 320, 240);
    EXPECT_EQ(pixel_at(picture, 136, 116)[0], 9);
}

TEST(FilmPicture, CoordinatesInTheWindowNameTheSamePixelsAndCutOffOnesNone) {
    auto captured = sheet(320, 240, 100, 80, 64);
    captured.mesh.texcoords[0] = {1, 0.5f};
    const FilmWindow window{80, 60, 160, 120};
    const auto inside = texcoords_in_window(captured, window);
    EXPECT_EQ(inside[0], (Vector2f{-1, -1}));
    EXPECT_NEAR(inside[1][0], (108.0 - 80) / 160, 1e-5);
    EXPECT_NEAR(1 - inside[1][1], (80.0 - 60) / 120, 1e-5);
}

TEST(FilmFraming, StaysWhileTheSubjectIsWithinAndFollowsWhereItLeaves) {
    const auto first = first_window(sheet(320, 240, 100, 80, 64));
    FilmFraming framing(first);
    EXPECT_EQ(framing.next(sheet(320, 240, 104, 78, 64)), first);
    const auto moved = framing.next(sheet(320, 240, 190, 80, 64));
    EXPECT_EQ(moved.width, first.width);
    EXPECT_EQ(moved.height, first.height);
    EXPECT_LE(moved.left, 190);
    EXPECT_GE(moved.left + moved.width, 254);
    EXPECT_EQ((moved.left - first.left) % 8, 0) << "blocks of video move as they are";
    const auto larger = framing.next(sheet(320, 240, 60, 20, 200));
    EXPECT_LE(larger.left, 60);
    EXPECT_GE(larger.left + larger.width, 260);
    EXPECT_NEAR(1.0 * larger.width / larger.height, 1.0 * first.width / first.height, 0.02);
    EXPECT_EQ(framing.next(sheet(320, 240, 100, 80, 64)).width, first.width);
}

}  // namespace
}  // namespace htvm
