// TFAN as published and in MPEG-4: everything comes back, whatever the triangles, at about MPEG's own rate.
#include "tfan_mpeg.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "synth/synth.h"

namespace htvm::lab {
namespace {

// Distinct positions for `count` vertices, on the corners of the finest grid of 10 bits.
Mesh with_vertices(std::uint32_t count, std::vector<Triangle> triangles) {
    Mesh mesh;
    for (std::uint32_t v = 0; v < count; ++v)
        mesh.positions.push_back({static_cast<float>(v % 1024), static_cast<float>(v / 1024 % 1024), 0});
    mesh.positions.front() = {0, 0, 1023};  // the longest side: a cell is 1
    mesh.triangles = std::move(triangles);
    return mesh;
}

// Every triangle rotated so that its lowest vertex is first, and all sorted: equal for equal sets.
std::vector<Triangle> as_a_set(std::vector<Triangle> triangles) {
    for (auto& t : triangles) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    // A degenerate triangle (a, b, a) has two lowest corners, so both rotations count as the same.
    for (auto& t : triangles)
        if (t[0] == t[2]) t = {t[0], t[0], t[1]};
    std::sort(triangles.begin(), triangles.end());
    return triangles;
}

Mesh decoded(const MpegTfanFrame& frame) {
    const auto mesh = decode_mpeg_tfan(frame.bytes);
    EXPECT_TRUE(mesh) << mesh.error().message;
    return mesh ? *mesh : Mesh{};
}

// All triangles, in input numbers, and all positions come back.
void expect_the_same(const Mesh& mesh) {
    const auto frame = encode_mpeg_tfan(mesh, {});
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->bytes.size(), frame->layers.total());
    const Mesh back = decoded(*frame);
    ASSERT_EQ(mesh.positions.size(), back.positions.size());
    std::vector<std::uint32_t> order = frame->order;
    for (std::size_t v = 0; v < back.positions.size(); ++v) EXPECT_EQ(mesh.positions[order[v]], back.positions[v]);
    std::vector<Triangle> triangles = back.triangles;
    for (auto& t : triangles) t = {order[t[0]], order[t[1]], order[t[2]]};
    EXPECT_EQ(as_a_set(mesh.triangles), as_a_set(triangles));
    std::sort(order.begin(), order.end());
    for (std::uint32_t v = 0; v < order.size(); ++v) EXPECT_EQ(v, order[v]);
}

// A grid of 2 * side * side triangles, open at its border.
std::vector<Triangle> grid(std::uint32_t side) {
    std::vector<Triangle> out;
    for (std::uint32_t y = 0; y < side; ++y)
        for (std::uint32_t x = 0; x < side; ++x) {
            const std::uint32_t a = y * (side + 1) + x, b = a + 1, c = a + side + 1, d = c + 1;
            out.push_back({a, b, c});
            out.push_back({b, d, c});
        }
    return out;
}

TEST(TfanMpeg, gives_back_nothing_for_nothing) {
    expect_the_same(with_vertices(1, {}));
    const auto frame = encode_mpeg_tfan(Mesh{}, {});
    ASSERT_TRUE(frame);
    EXPECT_TRUE(decoded(*frame).positions.empty());
}

TEST(TfanMpeg, gives_back_open_and_closed_surfaces) {
    expect_the_same(with_vertices(3, {{0, 1, 2}}));
    expect_the_same(with_vertices(4, {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}));
    expect_the_same(with_vertices(21 * 21, grid(20)));
}

TEST(TfanMpeg, gives_back_isolated_vertices_in_their_places) {
    expect_the_same(with_vertices(8, {{1, 3, 5}}));
    const auto frame = encode_mpeg_tfan(with_vertices(4, {{1, 2, 3}}), {});
    ASSERT_TRUE(frame);
    EXPECT_EQ((std::vector<std::uint32_t>{0, 1, 2, 3}), frame->order);
}

TEST(TfanMpeg, gives_back_degenerate_and_duplicate_triangles) {
    expect_the_same(with_vertices(4, {{0, 0, 1}, {1, 2, 1}, {3, 3, 3}, {0, 1, 2}, {0, 1, 2}, {1, 2, 0}, {2, 1, 0}}));
}

TEST(TfanMpeg, gives_back_edges_and_vertices_that_are_not_manifold) {
    expect_the_same(with_vertices(5, {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}}));
    expect_the_same(with_vertices(5, {{0, 1, 2}, {0, 3, 4}}));
}

TEST(TfanMpeg, gives_back_mixed_orientation) {
    auto triangles = grid(20);
    for (std::size_t t = 0; t < triangles.size(); t += 3) std::swap(triangles[t][1], triangles[t][2]);
    expect_the_same(with_vertices(21 * 21, triangles));
}

