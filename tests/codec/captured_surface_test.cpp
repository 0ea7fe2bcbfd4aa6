// The targets of tracked frames: those of a moved reference, the simplified reference, and the fit of the result.
#include "codec/encoder/tracked/captured_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>

#include "codec/height_field.h"

namespace htvm::internal {
namespace {

using test::flat;
using test::height_field;
using test::surface_of;

double bowl(double x, double y) { return -(x * x + y * y) / 4000; }

TrackedTargets targets_of(const LatticeMesh& reference, const LatticeMesh& captured, const TargetSearch& how = {}) {
    const auto normals = vertex_normals(reference.positions, reference.triangles);
    return find_tracked_targets({reference.positions, normals, reference.triangles, reference.colours}, captured,
                                surface_of(captured), how);
}

TEST(TrackedTargets, are_the_distance_along_the_normal) {
    const auto captured = height_field(40, 30, [](double, double) { return 24; });
    for (const auto samples : {TargetSamples::middles, TargetSamples::three})
        for (const auto d : targets_of(height_field(10, 100, flat), captured, {.samples = samples}).displacement)
            EXPECT_EQ(d, 24);
}

TEST(TrackedTargets, are_nearer_to_a_noisy_surface_s_mean_with_more_samples) {
    auto captured = height_field(100, 20, flat);
    std::mt19937 random(1);
    for (auto& p : captured.positions) p.z += static_cast<std::int32_t>(random() % 61) - 30;
    const auto reference = height_field(20, 100, flat);
    const auto squares = [&](TargetSamples samples) {
        double sum = 0;
        for (const double d : targets_of(reference, captured, {.samples = samples}).displacement) sum += d * d;
        return sum;
    };
    EXPECT_LT(squares(TargetSamples::three), 0.9 * squares(TargetSamples::middles));
}

TEST(TrackedTargets, lay_the_triangles_of_a_coarse_mesh_on_a_bent_surface_not_only_its_vertices) {
    const auto captured = height_field(64, 25, bowl);
    const auto reference = height_field(8, 200, bowl);  // vertices on the surface, triangles below it
    const auto targets = targets_of(reference, captured);
    const auto moved =
        displaced(reference.positions, vertex_normals(reference.positions, reference.triangles), targets.displacement);
    EXPECT_GT(std::accumulate(targets.displacement.begin(), targets.displacement.end(), 0), 0);
    auto fitted = reference;
    fitted.positions = moved;
    TrackedFitOptions options;
    const auto before = measure_tracked_fit(surface_of(captured), reference, {}, {}, options);
    const auto after = measure_tracked_fit(surface_of(captured), fitted, {}, {}, options);
    EXPECT_LT(after.rms.value, 0.75 * before.rms.value);
}

TEST(TrackedTargets, beyond_what_a_field_can_code_are_clamped_to_it) {
    const auto reference = height_field(4, 100, flat);
    for (const int side : {1, -1}) {
        const auto captured = height_field(4, 100, [&](double, double) { return side * (field_limit + 5000.0); });
        const auto targets = targets_of(reference, captured, {.reach = LatticeUnits(2.0 * field_limit)});
        EXPECT_EQ(targets.displacement, std::vector<std::int32_t>(25, side * field_limit));
        const auto hierarchy = build_vertex_hierarchy(reference.positions, reference.triangles).value();
        const auto coded = encode_field(hierarchy, targets.displacement, 1);
        ASSERT_TRUE(coded.has_value()) << coded.error().message;
        for (const auto d : coded->values) EXPECT_NEAR(d, side * field_limit, 32);
    }
}

TEST(TrackedTargets, are_taken_from_neighbours_where_nothing_is_in_reach) {
    auto captured = height_field(40, 30, [](double, double) { return 16; });
    std::erase_if(captured.triangles, [&](const Triangle& t) { return captured.positions[t[0]].x > 200; });
    const auto targets = targets_of(height_field(10, 100, flat), captured, {.reach = LatticeUnits(60)});
    for (const auto d : targets.displacement) EXPECT_NEAR(d, 16, 2);
}

TEST(TrackedTargets, ask_for_the_colours_that_are_there_whatever_the_sampling) {
    auto captured = height_field(40, 30, flat);
    for (const auto p : captured.positions)
        captured.colours.push_back(
            {static_cast<std::uint8_t>(128 + p.x / 10), 40, static_cast<std::uint8_t>(128 - p.y / 10)});
    auto reference = height_field(7, 130, flat);
    reference.colours.assign(reference.positions.size(), {100, 100, 100});
    const auto targets = targets_of(reference, captured);
    ASSERT_EQ(targets.colours.size(), 3 * reference.positions.size());
    for (std::size_t v = 0; v < reference.positions.size(); ++v) {
        EXPECT_NEAR(targets.colours[3 * v], 28 + reference.positions[v].x / 10, 1);
        EXPECT_NEAR(targets.colours[3 * v + 1], -60, 1);
        EXPECT_NEAR(targets.colours[3 * v + 2], 28 - reference.positions[v].y / 10, 1);
    }
}

TEST(TrackedTargets, are_the_same_for_any_number_of_threads) {
    const auto captured = height_field(64, 25, bowl);
    const auto reference = height_field(20, 80, flat);
    EXPECT_EQ(targets_of(reference, captured).displacement,
              targets_of(reference, captured, {.threads = ThreadPool(3)}).displacement);
}

TEST(TrackedTargets, of_nothing_are_nothing) {
    EXPECT_TRUE(targets_of({}, height_field(4, 30, flat)).displacement.empty());
    for (const auto d : targets_of(height_field(4, 100, flat), {}).displacement) EXPECT_EQ(d, 0);
}

TEST(SimplifiedReference, has_fewer_vertices_within_the_error) {
    auto captured = height_field(64, 25, bowl);
    captured.colours.assign(captured.positions.size(), {9, 8, 7});
    captured.normals.assign(captured.positions.size(), {0, 0, 127});
    SimplifiedReferenceOptions options;
    options.surface_error = LatticeUnits(8);
    const auto out = simplified_reference(captured, surface_of(captured), options);
    EXPECT_LT(out.positions.size(), captured.positions.size() / 5);
    EXPECT_LT(measure_tracked_fit(surface_of(captured), out, {}, {}, {}).rms.value, 8);
    ASSERT_EQ(out.colours.size(), out.positions.size());
    EXPECT_EQ(out.colours[0], (Colour{9, 8, 7}));
    EXPECT_EQ(out.normals.size(), out.positions.size());
}

TEST(SimplifiedReference, does_not_gape_where_a_seam_has_two_vertices_in_the_same_place) {
    const auto whole = height_field(32, 25, bowl);
    auto cut = whole;  // the triangles of the right half get vertices of their own along the middle
    for (auto& t : cut.triangles) {
        const bool right = std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return whole.positions[v].x >= 0; });
        if (!right) continue;
        for (auto& v : t)
            if (whole.positions[v].x == 0) {
                cut.positions.push_back(whole.positions[v]);
                v = static_cast<std::uint32_t>(cut.positions.size() - 1);
            }
    }
    SimplifiedReferenceOptions options;
    options.surface_error = LatticeUnits(8);
    const auto out = simplified_reference(cut, surface_of(cut), options);
    EXPECT_LT(out.positions.size(), whole.positions.size() / 4);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
    for (const auto& t : out.triangles)
        for (std::size_t i = 0; i < 3; ++i) ++sides[std::minmax(t[i], t[(i + 1) % 3])];
    for (const auto& [edge, count] : sides) {
        const auto a = out.positions[edge.first], b = out.positions[edge.second];
        const bool inside = std::abs(a.x + b.x) < 600 && std::abs(a.y + b.y) < 600;
        EXPECT_TRUE(!inside || count == 2) << a.x << " " << a.y;
    }
}

