// Charts: which triangles belong together, where they lie in the picture, and what is shown of them.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <set>

#include "codec/charts/chart_layer.h"
#include "codec/encoder/charts/captured_detail.h"
#include "codec/encoder/charts/chart_cut.h"
#include "codec/encoder/charts/chart_packing.h"
#include "core/geometry.h"
#include "core/raster.h"

namespace htvm::internal {
namespace {

constexpr StreamTexture picture_256 = {TextureLayout::charts, 256, 256};

// A ball of this radius, in lattice units, of rings of triangles.
LatticeMesh ball(double radius, int rings) {
    LatticeMesh mesh;
    const int around = 2 * rings;
    for (int i = 0; i <= rings; ++i)
        for (int j = 0; j < around; ++j) {
            const double polar = 3.14159265 * i / rings, azimuth = 2 * 3.14159265 * j / around;
            const auto on = [&](double c) { return static_cast<std::int32_t>(std::lround(radius * c)); };
            mesh.positions.push_back({on(std::sin(polar) * std::cos(azimuth)), on(std::cos(polar)),
                                      on(-std::sin(polar) * std::sin(azimuth))});
        }
    const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(i * around + j % around); };
    for (int i = 0; i < rings; ++i)
        for (int j = 0; j < around; ++j) {
            if (i > 0) mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
            if (i + 1 < rings) mesh.triangles.push_back({at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)});
        }
    return mesh;
}

