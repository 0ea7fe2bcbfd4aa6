// What of the reference is shown: not each vertex that is seen for a moment, and not only what is seen in this frame.
#include "codec/encoder/tracked/presence_judge.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

namespace htvm::internal {
namespace {

constexpr std::uint32_t side = 31;
constexpr std::int32_t edge = 100;  // lattice units

// Adds a grid of so many vertices on each side.
void add_grid(LatticeMesh& mesh, std::uint32_t vertices, std::int32_t at) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (std::uint32_t y = 0; y < vertices; ++y)
        for (std::uint32_t x = 0; x < vertices; ++x)
            mesh.positions.push_back(
                {at + static_cast<std::int32_t>(x) * edge, static_cast<std::int32_t>(y) * edge, 0});
    for (std::uint32_t y = 0; y + 1 < vertices; ++y)
        for (std::uint32_t x = 0; x + 1 < vertices; ++x) {
            const std::uint32_t v = first + y * vertices + x;
            mesh.triangles.push_back({v, v + 1, v + vertices});
            mesh.triangles.push_back({v + 1, v + vertices + 1, v + vertices});
        }
}

// A grid that is tracked; frame by frame it is told what is seen of it.
struct Tracked {
    LatticeMesh mesh;
    VerticesAround around;
    PresenceOptions options;
    PresenceHistory history;
    Presence of_reference;

