// From where a subject is seen from the front.
#include "metrics/front.h"

#include <gtest/gtest.h>

#include <vector>

#include "metrics/render.h"
#include "metrics/shapes.h"

namespace htvm {
namespace {

constexpr UpAxis axes[] = {UpAxis::plus_x,  UpAxis::minus_x, UpAxis::plus_y,
                           UpAxis::minus_y, UpAxis::plus_z,  UpAxis::minus_z};

TEST(Front, AnAzimuthIsThatOfTheCameraInThatDirection) {
    for (const UpAxis up : axes)
        for (const double azimuth : {-170.0, -90.0, 0.0, 30.0, 90.0, 180.0}) {
            ViewOptions views;
            views.views = 1;
            views.up = up;
            views.first_azimuth = azimuth;
            const auto cameras = cameras_round(Box{{0, 0, 0}, {100, 100, 100}}, views);
            ASSERT_TRUE(cameras.has_value());
            const Point3 direction = direction_at(azimuth, up);
            for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(direction[c], cameras->front().backward[c], 1e-12);
            EXPECT_NEAR(*azimuth_of(direction, up), azimuth, 1e-9);
        }
}

TEST(Front, ADirectionStraightUpHasNoAzimuth) {
    EXPECT_EQ(azimuth_of({0, 1, 0}, UpAxis::plus_y), std::nullopt);
    EXPECT_EQ(azimuth_of({0, -1, 0.05}, UpAxis::plus_y), std::nullopt);
    EXPECT_NEAR(*azimuth_of({0, -1, 0.5}, UpAxis::plus_y), 0, 1e-9);
}

TEST(Front, IsThreeNumbersInTheMetadata) {
    EXPECT_EQ(front_entry(direction_at(180, UpAxis::plus_y)), (MetadataEntry{"front", "0 0 -1"}));
    EXPECT_EQ(front_entry(direction_at(30, UpAxis::plus_z)), (MetadataEntry{"front", "0.5 -0.866 0"}));
    const std::vector<MetadataEntry> metadata = {{"title", "A walk"}, front_entry({0.6, 0, -0.8})};
    EXPECT_EQ(front_of(metadata), (Point3{0.6, 0, -0.8}));
    EXPECT_EQ(front_of(std::vector<MetadataEntry>{{"front", "  0 0 -2.5 "}}), (Point3{0, 0, -1}));
}

TEST(Front, WhatIsNotThreeNumbersSaysNothing) {
    for (const char* text : {"", "0 0", "0 0 0", "1 2 3 4", "a b c", "nan 0 0", "inf 0 0", "1,0,0", "0 0 1x"})
        EXPECT_EQ(front_of(std::vector<MetadataEntry>{{"front", text}}), std::nullopt) << text;
    EXPECT_EQ(front_of({}), std::nullopt);
}

TEST(Front, AClosedSurfaceFacesNoWayAndASheetFacesOne) {
    Mesh sheet = shapes::plane(100, 10, 0);
    const auto facing = facing_of(sheet);
    ASSERT_TRUE(facing.has_value());
    EXPECT_NEAR((*facing)[2], 1, 1e-9);
    for (auto& t : sheet.triangles) std::swap(t[1], t[2]);
    EXPECT_NEAR((*facing_of(sheet))[2], -1, 1e-9);
    Mesh tetrahedron;
    tetrahedron.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    tetrahedron.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    EXPECT_EQ(facing_of(tetrahedron), std::nullopt);
    EXPECT_EQ(facing_of(Mesh{}), std::nullopt);
}

}  // namespace
}  // namespace htvm