// Two triangles side by side in the plane z = 0, facing +z.
LatticeMesh square(std::int32_t side) {
    LatticeMesh mesh;
    mesh.positions = {{0, 0, 0}, {side, 0, 0}, {side, side, 0}, {0, side, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}

ChartLayout one_chart(std::size_t triangles, std::uint32_t scale) {
    ChartLayout out;
    out.scale = scale;
    out.charts = {{}};
    out.chart_of_triangle.assign(triangles, 0);
    return out;
}

std::array<RasterPoint, 3> on_raster(const CornerTexcoords& corners, int width, int height) {
    std::array<RasterPoint, 3> out;
    for (std::size_t i = 0; i < 3; ++i)
        out[i] = {static_cast<std::int32_t>((std::int64_t{corners[i][0]} * width) >> (picture_bits - raster_bits)),
                  static_cast<std::int32_t>((std::int64_t{corners[i][1]} * height) >> (picture_bits - raster_bits))};
    return out;
}

TEST(Charts, PositionsSeenFromTheFrontAreTheCoordinatesTimesTheScale) {
    const auto mesh = square(100);
    auto layout = one_chart(2, 2u << 16 << texel_bits);  // two texels a lattice unit
    layout.charts[0].x = 10;
    layout.charts[0].y = 20;
    const auto corners = chart_texcoords(layout, {TextureLayout::charts, 256, 512}, mesh.positions, mesh.triangles);
    ASSERT_TRUE(corners);
    const auto texels = [](int x, int y) { return QuantisedTexcoord{x * 65536 / 256, y * 65536 / 512}; };
    EXPECT_EQ((*corners)[0], (CornerTexcoords{texels(10, 20), texels(210, 20), texels(210, 220)}));
    EXPECT_EQ((*corners)[1], (CornerTexcoords{texels(10, 20), texels(210, 220), texels(10, 220)}));
}

TEST(Charts, AChartBeyondThePictureIsAnError) {
    const auto mesh = square(100);
    auto layout = one_chart(2, 1u << 16 << texel_bits);
    layout.charts[0].x = 28;
    EXPECT_TRUE(chart_texcoords(layout, {TextureLayout::charts, 128, 128}, mesh.positions, mesh.triangles));
    layout.charts[0].x = 29;
    EXPECT_FALSE(chart_texcoords(layout, {TextureLayout::charts, 128, 128}, mesh.positions, mesh.triangles));
}

TEST(Charts, TheLargestMeshAtTheLargestScaleDoesNotOverflow) {
    LatticeMesh mesh;
    constexpr auto l = lattice_limit;
    mesh.positions = {{-l, -l, -l}, {l, l, -l}, {l, -l, l}};
    mesh.triangles = {{0, 1, 2}};
    auto layout = one_chart(1, largest_scale);
    layout.charts[0].size = largest_size;
    for (std::uint8_t largest = 0; largest < 4; ++largest) {
        layout.charts[0].rotation = {largest, {8192, -8192, 8192}};
        EXPECT_FALSE(chart_texcoords(layout, picture_256, mesh.positions, mesh.triangles));
    }
}

TEST(Charts, ALayerComesBackAsItWas) {
    const auto mesh = ball(2000, 12);
    std::mt19937 engine(1);
    const auto random = [&] { return static_cast<std::uint32_t>(engine()); };
    for (const std::uint32_t most : {1u, 3u, 40u, 255u}) {
        ChartLayout layout;
        layout.scale = 1 + random() % largest_scale;
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            const auto so_far = static_cast<std::uint32_t>(layout.charts.size());
            const bool begins = so_far == 0 || (so_far < most && random() % 3 == 0);
            layout.chart_of_triangle.push_back(begins ? so_far : random() % so_far);
            if (!begins) continue;
            Chart chart;
            chart.rotation.largest = static_cast<std::uint8_t>(random() % 4);
            for (auto& c : chart.rotation.others)
                c = static_cast<std::int16_t>(coarse_rotation * (static_cast<int>(random() % 129) - 64));
            chart.size = static_cast<std::int32_t>(1 + random() % largest_size);
            chart.x = static_cast<std::int32_t>(random() % 4096);
            chart.y = static_cast<std::int32_t>(random() % 4096);
            layout.charts.push_back(chart);
        }
        const auto bytes = encode_charts(layout, mesh.positions, mesh.triangles);
        const auto again = decode_charts(bytes, mesh.positions, mesh.triangles);
        ASSERT_TRUE(again) << again.error().message;
        EXPECT_EQ(again->scale, layout.scale);
        EXPECT_EQ(again->chart_of_triangle, layout.chart_of_triangle);
        ASSERT_EQ(again->charts.size(), layout.charts.size());
        for (std::size_t i = 0; i < layout.charts.size(); ++i) {
            EXPECT_EQ(again->charts[i].rotation, layout.charts[i].rotation);
            EXPECT_EQ(again->charts[i].size, layout.charts[i].size);
            EXPECT_EQ(again->charts[i].x, layout.charts[i].x);
            EXPECT_EQ(again->charts[i].y, layout.charts[i].y);
        }
    }
}

TEST(Charts, ALayerThatIsCutShortIsAnError) {
    const auto mesh = ball(2000, 12);
    const auto placed = lay_out(mesh.positions, mesh.triangles, picture_256);
    ASSERT_TRUE(placed);
    const std::span<const std::uint8_t> bytes = placed->layer;
    EXPECT_TRUE(decode_charts(bytes, mesh.positions, mesh.triangles));
    EXPECT_FALSE(decode_charts(bytes.first(bytes.size() / 2), mesh.positions, mesh.triangles));
    EXPECT_FALSE(decode_charts({}, mesh.positions, mesh.triangles));
}

TEST(Charts, ABallIsCutIntoAFewChartsThatFaceTheirDirection) {
    const auto mesh = ball(2000, 16);
    const auto layout = cut_into_charts(mesh.positions, mesh.triangles);
    EXPECT_GE(layout.charts.size(), 4u);
    EXPECT_LE(layout.charts.size(), 12u);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto matrix = rotation_matrix(layout.charts[layout.chart_of_triangle[t]].rotation);
        const Vector3d direction = {static_cast<double>(matrix[6]), static_cast<double>(matrix[7]),
                                    static_cast<double>(matrix[8])};
        const auto normal = area_vector(std::span(mesh.positions), mesh.triangles[t]);
        EXPECT_GT(dot(normalised(normal), normalised(direction)), 0.15) << t;
    }
}

// The texels of each triangle, and of which chart they are.
std::map<std::pair<int, int>, std::uint32_t> texels_of(std::span<const CornerTexcoords> corners,
                                                       std::span<const std::uint32_t> charts, int side,
                                                       std::size_t& twice) {
    std::map<std::pair<int, int>, std::uint32_t> out;
    for (std::size_t t = 0; t < corners.size(); ++t)
        for_each_cell(on_raster(corners[t], side, side), {0, 0, side, side}, [&](std::int32_t x, std::int32_t y) {
            twice += out.emplace(std::pair(x, y), charts[t]).second ? 0 : 1;
        });
    return out;
}

