// A new layout of the capture's texture atlas is noticed, and needs an I-frame; slips of tracking, seams and atlases
// that use a place twice are none.
#include "codec/encoder/tracked/texcoord_layout.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "codec/encoder/tracking_numbers.h"
#include "htvm/encoder.hpp"

namespace htvm::internal {
namespace {

constexpr int rows = 60, columns = 60, spacing = 160;  // lattice units: 10 mm

// A sheet of 0.6 m; layout(s, t) gives the texture coordinates of a place, all three 0..1.
template <class Layout>
LatticeMesh sheet(const Layout& layout, std::int32_t shift = 0) {
    LatticeMesh mesh;
    for (int row = 0; row < rows; ++row)
        for (int column = 0; column < columns; ++column) {
            mesh.positions.push_back({column * spacing + shift, row * spacing, 0});
            const auto [u, v] = layout(double(column) / columns, double(row) / rows);
            mesh.texcoords.push_back({int(std::lround(4096 * u)), int(std::lround(4096 * v))});
        }
    const auto at = [](int row, int column) { return static_cast<std::uint32_t>(row * columns + column); };
    for (int row = 0; row + 1 < rows; ++row)
        for (int column = 0; column + 1 < columns; ++column) {
            mesh.triangles.push_back({at(row, column), at(row, column + 1), at(row + 1, column)});
            mesh.triangles.push_back({at(row, column + 1), at(row + 1, column + 1), at(row + 1, column)});
        }
    return mesh;
}

using Place = std::pair<double, double>;
Place plain(double s, double t) { return {s, t}; }
Place turned(double s, double t) { return {t, 1 - s}; }
// Eight by eight charts, each somewhere else in the atlas.
Place scattered(double s, double t) {
    const int chart = int(8 * s) + 8 * int(8 * t), place = chart * 37 % 64;
    return {(place % 8 + std::fmod(8 * s, 1.0)) / 8, (place / 8 + std::fmod(8 * t, 1.0)) / 8};
}
Place mirrored(double s, double t) { return {std::abs(2 * s - 1), t}; }
constexpr LatticeUnits reach = Scale{}.on_lattice(tracking_numbers.slip);

TEST(TexcoordLayout, IsTheSameWhereTrackingSlips) {
    for (const auto layout : {plain, scattered, mirrored})
        for (const int slip : {0, 80, 300})
            EXPECT_LT(share_with_other_texcoords(sheet(layout, slip), sheet(layout), reach), 0.02) << slip;
}

TEST(TexcoordLayout, IsAnotherWhereTheAtlasIsLaidOutAnew) {
    EXPECT_GT(share_with_other_texcoords(sheet(plain), sheet(turned), reach), 0.8);
    EXPECT_GT(share_with_other_texcoords(sheet(plain), sheet(scattered), reach), 0.5) << "charts of 75 mm";
    const auto half = [](double s, double t) { return t < 0.5 ? plain(s, t) : turned(s, t); };
    EXPECT_NEAR(share_with_other_texcoords(sheet(plain), sheet(half), reach), 0.45, 0.1);
}

TEST(TexcoordLayout, SaysNothingWithoutTexcoords) {
    auto bare = sheet(plain);
    bare.texcoords.clear();
    EXPECT_EQ(share_with_other_texcoords(bare, sheet(turned), reach), 0);
    EXPECT_EQ(share_with_other_texcoords(sheet(plain), bare, reach), 0);
}

// A column 1.6 m tall, whose texture is laid out anew in frame 3.
Mesh column(int frame) {
    constexpr int rings = 40, sides = 48;
    Mesh mesh;
    for (int ring = 0; ring <= rings; ++ring)
        for (int side = 0; side <= sides; ++side) {
            const double angle = 2 * std::numbers::pi * side / sides, height = double(ring) / rings;
            const double radius = 200 + 40 * std::sin(5 * height) + 20 * std::cos(3 * angle);
            mesh.positions.push_back(
                {float(radius * std::cos(angle) + 4 * frame), float(1600 * height), float(radius * std::sin(angle))});
            const float s = float(side) / sides, t = float(height);
            mesh.texcoords.push_back(frame < 3 ? Vector2f{s, t} : Vector2f{t, s});
        }
    const auto at = [](int ring, int side) { return static_cast<std::uint32_t>(ring * (sides + 1) + side); };
    for (int ring = 0; ring < rings; ++ring)
        for (int side = 0; side < sides; ++side) {
            mesh.triangles.push_back({at(ring, side), at(ring + 1, side), at(ring, side + 1)});
            mesh.triangles.push_back({at(ring, side + 1), at(ring + 1, side), at(ring + 1, side + 1)});
        }
    return mesh;
}

TEST(TexcoordLayout, ANewOneNeedsAnIntraFrame) {
    auto encoder = Encoder::create({});
    ASSERT_TRUE(encoder);
    std::string types;
    for (int frame = 0; frame < 6; ++frame) {
        ASSERT_TRUE(encoder->push(column(frame), nullptr, frame * 33333));
        types += kind_of(encoder->last_frame().type).letter;
    }
    EXPECT_EQ(types, "ITTITT");
}

}  // namespace
}  // namespace htvm::internal
