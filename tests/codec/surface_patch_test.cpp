// Patches: what of a tracked mesh goes where tracking is lost, and the piece of the capture that comes in its place.
#include "codec/encoder/tracked/surface_patch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "codec/ball.h"
#include "codec/height_field.h"
#include "core/geometry.h"
#include "surface/surface_distance.h"

namespace htvm::internal {
namespace {

using test::ball;
using test::flat;
using test::height_field;
using test::surface_of;

constexpr double radius = 3200;
double round_radius(const Vector3d&) { return radius; }
// A cap around +z stands out.
double radius_with_cap(const Vector3d& d) { return radius + 700 * std::clamp((d[2] - 0.85) / 0.1, 0.0, 1.0); }

constexpr int coarse = 4, fine = 6;  // edges of some 300 and 75 lattice units: 19 and 5 mm

// A hill in the middle.
double hill(double x, double y) { return 600 * std::clamp((500 - std::hypot(x, y)) / 200, 0.0, 1.0); }
// The same in the middle of the side at large x.
double hill_at_border(double x, double y) { return hill(x - 2000, y); }

std::optional<SurfacePatch> patch_of(const LatticeMesh& decoded, const LatticeMesh& captured,
                                     const SurfacePatchOptions& options = {}, std::span<const LatticePoint> rest = {},
                                     LatticeUnits region_lost = {}) {
    const auto surface = surface_of(captured);
    return SurfacePatchSearch({decoded, rest}, captured, surface, options).find(region_lost);
}

LatticeMesh patched(const LatticeMesh& decoded, const SurfacePatch& patch) {
    LatticeMesh all = decoded;
    all.positions.insert(all.positions.end(), patch.positions.begin(), patch.positions.end());
    std::erase_if(all.triangles, [&](const Triangle& t) {
        return std::any_of(t.begin(), t.end(), [&](std::uint32_t v) { return patch.removed[v]; });
    });
    all.triangles.insert(all.triangles.end(), patch.triangles.begin(), patch.triangles.end());
    LatticeMesh out;
    std::map<std::uint32_t, std::uint32_t> number;
    for (auto t : all.triangles) {
        for (auto& v : t) {
            const auto [at, fresh] = number.try_emplace(v, static_cast<std::uint32_t>(number.size()));
            if (fresh) out.positions.push_back(all.positions.at(v));
            v = at->second;
        }
        out.triangles.push_back(t);
    }
    return out;
}

// The sides of triangles that no other triangle continues. Fails if two triangles have the same side, or one no area.
std::vector<std::pair<std::uint32_t, std::uint32_t>> open_sides(const LatticeMesh& mesh) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
    for (const auto& t : mesh.triangles) {
        EXPECT_GT(length(area_vector(std::span<const LatticePoint>(mesh.positions), t)), 0);
        for (std::size_t i = 0; i < 3; ++i) ++sides[{t[i], t[(i + 1) % 3]}];
    }
    std::vector<std::pair<std::uint32_t, std::uint32_t>> out;
    for (const auto& [side, count] : sides) {
        EXPECT_EQ(count, 1);
        if (sides.count({side.second, side.first}) == 0) out.push_back(side);
    }
    return out;
}

// The largest distance between the two surfaces, from either to the other.
double farthest(const LatticeMesh& a, const LatticeMesh& b) {
    const auto points_a = points_of(a.positions), points_b = points_of(b.positions);
    const SurfaceView view_a{points_a, a.triangles}, view_b{points_b, b.triangles};
    const SurfaceIndex index_a(points_a, a.triangles), index_b(points_b, b.triangles);
    return std::max(one_sided_errors(view_a, view_b, index_b).largest_distance,
                    one_sided_errors(view_b, view_a, index_a).largest_distance);
}

std::size_t removed_count(const SurfacePatch& patch) {
    return static_cast<std::size_t>(std::count(patch.removed.begin(), patch.removed.end(), true));
}

TEST(SurfacePatch, is_none_where_nothing_is_lost) {
    EXPECT_FALSE(patch_of(ball(coarse, round_radius), ball(fine, round_radius)).has_value());
    // Farther away than half of the limit everywhere, but nowhere farther than it.
    EXPECT_FALSE(
        patch_of(ball(coarse, round_radius), ball(fine, [](const Vector3d&) { return radius + 80; })).has_value());
}

TEST(SurfacePatch, puts_the_capture_where_a_part_has_moved_and_leaves_a_closed_surface_closed) {
    const auto decoded = ball(coarse, round_radius), captured = ball(fine, radius_with_cap);
    const SurfacePatchOptions options;
    const auto patch = patch_of(decoded, captured, options);
    ASSERT_TRUE(patch.has_value());
    const auto out = patched(decoded, *patch);
    EXPECT_TRUE(open_sides(out).empty());
    EXPECT_GT(farthest(decoded, captured), 600);
    EXPECT_LT(farthest(out, captured), options.lost.value);
    // The cap is a fourteenth of the sphere.
    for (std::size_t v = 0; v < decoded.positions.size(); ++v) {
        const double height = decoded.positions[v].z / radius;
        if (height > 0.9) {
            EXPECT_TRUE(patch->removed[v]) << height;
        } else if (height < 0.6) {
            EXPECT_FALSE(patch->removed[v]) << height;
        }
    }
    const auto whole = simplified_reference(captured, surface_of(captured), options.simplification);
    EXPECT_LT(patch->positions.size(), whole.positions.size() / 2);
}

TEST(SurfacePatch, takes_away_what_is_tracked_where_nothing_was_captured) {
    const auto decoded = ball(coarse + 1, radius_with_cap), captured = ball(fine, round_radius);
    const auto patch = patch_of(decoded, captured);
    ASSERT_TRUE(patch.has_value());
    const auto out = patched(decoded, *patch);
    EXPECT_TRUE(open_sides(out).empty());
    EXPECT_LT(farthest(out, captured), 48);
}

TEST(SurfacePatch, names_of_what_stays_only_vertices_on_the_open_border) {
    const auto decoded = ball(coarse, round_radius);
    const auto patch = patch_of(decoded, ball(fine, radius_with_cap));
    ASSERT_TRUE(patch.has_value());
    std::vector<bool> stays(decoded.positions.size()), goes(stays), named(stays);
    for (const auto& t : decoded.triangles) {
        const bool gone = patch->removed[t[0]] || patch->removed[t[1]] || patch->removed[t[2]];
        for (const auto v : t) (gone ? goes : stays)[v] = true;
    }
    for (const auto& t : patch->triangles)
        for (const auto v : t) {
            ASSERT_LT(v, decoded.positions.size() + patch->positions.size());
            if (v < named.size()) named[v] = true;
        }
    for (std::size_t v = 0; v < named.size(); ++v) {
        EXPECT_FALSE(named[v] && patch->removed[v]);
        EXPECT_EQ(named[v], stays[v] && goes[v]);
    }
}

TEST(SurfacePatch, has_the_colours_of_the_capture) {
    auto decoded = ball(coarse, round_radius), captured = ball(fine, radius_with_cap);
    decoded.colours.assign(decoded.positions.size(), {200, 0, 0});
    captured.colours.assign(captured.positions.size(), {10, 20, 30});
    const auto patch = patch_of(decoded, captured);
    ASSERT_TRUE(patch.has_value());
    EXPECT_EQ(patch->colours, std::vector<Colour>(patch->positions.size(), {10, 20, 30}));
}

TEST(SurfacePatch, leaves_the_border_of_the_capture_as_it_was) {
    const auto decoded = height_field(20, 200, flat), captured = height_field(80, 50, hill);
    const auto patch = patch_of(decoded, captured);
    ASSERT_TRUE(patch.has_value());
    const auto out = patched(decoded, *patch);
    EXPECT_EQ(open_sides(out).size(), open_sides(decoded).size());
    EXPECT_LT(farthest(out, captured), 48);
}

TEST(SurfacePatch, joins_a_region_at_the_border_of_the_capture_without_a_crack) {
    const auto decoded = height_field(20, 200, flat), captured = height_field(80, 50, hill_at_border);
    const auto patch = patch_of(decoded, captured);
    ASSERT_TRUE(patch.has_value());
    const auto out = patched(decoded, *patch);
    for (const auto& [from, to] : open_sides(out)) {
        const auto a = out.positions[from], b = out.positions[to];
        EXPECT_TRUE((std::abs(a.x) > 1960 && std::abs(b.x) > 1960) || (std::abs(a.y) > 1960 && std::abs(b.y) > 1960))
            << a.x << ' ' << a.y << " - " << b.x << ' ' << b.y;
    }
    EXPECT_LT(farthest(out, captured), 60);
}

// Two sheets back to back.
LatticeMesh two_sheets(const LatticeMesh& above, LatticeMesh below, std::int32_t apart) {
    auto out = above;
    const auto first = static_cast<std::uint32_t>(out.positions.size());
    for (auto& p : below.positions) p.z -= apart;
    out.positions.insert(out.positions.end(), below.positions.begin(), below.positions.end());
    for (const auto& t : below.triangles) out.triangles.push_back({t[0] + first, t[2] + first, t[1] + first});
    return out;
}

TEST(SurfacePatch, takes_nothing_from_a_sheet_that_faces_the_other_way) {
    const auto decoded = two_sheets(height_field(40, 100, flat), height_field(40, 100, flat), 60);
    const auto captured = two_sheets(height_field(80, 50, hill), height_field(80, 50, flat), 60);
    const auto patch = patch_of(decoded, captured);
    ASSERT_TRUE(patch.has_value());
    const std::size_t sheet = decoded.positions.size() / 2;
    EXPECT_EQ(std::count(patch->removed.begin() + static_cast<std::ptrdiff_t>(sheet), patch->removed.end(), true), 0);
    EXPECT_GT(removed_count(*patch), 10U);
    for (const auto& p : patch->positions) EXPECT_GT(p.z, -30);
    auto out = patched(decoded, *patch), above = captured;
    EXPECT_EQ(open_sides(out).size(), open_sides(decoded).size());
    for (auto* mesh : {&out, &above})
        std::erase_if(mesh->triangles, [&](const Triangle& t) { return mesh->positions[t[0]].z < -30; });
    EXPECT_LT(farthest(out, above), 48);
}

TEST(SurfacePatch, replaces_only_what_reaches_into_lost_cubes) {
    // Two hills, one twice as high as the other, in different cubes of space.
    const auto hills = [](double x, double y) { return hill(x + 1200, y + 1200) / 2 + hill(x - 1200, y - 1200); };
    const auto decoded = height_field(40, 100, flat), captured = height_field(80, 50, hills);
    const auto goes_at = [&](const std::optional<SurfacePatch>& patch, double x, double y) {
        bool any = false;
        for (std::size_t v = 0; v < decoded.positions.size(); ++v)
            any =
                any || (patch->removed[v] && std::hypot(decoded.positions[v].x - x, decoded.positions[v].y - y) < 400);
        return any;
    };
    SurfacePatchOptions options;
    options.region = LatticeUnits(2000);
    const auto both = patch_of(decoded, captured, options);
    ASSERT_TRUE(both.has_value());
    EXPECT_TRUE(goes_at(both, 1200, 1200));
    EXPECT_TRUE(goes_at(both, -1200, -1200));
    // RMS of the higher hill in its cube; of the other half as much.
    const auto higher = patch_of(decoded, captured, options, {}, LatticeUnits(125));
    ASSERT_TRUE(higher.has_value());
    EXPECT_TRUE(goes_at(higher, 1200, 1200));
    EXPECT_FALSE(goes_at(higher, -1200, -1200));
    // Where no cube is lost, what is lost by itself goes.
    EXPECT_EQ(patch_of(decoded, captured, options, {}, LatticeUnits(4000))->removed, both->removed);
}

TEST(SurfacePatch, is_none_if_too_much_is_lost) {
    const auto decoded = ball(coarse, round_radius), captured = ball(fine, radius_with_cap);
    SurfacePatchOptions options;
    options.most_share = 0.05;
    EXPECT_FALSE(patch_of(decoded, captured, options).has_value());
    const auto grown = ball(fine, [](const Vector3d&) { return radius + 400; });
    EXPECT_FALSE(patch_of(decoded, grown).has_value());
}

TEST(SurfacePatch, is_none_for_a_speck) {
    const auto spike = [](double x, double y) { return std::hypot(x, y) < 60 ? 300 : 0; };
    EXPECT_FALSE(patch_of(height_field(20, 200, flat), height_field(80, 50, spike)).has_value());
}

TEST(SurfacePatch, is_none_where_the_capture_has_a_hole) {
    auto captured = height_field(80, 50, flat);
    std::erase_if(captured.triangles, [&](const Triangle& t) {
        const auto p = captured.positions[t[0]];
        return std::hypot(p.x, p.y) < 600;
    });
    EXPECT_FALSE(patch_of(height_field(20, 200, flat), captured).has_value());
}

TEST(SurfacePatch, is_none_for_a_capture_of_its_own_far_from_the_mesh) {
    const auto decoded = ball(coarse, round_radius);
    auto captured = ball(fine, round_radius), other = ball(coarse, [](const Vector3d&) { return 600; });
    const auto first = static_cast<std::uint32_t>(captured.positions.size());
    for (const auto& p : other.positions) captured.positions.push_back({p.x + 6000, p.y, p.z});
    for (const auto& t : other.triangles) captured.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    EXPECT_FALSE(patch_of(decoded, captured).has_value());
}

TEST(SurfacePatch, replaces_triangles_that_are_stretched_though_they_lie_on_the_surface) {
    const auto decoded = height_field(20, 200, flat), captured = height_field(80, 50, flat);
    auto rest = decoded.positions;
    for (auto& p : rest)
        if (std::hypot(p.x, p.y) < 700) p = {p.x / 5, p.y / 5, p.z};
    EXPECT_FALSE(patch_of(decoded, captured, {}, decoded.positions).has_value());
    const auto patch = patch_of(decoded, captured, {}, rest);
    ASSERT_TRUE(patch.has_value());
    for (std::size_t v = 0; v < rest.size(); ++v) EXPECT_TRUE(patch->removed[v] || rest[v] == decoded.positions[v]);
    EXPECT_EQ(open_sides(patched(decoded, *patch)).size(), open_sides(decoded).size());
}

TEST(SurfacePatch, is_the_same_for_any_number_of_threads) {
    const auto decoded = ball(coarse, round_radius), captured = ball(fine, radius_with_cap);
    const ThreadPool threads(3);
    SurfacePatchOptions options;
    options.threads = options.simplification.threads = threads;
    const auto one = patch_of(decoded, captured), three = patch_of(decoded, captured, options);
    ASSERT_TRUE(one.has_value() && three.has_value());
    EXPECT_EQ(one->removed, three->removed);
    EXPECT_EQ(one->positions, three->positions);
    EXPECT_EQ(one->triangles, three->triangles);
}

TEST(SurfacePatch, is_the_same_with_triangles_that_name_a_vertex_twice) {
    auto decoded = ball(coarse, round_radius), captured = ball(fine, radius_with_cap);
    const auto without = patch_of(decoded, captured);
    const auto top = static_cast<std::uint32_t>(
        std::max_element(decoded.positions.begin(), decoded.positions.end(),
                         [](const LatticePoint& a, const LatticePoint& b) { return a.z < b.z; }) -
        decoded.positions.begin());
    decoded.triangles.push_back({top, top, top});
    captured.triangles.push_back({0, 0, captured.triangles[0][1]});
    const auto with = patch_of(decoded, captured);
    ASSERT_TRUE(without.has_value() && with.has_value());
    EXPECT_EQ(with->removed, without->removed);
    EXPECT_EQ(with->triangles, without->triangles);
}

TEST(SurfacePatch, of_nothing_or_of_a_textured_capture_is_none) {
    const auto decoded = height_field(20, 200, flat);
    auto captured = height_field(80, 50, hill);
    EXPECT_FALSE(patch_of({}, captured).has_value());
    EXPECT_FALSE(patch_of(decoded, {}).has_value());
    captured.texcoords.assign(captured.positions.size(), {1, 2});
    EXPECT_FALSE(patch_of(decoded, captured).has_value());
}

}  // namespace
}  // namespace htvm::internal