TEST(Charts, OfABallNoTexelBelongsToTwoTrianglesAndChartsAreEightTexelsApart) {
    const auto mesh = ball(2000, 16);
    const auto placed = lay_out(mesh.positions, mesh.triangles, picture_256);
    ASSERT_TRUE(placed);
    const auto layout = decode_charts(placed->layer, mesh.positions, mesh.triangles);
    ASSERT_TRUE(layout);
    std::size_t twice = 0;
    const auto texels = texels_of(placed->corners, layout->chart_of_triangle, 256, twice);
    EXPECT_LE(twice, texels.size() / 1000);
    EXPECT_GT(texels.size(), 256u * 256 * 2 / 5) << "two fifths of the picture are used";
    for (const auto& [at, chart] : texels) {
        EXPECT_LT(at.second, 256 * 0.93) << "room is left for patches";
        for (int dy = -7; dy <= 7; ++dy)
            for (int dx = -7; dx <= 7; ++dx) {
                const auto other = texels.find({at.first + dx, at.second + dy});
                if (other != texels.end()) {
                    ASSERT_EQ(other->second, chart) << at.first << " " << at.second;
                }
            }
    }
}

// How many texels the triangles have for what they have of area.
double density(const LatticeMesh& mesh, std::span<const CornerTexcoords> corners, bool upper) {
    double texels = 0, area = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        double height = 0;
        for (const auto v : mesh.triangles[t]) height += mesh.positions[v].y;
        if ((height > 0) != upper) continue;
        const auto& [a, b, c] = corners[t];
        texels += std::abs(
            static_cast<double>((b[0] - a[0]) * std::int64_t{c[1] - a[1]} - (c[0] - a[0]) * std::int64_t{b[1] - a[1]}));
        area += length(area_vector(std::span(mesh.positions), mesh.triangles[t]));
    }
    return texels / area;
}

TEST(Charts, WhereThereIsMoreToSeeChartsHaveMoreTexels) {
    const auto mesh = ball(2000, 16);
    std::vector<float> detail;
    for (const auto& p : mesh.positions) detail.push_back(p.y > 0 ? 4.0F : 1.0F);
    const auto even = lay_out(mesh.positions, mesh.triangles, picture_256);
    const auto uneven = lay_out(mesh.positions, mesh.triangles, picture_256, detail);
    ASSERT_TRUE(even && uneven);
    EXPECT_NEAR(density(mesh, even->corners, true) / density(mesh, even->corners, false), 1, 0.2);
    EXPECT_GT(density(mesh, uneven->corners, true), 1.6 * density(mesh, uneven->corners, false));
}

TEST(Charts, ThereIsMoreToSeeWhereCapturedColoursChange) {
    // A sheet whose right half is striped.
    std::vector<Vector3f> positions;
    std::vector<Triangle> triangles;
    constexpr std::uint32_t side = 40;
    for (std::uint32_t j = 0; j < side; ++j)
        for (std::uint32_t i = 0; i < side; ++i) {
            positions.push_back({static_cast<float>(10 * i), static_cast<float>(10 * j), 0});
            if (i + 1 == side || j + 1 == side) continue;
            const auto a = j * side + i, b = a + side;
            triangles.push_back({a, a + 1, b + 1});
            triangles.push_back({a, b + 1, b});
        }
    SurfaceIndex captured(positions, triangles, {.cell = 20});
    const std::vector<LatticePoint> at = {{100, 200, 0}, {300, 200, 0}};
    EXPECT_TRUE(captured_detail(at, captured).empty()) << "without colours nothing is known";
    for (const auto& p : positions) {
        const bool light = p[0] > 200 && static_cast<int>(p[0]) / 10 % 2 == 0;
        captured.colours.push_back(light ? Colour{150, 150, 150} : Colour{100, 100, 100});
    }
    const auto detail = captured_detail(at, captured);
    ASSERT_EQ(detail.size(), 2u);
    EXPECT_EQ(detail[0], 0);
    // Those edges at a vertex that lie across change by 50 levels: along x within 10 units, aslant within 14.
    EXPECT_NEAR(static_cast<double>(detail[1]), 50 * 2 / (10 + 10 + 14.14), 0.3);
}