    Tracked() {
        add_grid(mesh, side, 0);
        around = vertices_around(mesh.positions.size(), mesh.triangles);
    }
    void add_part(std::uint32_t vertices) {
        add_grid(mesh, vertices, 10000);
        around = vertices_around(mesh.positions.size(), mesh.triangles);
    }
    const Presence& judge(const std::function<bool(std::uint32_t x, std::uint32_t y)>& is_seen) {
        std::vector<std::uint8_t> seen(mesh.positions.size(), 1);
        for (std::uint32_t v = 0; v < side * side; ++v) seen[v] = is_seen(v % side, v / side) ? 1 : 0;
        history = judge_presence(seen, {mesh.positions, mesh.triangles, around, of_reference}, history, options);
        return history.shown;
    }
    std::uint8_t shown(std::uint32_t x, std::uint32_t y) const { return history.shown[y * side + x]; }
    bool shows_all() const { return std::ranges::find(history.shown, 0) == history.shown.end(); }
};

bool everything(std::uint32_t, std::uint32_t) { return true; }
bool around_a_hole(std::uint32_t x, std::uint32_t y) { return x < 12 || x > 18 || y < 12 || y > 18; }
bool left_half(std::uint32_t x, std::uint32_t) { return x < 15; }

TEST(PresenceJudge, WhatIsSeenIsShownFromTheFirstFrameOn) {
    Tracked surface;
    for (int frame = 0; frame < 3; ++frame) {
        surface.judge(everything);
        EXPECT_TRUE(surface.shows_all());
    }
}

TEST(PresenceJudge, AHoleThatOpensForAMomentIsFilledAndOneThatStaysIsNot) {
    Tracked surface;
    for (int frame = 0; frame < 4; ++frame) surface.judge(everything);
    for (int frame = 1; frame <= surface.options.hold; ++frame) {
        surface.judge(around_a_hole);
        ASSERT_TRUE(surface.shows_all()) << frame;
    }
    surface.judge(around_a_hole);
    EXPECT_EQ(surface.shown(15, 15), 0);
    EXPECT_EQ(surface.shown(5, 5), 1);
}

TEST(PresenceJudge, WithoutFillingAHoleShowsWithinTwoFrames) {
    Tracked surface;
    surface.options.fill = false;
    for (int frame = 0; frame < 4; ++frame) surface.judge(everything);
    for (int frame = 0; frame < 2; ++frame) surface.judge(around_a_hole);
    EXPECT_EQ(surface.shown(15, 15), 0);
    EXPECT_EQ(surface.shown(5, 5), 1);
}

TEST(PresenceJudge, APartThatVanishesToItsBorderIsGoneWithinTwoFrames) {
    Tracked surface;
    for (int frame = 0; frame < 4; ++frame) surface.judge(everything);
    for (int frame = 0; frame < 2; ++frame) surface.judge(left_half);
    for (std::uint32_t y = 0; y < side; ++y) {
        EXPECT_EQ(surface.shown(12, y), 1);
        EXPECT_EQ(surface.shown(18, y), 0);
        EXPECT_EQ(surface.shown(30, y), 0);
    }
}

TEST(PresenceJudge, WhatComesBackIsShownWithinTwoFrames) {
    Tracked surface;
    surface.of_reference.assign(side * side, 1);
    for (std::uint32_t v = 0; v < side * side; ++v) surface.of_reference[v] = left_half(v % side, v / side) ? 1 : 0;
    for (int frame = 0; frame < 3; ++frame) surface.judge(left_half);
    EXPECT_EQ(surface.shown(20, 15), 0) << "not there in the reference itself, nor seen";
    EXPECT_EQ(surface.shown(10, 15), 1);
    for (int frame = 0; frame < 2; ++frame) surface.judge(everything);
    EXPECT_TRUE(surface.shows_all());
}

TEST(PresenceJudge, ARimThatFlickersFromFrameToFrameIsCalm) {
    Tracked surface;
    int frame = 0;
    // One column more is seen in every other frame.
    const auto flickering = [&](std::uint32_t x, std::uint32_t) { return x < (frame % 2 == 0 ? 15U : 16U); };
    for (; frame < 8; ++frame) surface.judge(flickering);
    const auto settled = surface.history.shown;
    for (; frame < 20; ++frame) EXPECT_EQ(surface.judge(flickering), settled) << frame;
    EXPECT_EQ(surface.shown(10, 15), 1);
    EXPECT_EQ(surface.shown(20, 15), 0);
}

TEST(PresenceJudge, SpecksAreLeftOutAndLargerPartsAreNot) {
    // Squares of 2 and of 6 edges, where specks are smaller than a square of 3.2.
    for (const std::uint32_t vertices : {3U, 7U}) {
        Tracked surface;
        surface.add_part(vertices);
        for (int frame = 0; frame < 3; ++frame) surface.judge(everything);
        EXPECT_EQ(surface.history.shown.back(), vertices == 3 ? 0 : 1);
        EXPECT_EQ(surface.shown(15, 15), 1);
        surface.options.leave_out_specks = false;
        for (int frame = 0; frame < 3; ++frame) surface.judge(everything);
        EXPECT_TRUE(surface.shows_all());
    }
}

TEST(PresenceJudge, UnseenFramesAreCountedUntilItIsSeenAgain) {
    Tracked surface;
    for (int frame = 0; frame < 3; ++frame) surface.judge(left_half);
    EXPECT_EQ(surface.history.unseen[20], 3);
    EXPECT_EQ(surface.history.unseen[5], 0);
    surface.judge(everything);
    EXPECT_EQ(surface.history.unseen[20], 0);
}

TEST(PresenceJudge, ANewReferenceKeepsWhatWasKnownOfWhatStaysAndShowsWhatIsNew) {
    Tracked surface;
    for (int frame = 0; frame < 3; ++frame) surface.judge(left_half);
    const std::vector<std::uint32_t> kept = {5, 20};
    const auto renewed = on_new_reference(surface.history, kept, 4);
    EXPECT_EQ(renewed.shown, (Presence{1, 0, 1, 1}));
    EXPECT_EQ(renewed.unseen, (std::vector<std::uint16_t>{0, 3, 0, 0}));
    EXPECT_EQ(renewed.score[0], surface.history.score[5]);
    EXPECT_EQ(renewed.score[1], surface.history.score[20]);
    EXPECT_TRUE(on_new_reference({}, kept, 4).shown.empty()) << "in a stream that does not tell presence";
}

}  // namespace
}  // namespace htvm::internal
