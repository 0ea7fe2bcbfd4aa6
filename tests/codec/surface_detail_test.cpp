#include "codec/reference/surface_detail.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "codec/ball.h"
#include "codec/levels_by_chance.h"
#include "codec/tracked/presence.h"

namespace htvm::internal {
namespace {

using namespace test;

// A bent surface with two levels of detail and one that rounds off.
LeveledFrame some_detail(unsigned seed = 1, std::uint32_t step = 256) {
    LeveledByChanceOptions options;
    options.levels.depth = {2, 250};
    options.levels.rules.fill({2, 8});
    options.levels.rounded = 40;
    options.levels.step = step;
    options.referred = 0;
    options.normals = true;
    options.most_displacement = 3;
    std::mt19937 random(seed);
    return leveled_by_chance(ball(2, [](const Vector3d& d) { return 900 + 200 * d[1] * d[0]; }), options, random)
        ->frame;
}

std::vector<LatticePoint> with_detail(const LeveledFrame& frame, std::vector<LatticePoint> positions) {
    add_detail(frame.detail, frame.detail.levels.size(), frame.mesh.triangles, positions);
    return positions;
}

TEST(SurfaceDetail, it_moves_with_the_reference) {
    const auto frame = some_detail();
    const auto whole = with_detail(frame, frame.mesh.positions);
    auto shifted = frame.mesh.positions;
    for (auto& p : shifted) p = {p.x + 700, p.y - 41, p.z + 5};
    shifted = with_detail(frame, shifted);
    for (std::size_t v = 0; v < whole.size(); ++v)
        ASSERT_EQ(shifted[v], (LatticePoint{whole[v].x + 700, whole[v].y - 41, whole[v].z + 5}));
}

TEST(SurfaceDetail, it_turns_with_the_reference_up_to_a_lattice_unit) {
    const auto frame = some_detail();
    const auto turned = [](LatticePoint p) { return LatticePoint{-p.y, p.x, p.z}; };
    const auto whole = with_detail(frame, frame.mesh.positions);
    auto positions = frame.mesh.positions;
    for (auto& p : positions) p = turned(p);
    positions = with_detail(frame, positions);
    for (std::size_t v = 0; v < whole.size(); ++v) {
        const auto p = turned(whole[v]);
        ASSERT_LE(std::abs(positions[v].x - p.x), 1);
        ASSERT_LE(std::abs(positions[v].y - p.y), 1);
        ASSERT_LE(std::abs(positions[v].z - p.z), 1);
    }
}

TEST(SurfaceDetail, fewer_levels_are_the_first_vertices_of_all) {
    const auto frame = some_detail();
    const auto whole = with_detail(frame, frame.mesh.positions);
    for (std::size_t levels = 0; levels < frame.detail.levels.size(); ++levels) {
        auto positions = frame.mesh.positions;
        add_detail(frame.detail, levels, frame.mesh.triangles, positions);
        ASSERT_EQ(positions.size(), frame.detail.levels[levels].first);
        ASSERT_TRUE(std::equal(positions.begin(), positions.end(), whole.begin()));
    }
}

TEST(SurfaceDetail, a_triangle_of_the_reference_is_shown_with_all_that_is_cut_from_it_or_not_at_all) {
    const auto frame = some_detail();
    const auto& levels = frame.detail.levels;
    std::mt19937 random(1);
    for (const unsigned of : {2u, 5u, 50u}) {
        std::vector<std::uint8_t> of_reference;
        for (std::size_t v = 0; v < frame.mesh.positions.size(); ++v) of_reference.push_back(random() % of != 0);
        auto presence = of_reference;
        add_detail(frame.detail, levels.size(), presence);
        ASSERT_EQ(presence.size(), of_reference.size() + frame.detail.vertices());
        const auto is_there = [&](const Triangle& t) { return presence[t[0]] && presence[t[1]] && presence[t[2]]; };
        for (std::uint32_t t = 0; t < levels.back().triangles.size(); ++t) {
            std::uint32_t from = t;
            for (std::size_t k = levels.size(); k > 0; --k) from = levels[k - 1].parent[from];
            ASSERT_EQ(is_there(levels.back().triangles[t]), is_there(frame.mesh.triangles[from]));
        }
    }
}

TEST(SurfaceDetail, normals_are_means_and_those_of_a_mirrored_surface_are_mirrored) {
    const auto frame = some_detail();
    auto normals = frame.mesh.normals, mirrored = normals;
    for (auto& n : mirrored) n = {-n[0], -n[1], -n[2]};
    add_detail(frame.detail, frame.detail.levels.size(), normals);
    add_detail(frame.detail, frame.detail.levels.size(), mirrored);
    ASSERT_EQ(normals.size(), frame.mesh.normals.size() + frame.detail.vertices());
    for (std::size_t v = 0; v < normals.size(); ++v)
        ASSERT_EQ(mirrored[v], (QuantisedNormal{-normals[v][0], -normals[v][1], -normals[v][2]}));
}

// ---- After a patch --------------------------------------------------------------------------------------------------

struct Patched {
    LatticeMesh mesh;
    std::vector<std::uint32_t> stays;
};
Patched without(const LatticeMesh& mesh, const std::vector<bool>& goes) {
    Patched out;
    std::vector<std::uint32_t> number(mesh.positions.size(), no_element);
    for (std::uint32_t v = 0; v < goes.size(); ++v) {
        if (goes[v]) continue;
        number[v] = static_cast<std::uint32_t>(out.stays.size());
        out.stays.push_back(v);
        out.mesh.positions.push_back(mesh.positions[v]);
    }
    for (const auto& t : mesh.triangles)
        if (!goes[t[0]] && !goes[t[1]] && !goes[t[2]])
            out.mesh.triangles.push_back({number[t[0]], number[t[1]], number[t[2]]});
    return out;
}

using Ends = std::array<std::uint32_t, 2>;
Ends sorted(std::uint32_t a, std::uint32_t b) { return {std::min(a, b), std::max(a, b)}; }

TEST(SurfaceDetail, where_all_stays_all_of_it_stays) {
    // Displacements are small: with others a triangle may be cut along another diagonal than that of the base as it
    // was.
    const auto frame = some_detail(1, 16);
    const auto all = without(frame.mesh, std::vector<bool>(frame.mesh.positions.size(), false));
    const auto after = detail_that_stays(frame.detail, frame.mesh.positions.size(), all.stays, all.mesh);
    EXPECT_EQ(after.rules, frame.detail.rules);
    EXPECT_EQ(after.displacements, frame.detail.displacements);
    EXPECT_EQ(after.colours, frame.detail.colours);
    ASSERT_EQ(after.levels.size(), frame.detail.levels.size());
    EXPECT_EQ(after.levels.back().triangles, frame.detail.levels.back().triangles);
}

TEST(SurfaceDetail, exactly_the_splits_whose_ends_stay_are_kept_with_their_displacements_and_colours) {
    for (unsigned seed = 1; seed < 6; ++seed) {
        const auto frame = some_detail(seed);
        const auto& before = frame.detail;
        const auto vertices = static_cast<std::uint32_t>(frame.mesh.positions.size());
        std::mt19937 random(seed);
        std::vector<bool> goes;
        for (std::size_t v = 0; v < vertices; ++v) goes.push_back(random() % 8 == 0);
        const auto patched = without(frame.mesh, goes);
        const auto after = detail_that_stays(before, vertices, patched.stays, patched.mesh);
        // Numbers before of the vertices after.
        auto old = patched.stays;
        std::vector<Triangle> above = patched.mesh.triangles;
        for (std::size_t k = 0; k < after.levels.size(); ++k) {
            std::map<Ends, std::uint32_t> splits;
            for (std::uint32_t i = 0; i < before.levels[k].stencils.size(); ++i) {
                const auto& s = before.levels[k].stencils[i];
                splits[sorted(s.a, s.b)] = before.levels[k].first + i;
            }
            std::size_t wanted = 0;
            for (const auto& [a, b] : find_edges(old.size(), above).ends)
                wanted += splits.contains(sorted(old[a], old[b]));
            ASSERT_EQ(after.levels[k].stencils.size(), wanted);
            ASSERT_EQ(after.levels[k].first, old.size());
            const auto ends_before = old;
            for (const auto& s : after.levels[k].stencils) {
                const auto split = splits.find(sorted(ends_before[s.a], ends_before[s.b]));
                ASSERT_NE(split, splits.end());
                const std::size_t now = old.size() - patched.stays.size(), then = split->second - vertices;
                ASSERT_EQ(after.displacements[now], before.displacements[then]);
                ASSERT_EQ(now < after.colours.size(), then < before.colours.size());
                ASSERT_TRUE(now >= after.colours.size() || after.colours[now] == before.colours[then]);
                old.push_back(split->second);
            }
            above = after.levels[k].triangles;
        }
        EXPECT_GT(after.vertices(), 0u);
        EXPECT_LT(after.vertices(), before.vertices());
    }
}

TEST(SurfaceDetail, triangles_of_a_patch_that_lie_on_each_other_do_not_make_it_grow) {
    const auto frame = some_detail();
    auto patched = without(frame.mesh, std::vector<bool>(frame.mesh.positions.size(), false));
    patched.mesh.triangles.insert(patched.mesh.triangles.end(), 3000, patched.mesh.triangles[7]);
    const auto after = detail_that_stays(frame.detail, frame.mesh.positions.size(), patched.stays, patched.mesh);
    EXPECT_LE(after.vertices(), frame.detail.vertices());
    const auto most = 4 * (patched.mesh.positions.size() + frame.detail.vertices());
    for (const auto& level : after.levels) EXPECT_LE(level.triangles.size(), most);
    EXPECT_LT(after.levels.size(), frame.detail.levels.size()) << "what would be too much is left out";
}

TEST(SurfaceDetail, nothing_stays_of_none_and_none_of_what_is_all_gone) {
    const auto frame = some_detail();
    auto gone = without(frame.mesh, std::vector<bool>(frame.mesh.positions.size(), true));
    EXPECT_TRUE(detail_that_stays(frame.detail, frame.mesh.positions.size(), gone.stays, gone.mesh).empty());
    const auto all = without(frame.mesh, std::vector<bool>(frame.mesh.positions.size(), false));
    EXPECT_TRUE(detail_that_stays({}, frame.mesh.positions.size(), all.stays, all.mesh).empty());
}

}  // namespace
}  // namespace htvm::internal