TEST(Charts, ASheetThatIsFoldedBackOverItselfIsCutAtTheFold) {
    LatticeMesh mesh;  // a strip that goes to x = 1000 at z = 0 and comes back, rising slowly, so that it hides itself
    for (int i = 0; i <= 20; ++i)
        for (int j = 0; j <= 4; ++j) {
            const double along = i <= 10 ? i * 100.0 : 2000 - i * 100.0;
            mesh.positions.push_back({static_cast<std::int32_t>(along), 100 * j, i <= 10 ? 0 : 50 * (i - 10)});
        }
    for (std::uint32_t i = 0; i < 20; ++i)
        for (std::uint32_t j = 0; j < 4; ++j) {
            const std::uint32_t a = 5 * i + j, b = a + 5;
            mesh.triangles.push_back({a, b, b + 1});
            mesh.triangles.push_back({a, b + 1, a + 1});
        }
    const auto placed = lay_out(mesh.positions, mesh.triangles, picture_256);
    ASSERT_TRUE(placed);
    const auto layout = decode_charts(placed->layer, mesh.positions, mesh.triangles);
    ASSERT_TRUE(layout);
    EXPECT_NE(layout->chart_of_triangle.front(), layout->chart_of_triangle.back());
    std::size_t twice = 0;
    texels_of(placed->corners, layout->chart_of_triangle, 256, twice);
    EXPECT_EQ(twice, 0u);
}

TEST(Charts, AnySoupOfTrianglesHasALayout) {
    std::mt19937 engine(7);
    const auto random = [&] { return static_cast<std::uint32_t>(engine()); };
    for (const std::size_t triangles : {1u, 30u, 400u}) {
        LatticeMesh mesh;
        for (std::size_t v = 0; v < 60; ++v) {
            const auto any = [&] { return static_cast<std::int32_t>(random() % 4001) - 2000; };
            mesh.positions.push_back({any(), any(), any()});
        }
        for (std::size_t t = 0; t < triangles; ++t) {
            const auto any = [&] { return static_cast<std::uint32_t>(random() % 60); };
            mesh.triangles.push_back({any(), any(), any()});
        }
        const auto placed = lay_out(mesh.positions, mesh.triangles, {TextureLayout::charts, 1024, 1024});
        ASSERT_TRUE(placed) << placed.error().message;
        EXPECT_TRUE(textured_surface(mesh.positions.size(), mesh.triangles, placed->corners));
    }
}

TEST(Charts, APieceIsLaidOutWhereThePictureIsFree) {
    const auto mesh = ball(2000, 16);
    const auto whole = lay_out(mesh.positions, mesh.triangles, picture_256);
    ASSERT_TRUE(whole);
    // Every tenth of the ball's triangles goes and comes again.
    const std::size_t goes = mesh.triangles.size() / 10;
    const auto stays = std::span(whole->corners).subspan(goes);
    const auto piece = std::span(mesh.triangles).first(goes);
    const auto placed = lay_out_beside(mesh.positions, piece, picture_256, stays, whole->scale);
    ASSERT_TRUE(placed);
    EXPECT_EQ(placed->scale, whole->scale);
    std::vector<std::uint32_t> which(stays.size(), 0);
    auto all = std::vector(stays.begin(), stays.end());
    all.insert(all.end(), placed->corners.begin(), placed->corners.end());
    which.resize(all.size(), 1);
    std::size_t twice = 0;
    const auto texels = texels_of(all, which, 256, twice);
    EXPECT_LE(twice, texels.size() / 1000);
    for (const auto& [at, chart] : texels)
        for (int dy = -7; dy <= 7 && chart == 1; ++dy)
            for (int dx = -7; dx <= 7; ++dx) {
                const auto other = texels.find({at.first + dx, at.second + dy});
                if (other != texels.end()) {
                    ASSERT_EQ(other->second, 1u) << at.first << " " << at.second;
                }
            }
}

TEST(Charts, WhereThePictureIsFullNoPieceFits) {
    const auto mesh = ball(2000, 16);
    const auto whole = lay_out(mesh.positions, mesh.triangles, picture_256);
    ASSERT_TRUE(whole);
    EXPECT_FALSE(lay_out_beside(mesh.positions, mesh.triangles, picture_256, whole->corners, 2 * whole->scale));
}

