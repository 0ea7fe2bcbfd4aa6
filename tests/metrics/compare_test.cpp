#include "metrics/compare.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "metrics/shapes.h"

namespace htvm {
namespace {

CompareOptions small_pictures() {
    CompareOptions options;
    options.views.views = 2;
    options.views.width = 96;
    options.views.height = 64;
    return options;
}

TEST(Compare, EveryMetricOfAMeshWithItselfIsPerfect) {
    Mesh mesh = shapes::sphere(500, 3);
    mesh.colours.assign(mesh.positions.size(), {10, 200, 30});
    const auto frame = compare_frame(mesh, mesh, small_pictures());
    ASSERT_TRUE(frame.has_value());
    const ComparisonSummary s = summarise(as_sequence(*frame));
    EXPECT_EQ(s.m1_mm, 0);
    EXPECT_EQ(s.m1_colour, 0);
    EXPECT_TRUE(s.has_colour);
    EXPECT_NEAR(s.m2_mm, 0, 1e-6);
    EXPECT_TRUE(std::isinf(s.d1_db) && std::isinf(s.d2_db) && std::isinf(s.m3_foreground_db));
    EXPECT_TRUE(s.has_unlit && std::isinf(s.m3_unlit_foreground_db));
    EXPECT_NEAR(s.m3_ssim, 1, 1e-12);
    EXPECT_NEAR(s.m3_unlit_ssim, 1, 1e-12);
    EXPECT_NEAR(s.peak_mm, 1000 * std::sqrt(3.0), 1e-6);
    EXPECT_GT(s.foreground_share, 0.1);
    EXPECT_EQ(frame->decoded_topology.euler, 2);
}

TEST(Compare, AShiftShowsInEveryGeometricMetric) {
    const Mesh flat = shapes::plane(1000, 10, 0);
    const auto frame = compare_frame(flat, shapes::moved(flat, 0, 0, 2), small_pictures());
    ASSERT_TRUE(frame.has_value());
    const ComparisonSummary s = summarise(as_sequence(*frame), 2000);
    EXPECT_DOUBLE_EQ(s.m1_mm, 2);
    EXPECT_DOUBLE_EQ(s.m2_mm, 2);
    EXPECT_DOUBLE_EQ(s.hausdorff_mm, 2);
    EXPECT_NEAR(s.d1_db, 60, 1e-9);
    EXPECT_FALSE(s.has_colour);
}

TEST(Compare, FramesAddUpAsTheMetricsSay) {
    const Mesh flat = shapes::plane(100, 4, 0);
    SequenceComparison sums;
    sums += *compare_frame(flat, shapes::moved(flat, 0, 0, 1), small_pictures());
    sums += *compare_frame(flat, shapes::moved(flat, 0, 0, 3), small_pictures());
    const ComparisonSummary s = summarise(sums);
    EXPECT_EQ(sums.frames, 2u);
    EXPECT_DOUBLE_EQ(s.m1_mm, std::sqrt(5.0));  // eq. 9: root of the mean square
    EXPECT_DOUBLE_EQ(s.m2_mm, 2);               // eq. 11: mean of the roots
    EXPECT_DOUBLE_EQ(s.m2_worst_frame_mm, 3);
}

TEST(Compare, UnlitPicturesSeeTheColoursAlone) {
    Mesh mesh = shapes::sphere(500, 3);
    mesh.colours.assign(mesh.positions.size(), {100, 100, 100});
    Mesh recoloured = mesh;
    recoloured.colours.assign(mesh.positions.size(), {110, 110, 110});
    const ComparisonSummary s = summarise(as_sequence(*compare_frame(mesh, recoloured, small_pictures())));
    ASSERT_TRUE(s.has_unlit);
    EXPECT_NEAR(s.m3_unlit_foreground_db, 20 * std::log10(255.0 / 10), 1e-9);
    EXPECT_GT(s.m3_foreground_db, s.m3_unlit_foreground_db) << "shading makes the difference smaller";
    EXPECT_LT(s.m3_unlit_ssim, 1);
    EXPECT_GT(s.m3_unlit_ssim, 0.9);
}

TEST(Compare, WithoutColoursOfBothThereAreNoUnlitPictures) {
    const Mesh plain = shapes::sphere(500, 2);
    Mesh coloured = plain;
    coloured.colours.assign(plain.positions.size(), {1, 2, 3});
    EXPECT_FALSE(summarise(as_sequence(*compare_frame(plain, coloured, small_pictures()))).has_unlit);
    EXPECT_TRUE(summarise(as_sequence(*compare_frame(coloured, coloured, small_pictures()))).has_unlit);
    CompareOptions grey = small_pictures();
    grey.render.colours = false;
    EXPECT_FALSE(summarise(as_sequence(*compare_frame(coloured, coloured, grey))).has_unlit);
}

TEST(Compare, ATextureIsWhatPicturesShow) {
    TexturedMesh captured(shapes::plane(100, 4, 0));
    for (const auto& p : captured.mesh.positions) captured.mesh.texcoords.push_back({p[0] / 100, p[1] / 100});
    captured.texture = std::make_shared<const Image>(Image{2, 2, std::vector<std::uint8_t>(12, 90)});
    Mesh decoded = captured.mesh;
    decoded.texcoords.clear();
    EXPECT_FALSE(summarise(as_sequence(*compare_frame(captured, decoded, small_pictures()))).has_unlit);
    decoded.colours.assign(decoded.positions.size(), {90, 90, 90});
    const ComparisonSummary same = summarise(as_sequence(*compare_frame(captured, decoded, small_pictures())));
    ASSERT_TRUE(same.has_unlit);
    EXPECT_TRUE(std::isinf(same.m3_unlit_full_db));
    // The colours that were made of it are measured at vertices, and the texture by pictures.
    Mesh coloured = decoded;
    coloured.colours.assign(decoded.positions.size(), {100, 100, 100});
    const auto both = summarise(as_sequence(*compare_frame({coloured, captured}, coloured, small_pictures())));
    EXPECT_EQ(both.m1_colour, 0);
    EXPECT_NEAR(both.m3_unlit_foreground_db, 20 * std::log10(255.0 / 10), 1e-9);
}

TEST(Compare, OnlyWhatIsAskedForIsMeasured) {
    const Mesh flat = shapes::plane(100, 4, 0);
    CompareOptions options = small_pictures();
    options.surface = options.pictures = options.topology = options.cloud = false;
    const auto frame = compare_frame(flat, shapes::moved(flat, 0, 0, 1), options);
    ASSERT_TRUE(frame.has_value());
    EXPECT_GT(frame->points.forward.squared_distance, 0);
    EXPECT_EQ(frame->surface.forward.samples, 0u);
    EXPECT_EQ(frame->pictures.pixels, 0u);
    EXPECT_EQ(frame->original_topology.edges, 0u);
}

TEST(Compare, IsTheSameForAnyThreadCount) {
    std::mt19937 random(31);
    const Mesh a = shapes::soup(random, 200, 300), b = shapes::soup(random, 200, 300);
    CompareOptions options = small_pictures();
    const ComparisonSummary one = summarise(as_sequence(*compare_frame(a, b, options)));
    const internal::ThreadPool pool(4);
    options.threads = pool;
    const ComparisonSummary four = summarise(as_sequence(*compare_frame(a, b, options)));
    EXPECT_EQ(one.m1_mm, four.m1_mm);
    EXPECT_EQ(one.m1_colour, four.m1_colour);
    EXPECT_EQ(one.m2_mm, four.m2_mm);
    EXPECT_EQ(one.d2_db, four.d2_db);
    EXPECT_EQ(one.m3_foreground_db, four.m3_foreground_db);
    EXPECT_EQ(one.m3_ssim, four.m3_ssim);
}

TEST(Compare, RefusesMeshesThatCannotBeMeasured) {
    Mesh mesh = shapes::plane(10, 1, 0), bad = mesh;
    bad.positions[0][0] = std::numeric_limits<float>::infinity();
    EXPECT_EQ(compare_frame(mesh, bad).error().kind, ErrorKind::bad_input);
    bad = mesh;
    bad.triangles[0][0] = 1000;
    EXPECT_EQ(compare_frame(bad, mesh).error().kind, ErrorKind::bad_input);
}

TEST(Compare, GoesThroughEmptyAndTinyMeshes) {
    Mesh point, triangle;
    point.positions = {{1, 2, 3}};
    triangle.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    triangle.triangles = {{0, 1, 2}};
    const std::vector<Mesh> meshes{Mesh{}, point, triangle};
    for (const auto& a : meshes)
        for (const auto& b : meshes) EXPECT_TRUE(compare_frame(a, b, small_pictures()).has_value());
}

}  // namespace
}  // namespace htvm