TEST(SimplifiedReference, with_texture_coordinates_or_without_triangles_is_the_captured_mesh) {
    auto captured = height_field(8, 25, flat);
    captured.texcoords.assign(captured.positions.size(), {1, 2});
    EXPECT_EQ(simplified_reference(captured, surface_of(captured), {}).positions, captured.positions);
    LatticeMesh points;
    points.positions = {{1, 2, 3}, {4, 5, 6}};
    EXPECT_EQ(simplified_reference(points, surface_of(points), {}).positions, points.positions);
}

TEST(TrackedFit, of_the_same_surface_is_nothing) {
    const auto captured = height_field(64, 25, bowl);
    const auto fit = measure_tracked_fit(surface_of(captured), captured, {}, {}, {});
    EXPECT_LT(fit.rms.value, 0.5);
    EXPECT_EQ(fit.stray_share, 0);
}

TEST(TrackedFit, tells_of_one_region_that_does_not_fit_where_the_whole_hardly_shows_it) {
    const auto captured = height_field(100, 25, flat);
    const auto bumped = height_field(100, 25, [](double x, double y) { return x * x + y * y < 200 * 200 ? 100 : 0; });
    TrackedFitOptions options;
    options.region = LatticeUnits(500);
    const auto fit = measure_tracked_fit(surface_of(captured), bumped, {}, {}, options);
    EXPECT_LT(fit.rms.value, 20);
    EXPECT_GT(fit.worst_region.value, 2 * fit.rms.value);
}

TEST(TrackedFit, counts_what_one_surface_lacks_as_strays_both_ways) {
    const auto whole = height_field(64, 25, flat);
    auto part = whole;
    std::erase_if(part.triangles, [&](const Triangle& t) { return part.positions[t[0]].x > 400; });
    EXPECT_GT(measure_tracked_fit(surface_of(whole), part, {}, {}, {}).stray_share, 0.05);
    const auto intra = measure_tracked_fit(surface_of(whole), whole, {}, {}, {});
    EXPECT_GT(measure_tracked_fit(surface_of(part), whole, {}, intra.squared, {}).stray_share, 0.05);
}

TEST(TrackedFit, does_not_hold_against_a_frame_what_its_intra_frame_was_off_already) {
    // The decoded mesh continues beyond the end of the captured one, as far as in the I-frame or farther.
    const auto ending_at = [](std::int32_t end) {
        auto mesh = height_field(64, 25, flat);
        std::erase_if(mesh.triangles, [&](const Triangle& t) {
            return std::any_of(t.begin(), t.end(), [&](std::uint32_t v) { return mesh.positions[v].x > end; });
        });
        return surface_of(mesh);
    };
    const auto decoded = height_field(64, 25, flat);
    const auto intra = measure_tracked_fit(ending_at(600), decoded, {}, {}, {});
    EXPECT_GT(*std::max_element(intra.squared.begin(), intra.squared.end()), 100 * 100);
    const auto same = measure_tracked_fit(ending_at(600), decoded, {}, intra.squared, {});
    EXPECT_EQ(same.rms.value, 0);
    EXPECT_EQ(same.worst_region.value, 0);
    EXPECT_EQ(same.squared, intra.squared);  // what is reported is what was measured
    const std::vector<double> perfect(intra.squared.size(), 0);
    EXPECT_GT(measure_tracked_fit(ending_at(600), decoded, {}, perfect, {}).rms.value, 10);
    EXPECT_GT(measure_tracked_fit(ending_at(300), decoded, {}, intra.squared, {}).rms.value, 10);
}

}  // namespace
}  // namespace htvm::internal