TEST(Charts, AVertexOfTwoPairsOfCoordinatesIsRepeatedBehindTheMesh) {
    auto mesh = square(10);
    mesh.colours = {{1, 1, 1}, {2, 2, 2}, {3, 3, 3}, {4, 4, 4}};
    const CornerTexcoords first = {{{0, 0}, {10, 0}, {10, 10}}}, second = {{{100, 0}, {110, 10}, {100, 10}}};
    const auto textured = textured_surface(4, mesh.triangles, {first, second});
    ASSERT_TRUE(textured);
    EXPECT_EQ(textured->copied, (std::vector<std::uint32_t>{0, 2}));
    EXPECT_EQ(textured->triangles, (std::vector<Triangle>{{0, 1, 2}, {4, 5, 3}}));
    EXPECT_EQ(textured->texcoords,
              (std::vector<QuantisedTexcoord>{{0, 0}, {10, 0}, {10, 10}, {100, 10}, {100, 0}, {110, 10}}));
    const auto shown = shown_mesh(mesh, *textured);
    EXPECT_EQ(shown.positions[4], mesh.positions[0]);
    EXPECT_EQ(shown.positions[5], mesh.positions[2]);
    EXPECT_EQ(shown.colours[5], mesh.colours[2]);
}

TEST(Charts, DetailLiesInTheMiddleOfItsEdgesInEachChart) {
    auto mesh = square(10);
    const CornerTexcoords first = {{{0, 0}, {10, 0}, {10, 10}}}, second = {{{100, 0}, {110, 10}, {100, 10}}};
    // The diagonal, which is a seam, is cut, and one side of the first triangle.
    const auto edges = find_edges(4, mesh.triangles);
    std::vector<std::uint8_t> split;
    for (const auto& ends : edges.ends)
        split.push_back(ends == std::array{0u, 2u} || ends == std::array{0u, 1u} ? 1 : 0);
    SurfaceDetail detail;
    detail.levels.push_back(*split_edges(places_of(mesh.positions), mesh.triangles, edges, split, 100));
    detail.rules.emplace_back();
    detail.displacements.assign(2, 0);
    const auto textured = textured_surface(4, mesh.triangles, {first, second}, detail, 1);
    ASSERT_TRUE(textured);
    // On the diagonal one vertex has two places, the ends' middles in either triangle.
    const auto on_side = detail.levels[0].stencils[0].b == 1 ? 4u : 5u, on_diagonal = 9 - on_side;
    EXPECT_EQ(textured->texcoords[on_side], (QuantisedTexcoord{5, 0}));
    EXPECT_EQ(textured->texcoords[on_diagonal], (QuantisedTexcoord{5, 5}));
    EXPECT_EQ(textured->triangles.size(), 5u);
    ASSERT_EQ(textured->copied.size(), 3u);
    const auto copy = std::find(textured->copied.begin(), textured->copied.end(), on_diagonal);
    ASSERT_NE(copy, textured->copied.end());
    EXPECT_EQ(textured->texcoords[6 + static_cast<std::size_t>(copy - textured->copied.begin())],
              (QuantisedTexcoord{105, 5}));
    EXPECT_EQ(shown_mesh(detailed(detail, mesh), *textured).positions.size(), 9u);
}

TEST(Charts, AVertexInTooManyChartsIsAnError) {
    std::vector<Triangle> triangles;
    std::vector<CornerTexcoords> corners;
    for (int i = 0; i < 256; ++i) {
        triangles.push_back({0, 1, 2});
        corners.push_back({{{i, 0}, {0, 0}, {0, 0}}});
    }
    EXPECT_FALSE(textured_surface(3, triangles, corners));
    triangles.pop_back();
    corners.pop_back();
    const auto textured = textured_surface(3, triangles, corners);
    ASSERT_TRUE(textured);
    EXPECT_EQ(textured->copied.size(), 254u);
}

TEST(Charts, TrianglesThatStayKeepTheirCorners) {
    const std::vector<Triangle> triangles = {{0, 1, 2}, {1, 3, 2}, {2, 3, 4}};
    const auto numbered = [](int n) { return CornerTexcoords{{{n, 0}, {n, 1}, {n, 2}}}; };
    const std::vector<CornerTexcoords> before = {numbered(0), numbered(1), numbered(2)};
    const std::vector<std::uint32_t> stays = {1, 2, 3, 4};
    EXPECT_EQ(corners_that_stay(before, triangles, 5, stays), (std::vector<CornerTexcoords>{numbered(1), numbered(2)}));
}

}  // namespace
}  // namespace htvm::internal
