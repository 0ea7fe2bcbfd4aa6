// Patches as they are coded: what goes, the open border, the piece. Any patch of any mesh comes back; damaged layers
// give a valid mesh, or an error.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "codec/patches_by_chance.h"

namespace htvm::internal {
namespace {

using namespace test;

struct TestSurface {
    std::vector<LatticePoint> positions;
    std::vector<Triangle> triangles;
    std::vector<Colour> colours;
    VertexHierarchy hierarchy;

    TrackedSurface tracked() const { return {positions, triangles, colours}; }
};

TestSurface surface_of(const tfan_test::TestMesh& mesh, bool coloured = true) {
    TestSurface out{tfan_test::positions_of(mesh, 3), mesh.triangles, {}, {}};
    for (std::size_t v = 0; coloured && v < out.positions.size(); ++v) out.colours.push_back(colour_of(v * 7));
    out.hierarchy = *build_vertex_hierarchy(out.positions, out.triangles);
    return out;
}

struct CodedPatch {
    FramePayload payload;
    PatchedSurface surface;
};

CodedPatch coded(const TestSurface& surface, const SurfacePatch& patch, const PatchSteps& steps) {
    CodedPatch out;
    out.surface = encode_patch(surface.tracked(), surface.hierarchy, patch, steps, out.payload).value();
    return out;
}

Result<PatchedSurface> decoded(const TestSurface& surface, const FramePayload& payload) {
    return decode_patch(view_of(payload), surface.tracked(), surface.hierarchy);
}

std::vector<bool> only(std::size_t vertices, std::initializer_list<std::uint32_t> removed) {
    std::vector<bool> out(vertices, false);
    for (const auto v : removed) out[v] = true;
    return out;
}

// Each triangle by the places of its corners, from the lowest one on, all sorted.
using Corners = std::array<std::array<std::int32_t, 3>, 3>;
std::vector<Corners> by_place(const std::vector<LatticePoint>& positions, const std::vector<Triangle>& triangles) {
    std::vector<Corners> out;
    for (const auto& t : triangles) {
        Corners corners{};
        for (std::size_t i = 0; i < 3; ++i) corners[i] = {positions[t[i]].x, positions[t[i]].y, positions[t[i]].z};
        out.push_back(std::min(
            {corners, Corners{corners[1], corners[2], corners[0]}, Corners{corners[2], corners[0], corners[1]}}));
    }
    std::sort(out.begin(), out.end());
    return out;
}

// 0  1  2  3
// 4  5  6  7      the diagonals go from 1 to 4
// 8  9  10 11
// 12 13 14 15
const auto four_by_four = tfan_test::grid(4, 4);

TEST(OpenBorder, GoesAroundAHoleFromItsLowestVertexAlongTheTrianglesThatGo) {
    EXPECT_EQ(open_border(four_by_four.triangles, only(16, {5})), (std::vector<std::uint32_t>{1, 2, 6, 9, 8, 4}));
}

TEST(OpenBorder, EndsAtTheMeshsOwnBorder) {
    EXPECT_EQ(open_border(four_by_four.triangles, only(16, {0})), (std::vector<std::uint32_t>{1, 4}));
    EXPECT_EQ(open_border(four_by_four.triangles, only(16, {0, 15})), (std::vector<std::uint32_t>{1, 4, 11, 14}));
}

TEST(OpenBorder, LeavesOutVerticesAllOfWhoseTrianglesGo) {
    // 0 stays, and loses its only triangle; the edge from 5 to 2 faces 1, that from 8 to 5 faces 4.
    EXPECT_EQ(open_border(four_by_four.triangles, only(16, {1, 4})), (std::vector<std::uint32_t>{2, 5, 8}));
}

TEST(OpenBorder, IsEmptyWhereNothingOrEverythingGoes) {
    EXPECT_TRUE(open_border(four_by_four.triangles, only(16, {})).empty());
    EXPECT_TRUE(open_border(four_by_four.triangles, std::vector<bool>(16, true)).empty());
    EXPECT_TRUE(open_border({}, only(3, {1})).empty());
}

TEST(CodedPatch, OfAnyMeshComesBackWhateverGoesAndComes) {
    std::mt19937 random(5);
    for (const auto& mesh : tfan_test::special_meshes()) {
        if (mesh.vertex_count > 300) continue;
        SCOPED_TRACE(mesh.name);
        const auto surface = surface_of(mesh, below(random, 3) > 0);
        for (const auto what : removals)
            for (const std::uint32_t triangles : {0, 1, 40}) {
                const PatchSteps steps{between(random, 1, 50), between(random, 1, 255)};
                const auto patch = patch_by_chance(surface.tracked(), what, triangles, steps.geometry, random);
                const auto coding = coded(surface, patch, steps);
                const auto again = decoded(surface, coding.payload);
                ASSERT_TRUE(again.has_value()) << again.error().message;
                EXPECT_EQ(again->stays, coding.surface.stays);
                EXPECT_EQ(again->mesh.positions, coding.surface.mesh.positions);
                EXPECT_EQ(again->mesh.colours, coding.surface.mesh.colours);
                EXPECT_EQ(again->mesh.triangles, coding.surface.mesh.triangles);

                // What stays is untouched and comes first.
                std::size_t kept = 0;
                for (std::size_t v = 0; v < surface.positions.size(); ++v) {
                    if (patch.removed[v]) continue;
                    ASSERT_EQ(again->mesh.positions.at(kept), surface.positions[v]);
                    if (!surface.colours.empty()) {
                        EXPECT_EQ(again->mesh.colours[kept], surface.colours[v]);
                    }
                    ++kept;
                }
                EXPECT_EQ(kept, again->stays.size());
                // All triangles, the piece's too, are where they were.
                auto positions = surface.positions;
                positions.insert(positions.end(), patch.positions.begin(), patch.positions.end());
                auto expected = patch.triangles;
                for (const auto& t : surface.triangles)
                    if (std::none_of(t.begin(), t.end(), [&](auto v) { return patch.removed[v]; }))
                        expected.push_back(t);
                EXPECT_EQ(by_place(again->mesh.positions, again->mesh.triangles), by_place(positions, expected));
            }
    }
}

TEST(CodedPatch, HasNewColoursWithinHalfAStep) {
    const auto surface = surface_of(four_by_four);
    SurfacePatch patch{only(16, {5}), {{1, 2, 16}, {2, 6, 16}, {6, 9, 16}}, {{120, 130, 40}}, {{10, 200, 90}}};
    for (const int step : {1, 9, 60}) {
        const auto again = decoded(surface, coded(surface, patch, {8, step}).payload).value();
        ASSERT_EQ(again.mesh.colours.size(), 16u);
        for (std::size_t c = 0; c < 3; ++c)
            EXPECT_LE(std::abs(again.mesh.colours[15][c] - patch.colours[0][c]), step / 2);
    }
}

TEST(CodedPatch, LeavesOutNewVerticesThatNoTriangleNames) {
    const auto surface = surface_of(four_by_four, false);
    const SurfacePatch patch{only(16, {5}), {{1, 2, 17}}, {{8, 8, 8}, {160, 80, 0}}, {}};
    const auto again = decoded(surface, coded(surface, patch, {8, 1}).payload).value();
    ASSERT_EQ(again.mesh.positions.size(), 16u);
    EXPECT_EQ(again.mesh.positions[15], (LatticePoint{160, 80, 0}));
}

// A strip of the given length whose middle row goes, filled from the border on both sides.
std::size_t bytes_of_filled_strip(std::uint32_t length) {
    const auto surface = surface_of(tfan_test::grid(length, 5));
    SurfacePatch patch;
    patch.removed.assign(surface.positions.size(), false);
    for (std::uint32_t x = 1; x + 1 < length; ++x) patch.removed[2 * length + x] = true;
    for (std::uint32_t x = 1; x + 2 < length; ++x) {
        const auto a = length + x, b = a + 1, c = 3 * length + x, d = c + 1;
        patch.triangles.push_back({a, b, c});
        patch.triangles.push_back({b, d, c});
    }
    const auto coding = coded(surface, patch, {8, 4});
    EXPECT_EQ(coding.payload.header.vertices, 2 * (length - 2));
    EXPECT_EQ(coding.surface.stays.size(), coding.surface.mesh.positions.size());
    return coding.payload.of(Layer::geometry).size() + coding.payload.of(Layer::colour).size();
}

TEST(CodedPatch, TakesNoBytesForPositionsAndColoursOfVerticesOnTheBorder) {
    EXPECT_LE(bytes_of_filled_strip(8), 12u);
    EXPECT_EQ(bytes_of_filled_strip(100), bytes_of_filled_strip(8));
}

TEST(CodedPatch, ThatOnlyTakesAwayARegionTakesFewBytes) {
    const auto surface = surface_of(tfan_test::grid(60, 60));
    std::mt19937 random(1);
    const SurfacePatch patch{removed_by_chance(Removal::region, surface.positions, random), {}, {}, {}};
    const auto coding = coded(surface, patch, {});
    std::size_t bytes = 0;
    for (const auto& layer : coding.payload.layers) bytes += layer.size();
    EXPECT_LE(bytes, 60u);
    EXPECT_EQ(coding.surface.stays.size(), 3600 - 451u);
}

TEST(CodedPatch, ThatDoesNotFitItsMeshIsRefused) {
    const auto surface = surface_of(four_by_four);
    const SurfacePatch off_border{only(16, {5}), {{1, 2, 15}}, {}, {}},
        removed_corner{only(16, {5}), {{1, 2, 5}}, {}, {}}, no_such{only(16, {5}), {{1, 2, 16}}, {}, {}},
        too_few{only(15, {5}), {}, {}, {}}, no_colour{only(16, {5}), {{1, 2, 16}}, {{0, 0, 0}}, {}};
    for (const auto* patch : {&off_border, &removed_corner, &no_such, &too_few, &no_colour}) {
        FramePayload payload;
        const auto refused = encode_patch(surface.tracked(), surface.hierarchy, *patch, {}, payload);
        ASSERT_FALSE(refused.has_value());
        EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
    }
}

void expect_valid_or_corrupt(const TestSurface& surface, const FramePayload& payload) {
    const auto again = decoded(surface, payload);
    if (!again) {
        EXPECT_EQ(again.error().kind, ErrorKind::corrupt_stream) << again.error().message;
        return;
    }
    const auto& mesh = again->mesh;
    EXPECT_LE(again->stays.size(), surface.positions.size());
    EXPECT_LE(mesh.positions.size(), again->stays.size() + std::size_t{payload.header.vertices});
    EXPECT_EQ(mesh.colours.size(), mesh.positions.size());
    EXPECT_TRUE(std::all_of(mesh.positions.begin(), mesh.positions.end(), [](auto p) { return on_lattice(p); }));
    for (const auto& t : mesh.triangles)
        for (const auto v : t) ASSERT_LT(v, mesh.positions.size());
}

TEST(CodedPatch, WithALayerCutShortOrAByteChangedIsAValidMeshOrCorrupt) {
    std::mt19937 random(2);
    const auto surface = surface_of(tfan_test::grid(9, 9));
    for (const auto what : {Removal::region, Removal::some, Removal::all}) {
        const auto patch = patch_by_chance(surface.tracked(), what, 30, 5, random);
        const auto payload = coded(surface, patch, {5, 3}).payload;
        for (const auto layer : {Layer::removed, Layer::border, Layer::fans, Layer::geometry, Layer::colour}) {
            SCOPED_TRACE(static_cast<int>(layer));
            const auto& bytes = payload.of(layer);
            auto damaged = payload;
            for (std::size_t size = 0; size < bytes.size(); ++size) {
                damaged.set(layer, {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)});
                expect_valid_or_corrupt(surface, damaged);
            }
            for (std::size_t at = 0; at < bytes.size(); ++at)
                for (const int flip : {1, 16, 128, 255}) {
                    auto changed = bytes;
                    changed[at] = static_cast<std::uint8_t>(changed[at] ^ flip);
                    damaged.set(layer, std::move(changed));
                    expect_valid_or_corrupt(surface, damaged);
                }
        }
        for (const std::uint32_t wrong : {0u, 1u, 1000u}) {
            auto damaged = payload;
            damaged.header.vertices = wrong;
            expect_valid_or_corrupt(surface, damaged);
            damaged.header.triangles = wrong;
            expect_valid_or_corrupt(surface, damaged);
        }
    }
}

}  // namespace
}  // namespace htvm::internal
