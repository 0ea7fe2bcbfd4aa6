// Drift along the surface.
#include "metrics/drift.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "metrics/shapes.h"

namespace htvm {
namespace {

// Marks in the middle of a plane at z = 0, where they are.
Mesh marks_on_plane(float x_shift = 0) {
    Mesh marks;
    for (int y = 0; y < 10; ++y)
        for (int x = 0; x < 10; ++x)
            marks.positions.push_back(
                {30.3f + 4 * static_cast<float>(x) + x_shift, 30.7f + 4 * static_cast<float>(y), 0});
    marks.normals.assign(marks.positions.size(), {0, 0, 1});
    return marks;
}

TEST(Drift, ASurfaceThatSlidesDriftsByAsMuchAsItSlides) {
    const Mesh plane = shapes::plane(100, 10, 0), marks = marks_on_plane();
    DriftMeter meter;
    for (int age = 0; age < 4; ++age) {
        const auto drift =
            meter.add(marks, shapes::moved(plane, 3 * static_cast<float>(age), 4 * static_cast<float>(age), 0));
        ASSERT_TRUE(drift.has_value()) << drift.error().message;
        EXPECT_EQ(drift->age, static_cast<std::uint32_t>(age));
        EXPECT_EQ(drift->marks, 100u);
        EXPECT_NEAR(drift->mean_mm, 5.0 * age, 1e-4);
        EXPECT_NEAR(drift->p95_mm, 5.0 * age, 1e-4);
    }
    EXPECT_NEAR(meter.overall().mean_mm, 10.0, 1e-4);  // ages 1, 2 and 3
    ASSERT_EQ(meter.by_age().size(), 4u);
    EXPECT_NEAR(meter.by_age()[2].p95_mm, 10.0, 1e-4);
}

TEST(Drift, ASurfaceThatGoesWithTheTrueOneDoesNotDrift) {
    const Mesh plane = shapes::plane(100, 10, 0);
    DriftMeter meter;
    for (const float shift : {0.0f, 40.0f, 90.0f}) {
        const auto drift = meter.add(marks_on_plane(shift), shapes::moved(plane, shift, 0, 0));
        ASSERT_TRUE(drift.has_value());
        EXPECT_NEAR(drift->p95_mm, 0.0, 1e-4);
    }
}

TEST(Drift, ADistanceAcrossTheSurfaceIsNoDrift) {
    const Mesh plane = shapes::plane(100, 10, 0), marks = marks_on_plane();
    DriftMeter meter;
    ASSERT_TRUE(meter.add(marks, plane).has_value());
    const auto drift = meter.add(marks, shapes::moved(plane, 0, 0, 7));
    ASSERT_TRUE(drift.has_value());
    EXPECT_NEAR(drift->mean_mm, 0.0, 1e-4);
}

TEST(Drift, OtherTrianglesAreANewReference) {
    const Mesh marks = marks_on_plane();
    DriftMeter meter;
    ASSERT_TRUE(meter.add(marks, shapes::plane(100, 10, 0)).has_value());
    const auto slid = meter.add(marks, shapes::moved(shapes::plane(100, 10, 0), 5, 0, 0));
    const auto anew = meter.add(marks, shapes::moved(shapes::plane(100, 12, 0), 5, 0, 0));
    ASSERT_TRUE(slid.has_value() && anew.has_value());
    EXPECT_EQ(slid->age, 1u);
    EXPECT_EQ(anew->age, 0u);
    EXPECT_NEAR(anew->mean_mm, 0.0, 1e-4);
}

// A mesh that shows the vertices of a plane for which `is_there`, as a decoded frame does, and where they are in it.
template <typename Which>
std::pair<Mesh, ShownVertices> part_of(const Mesh& plane, std::uint32_t reference, Which is_there) {
    std::pair<Mesh, ShownVertices> out{{}, {reference, {}}};
    std::vector<std::uint32_t> place_of(plane.positions.size(), 0);
    for (std::uint32_t v = 0; v < plane.positions.size(); ++v) {
        if (!is_there(plane.positions[v])) continue;
        place_of[v] = static_cast<std::uint32_t>(out.second.places.size());
        out.second.places.push_back(v);
        out.first.positions.push_back(plane.positions[v]);
    }
    for (const auto& t : plane.triangles)
        if (is_there(plane.positions[t[0]]) && is_there(plane.positions[t[1]]) && is_there(plane.positions[t[2]]))
            out.first.triangles.push_back({place_of[t[0]], place_of[t[1]], place_of[t[2]]});
    return out;
}

TEST(Drift, WhatIsThereOfAReferenceIsFollowedThroughTheReferencesVertices) {
    const Mesh plane = shapes::plane(100, 10, 0), marks = marks_on_plane();
    DriftMeter meter;
    // From one side another row goes in every frame; the marks are from x = 30.3 to 66.3 mm.
    for (std::uint32_t age = 0; age < 4; ++age) {
        auto [mesh, shown] =
            part_of(plane, 7, [&](const Vector3f& p) { return p[0] >= 10 * static_cast<float>(age + 1); });
        const auto drift = meter.add(marks, shapes::moved(mesh, 3 * static_cast<float>(age), 0, 0), shown);
        ASSERT_TRUE(drift.has_value()) << drift.error().message;
        EXPECT_EQ(drift->age, age);
        EXPECT_EQ(drift->marks, age < 3 ? 100u : 70u);  // 30.3, 34.3 and 38.3 mm are left of the last row
        EXPECT_NEAR(drift->mean_mm, 3.0 * age, 1e-4);
    }
}

TEST(Drift, APartOfAnotherReferenceIsANewReference) {
    const Mesh plane = shapes::plane(100, 10, 0), marks = marks_on_plane();
    const auto [mesh, shown] = part_of(plane, 7, [](const Vector3f& p) { return p[0] >= 10; });
    DriftMeter meter;
    ASSERT_TRUE(meter.add(marks, mesh, shown).has_value());
    EXPECT_EQ(meter.add(marks, mesh, shown)->age, 1u);
    EXPECT_EQ(meter.add(marks, mesh, {8, shown.places})->age, 0u);
}

TEST(Drift, AReferenceWithTheTrianglesOfTheOneBeforeGoesOn) {
    const Mesh plane = shapes::plane(100, 10, 0), marks = marks_on_plane();
    DriftMeter meter;
    ASSERT_TRUE(meter.add(marks, plane, {7, {}}).has_value());
    EXPECT_EQ(meter.add(marks, plane, {8, {}})->age, 1u);
}

TEST(Drift, VerticesShownWithoutAPlaceEachAreRefused) {
    const Mesh plane = shapes::plane(100, 10, 0);
    DriftMeter meter;
    EXPECT_EQ(meter.add(marks_on_plane(), plane, {7, {0, 1}}).error().kind, ErrorKind::bad_input);
}

TEST(Drift, HiddenMarksAreNeitherFollowedNorMeasured) {
    const Mesh plane = shapes::plane(100, 10, 0);
    Mesh first = marks_on_plane(), second = first;
    for (std::size_t i = 0; i < 30; ++i) first.normals[i] = {0, 0, 0};
    for (std::size_t i = 30; i < 50; ++i) second.normals[i] = {0, 0, 0};
    DriftMeter meter;
    EXPECT_EQ(meter.add(first, plane)->marks, 70u);
    EXPECT_EQ(meter.add(second, plane)->marks, 50u);
    EXPECT_EQ(meter.add(marks_on_plane(), plane)->marks, 70u);
}

TEST(Drift, MarksOfAnotherSurfaceAreNotFollowed) {
    const Mesh plane = shapes::plane(100, 10, 0);
    Mesh marks = marks_on_plane();
    marks.positions[0][2] = 20;     // beyond reach
    marks.normals[1] = {0, 0, -1};  // the other side
    DriftMeter meter;
    EXPECT_EQ(meter.add(marks, plane)->marks, 98u);
}

TEST(Drift, MarksWithoutNormalsAndOtherNumbersOfMarksAreRefused) {
    const Mesh plane = shapes::plane(100, 10, 0);
    Mesh bare = marks_on_plane(), fewer = bare;
    bare.normals.clear();
    fewer.positions.pop_back();
    fewer.normals.pop_back();
    DriftMeter meter;
    EXPECT_EQ(meter.add(bare, plane).error().kind, ErrorKind::bad_input);
    ASSERT_TRUE(meter.add(marks_on_plane(), plane).has_value());
    EXPECT_EQ(meter.add(fewer, plane).error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace htvm
