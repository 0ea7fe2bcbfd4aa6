// What every metric needs to know about a mesh. Vertices that no triangle names are not shown, and no metric counts
// them.
#include "metrics/mesh_measures.h"

#include <gtest/gtest.h>

#include "metrics/cloud_psnr.h"
#include "metrics/compare.h"
#include "metrics/point_error.h"
#include "metrics/shapes.h"
#include "metrics/smooth_picture.h"
#include "metrics/surface_error.h"

namespace htvm {
namespace {

Mesh coloured(Mesh mesh) {
    mesh.colours.assign(mesh.positions.size(), {100, 100, 100});
    return mesh;
}

// With a vertex far away, of another colour, that no triangle names, before and behind the others.
Mesh with_hidden(const Mesh& mesh) {
    Mesh out = mesh;
    out.positions.insert(out.positions.begin(), {-5000, 0, 9000});
    out.positions.push_back({5000, 7000, 0});
    if (!out.colours.empty()) {
        out.colours.insert(out.colours.begin(), {255, 0, 0});
        out.colours.push_back({0, 0, 255});
    }
    for (auto& t : out.triangles)
        for (auto& v : t) ++v;
    return out;
}

const Mesh ball = coloured(shapes::sphere(500, 3));
const Mesh hiding = with_hidden(ball);

TEST(SurfaceArea, OfASquareIsItsSidesProduct) {
    const Mesh plane = shapes::plane(30, 3, 7);
    EXPECT_DOUBLE_EQ(surface_area(plane.positions, plane.triangles), 900);
}

TEST(HiddenVertices, AreLeftOutOfAMeshWithTheirAttributes) {
    const auto left = without_hidden_vertices(hiding);
    ASSERT_TRUE(left.has_value());
    EXPECT_EQ(left->positions, ball.positions);
    EXPECT_EQ(left->colours, ball.colours);
    EXPECT_EQ(left->triangles, ball.triangles);
    EXPECT_FALSE(without_hidden_vertices(ball).has_value());
}

TEST(HiddenVertices, AreNoneInAPointCloud) {
    Mesh cloud;
    cloud.positions = {{0, 0, 0}, {1, 2, 3}};
    EXPECT_FALSE(without_hidden_vertices(cloud).has_value());
    EXPECT_EQ(bounding_box(cloud).high, (Point3{1, 2, 3}));
}

TEST(HiddenVertices, DoNotWidenTheBoundingBoxNorTheZoom) {
    EXPECT_EQ(bounding_box(hiding).low, bounding_box(ball).low);
    EXPECT_EQ(bounding_box(hiding).high, bounding_box(ball).high);
    const auto cameras = cameras_round(bounding_box(ball), ViewOptions{});
    ASSERT_TRUE(cameras.has_value());
    EXPECT_EQ(zoomed_to(hiding, cameras->front(), 0.1).scale, zoomed_to(ball, cameras->front(), 0.1).scale);
}

TEST(HiddenVertices, AreNoPointsOfAPointCloudMetric) {
    for (const auto& [a, b] : {std::pair{&ball, &hiding}, std::pair{&hiding, &ball}, std::pair{&hiding, &hiding}}) {
        EXPECT_EQ(m1_geometry(point_error(*a, *b)), 0);
        EXPECT_EQ(m1_colour(point_error(*a, *b)), 0);
        EXPECT_EQ(d1_error(cloud_error(*a, *b)), 0);
        EXPECT_EQ(d2_error(cloud_error(*a, *b)), 0);
    }
}

TEST(HiddenVertices, AreNotMeasuredFromWhereThereIsNoSurfaceToMeasureTo) {
    Mesh cloud;
    cloud.positions = ball.positions;
    EXPECT_EQ(surface_distances(hiding, cloud)->largest, 0);
}

TEST(HiddenVertices, ChangeNoMetricOfAComparison) {
    CompareOptions options;
    options.coverage = true;
    options.views.views = 2;
    options.views.width = options.views.height = 64;
    const Mesh other = shapes::moved(ball, 2, 1, 0);
    const auto plain = compare_frame(ball, other, options), hidden = compare_frame(hiding, with_hidden(other), options);
    ASSERT_TRUE(plain.has_value() && hidden.has_value());
    const auto a = summarise(as_sequence(*plain)), b = summarise(as_sequence(*hidden));
    EXPECT_EQ(hidden->original_vertices, ball.positions.size());
    EXPECT_EQ(hidden->decoded_vertices, ball.positions.size());
    EXPECT_EQ(a.peak_mm, b.peak_mm);
    EXPECT_EQ(a.m1_mm, b.m1_mm);
    EXPECT_EQ(a.m1_colour, b.m1_colour);
    EXPECT_EQ(a.m2_mm, b.m2_mm);
    EXPECT_EQ(a.hausdorff_mm, b.hausdorff_mm);
    EXPECT_EQ(plain->region.worst_mm, hidden->region.worst_mm);
    EXPECT_EQ(a.d1_db, b.d1_db);
    EXPECT_EQ(a.d2_db, b.d2_db);
    EXPECT_EQ(a.m3_foreground_db, b.m3_foreground_db);
    EXPECT_EQ(a.m3_unlit_full_db, b.m3_unlit_full_db);
    EXPECT_EQ(a.foreground_share, b.foreground_share);
    EXPECT_EQ(a.captured_covered, b.captured_covered);
    EXPECT_EQ(a.covered_m2_mm, b.covered_m2_mm);
    EXPECT_EQ(plain->decoded_topology.euler, hidden->decoded_topology.euler);
    EXPECT_EQ(plain->decoded_topology.components, hidden->decoded_topology.components);
}

}  // namespace
}  // namespace htvm