TEST(TfanMpeg, gives_back_any_triangles) {
    std::mt19937 random(7);
    for (int round = 0; round < 50; ++round) {
        const std::uint32_t vertices = static_cast<std::uint32_t>(1 + random() % 40);
        std::vector<Triangle> triangles(random() % 120);
        for (auto& t : triangles)
            for (auto& v : t) v = static_cast<std::uint32_t>(random() % vertices);
        expect_the_same(with_vertices(vertices, triangles));
    }
}

// MPEG's reference software writes past its tables here.
TEST(TfanMpeg, gives_back_fans_of_more_than_256_vertices) {
    std::vector<Triangle> triangles;
    for (std::uint32_t v = 1; v < 20000; ++v) triangles.push_back({0, v, v + 1});
    expect_the_same(with_vertices(20001, triangles));
    for (auto& t : triangles) std::rotate(t.begin(), t.begin() + 1, t.end());
    std::reverse(triangles.begin(), triangles.end());
    expect_the_same(with_vertices(20001, triangles));
}

// The corner of the grid is one triangle of three new vertices (all new: configuration 6); then, at vertex 1, whose
// list is {2: one triangle}, fans begin there. Ten thousand such vertices take 2 bits each; ours, with contexts, less.
TEST(TfanMpeg, codes_a_regular_grid_in_a_bit_or_two_a_vertex) {
    const auto frame = encode_mpeg_tfan(with_vertices(101 * 101, grid(100)), {});
    ASSERT_TRUE(frame);
    EXPECT_LT(8.0 * static_cast<double>(frame->layers[Layer::fans]) / (101 * 101), 2.0);
    EXPECT_GT(frame->layers[Layer::fans], 100u);
}

TEST(TfanMpeg, quantises_positions_to_cells_of_the_longest_side) {
    SynthOptions options;
    options.vertices = 1500;
    Mesh mesh = synth_frame(options, 0).mesh;
    std::array<float, 3> low = mesh.positions[0], high = low;
    for (const auto& p : mesh.positions)
        for (std::size_t i = 0; i < 3; ++i) low[i] = std::min(low[i], p[i]), high[i] = std::max(high[i], p[i]);
    const double side = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
    std::size_t bytes_before = 0;
    for (const int bits : {8, 9, 10}) {
        const auto frame = encode_mpeg_tfan(mesh, {bits, 6});
        ASSERT_TRUE(frame);
        const Mesh back = decoded(*frame);
        double largest = 0, largest_colour = 0;
        for (std::size_t v = 0; v < mesh.positions.size(); ++v)
            for (std::size_t i = 0; i < 3; ++i) {
                largest =
                    std::max(largest, std::abs(double{mesh.positions[frame->order[v]][i]} - back.positions[v][i]));
                largest_colour = std::max(largest_colour,
                                          std::abs(1.0 * mesh.colours[frame->order[v]][i] - 1.0 * back.colours[v][i]));
            }
        EXPECT_LE(largest, 0.501 * side / (std::exp2(bits) - 1)) << bits;
        EXPECT_GT(largest, 0.4 * side / (std::exp2(bits) - 1)) << bits;
        EXPECT_LE(largest_colour, 3);
        EXPECT_GT(frame->bytes.size(), bytes_before);
        bytes_before = frame->bytes.size();
    }
}

TEST(TfanMpeg, refuses_what_is_no_mesh) {
    EXPECT_FALSE(encode_mpeg_tfan(with_vertices(3, {{0, 1, 3}}), {}));
    EXPECT_FALSE(encode_mpeg_tfan(with_vertices(3, {}), {0, 1}));
    EXPECT_FALSE(encode_mpeg_tfan(with_vertices(3, {}), {10, 0}));
    Mesh nowhere = with_vertices(3, {});
    nowhere.positions[1][1] = NAN;
    EXPECT_FALSE(encode_mpeg_tfan(nowhere, {}));
}

TEST(TfanMpeg, decodes_damaged_and_cut_frames_to_an_error_or_a_mesh) {
    const auto frame = encode_mpeg_tfan(with_vertices(11 * 11, grid(10)), {});
    ASSERT_TRUE(frame);
    std::mt19937 random(3);
    for (std::size_t size = 0; size < frame->bytes.size(); ++size)
        EXPECT_FALSE(decode_mpeg_tfan(std::span(frame->bytes).first(size))) << size;
    for (int round = 0; round < 500; ++round) {
        auto bytes = frame->bytes;
        bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1 + random() % 255);
        const auto mesh = decode_mpeg_tfan(bytes);
        if (!mesh) continue;
        for (const Triangle& t : mesh->triangles) EXPECT_LT(std::max({t[0], t[1], t[2]}), mesh->positions.size());
    }
}

}  // namespace
}  // namespace htvm::lab
