// Synthetic textures: what is drawn into the atlas is what the surface's colours are, wherever it lies there.
#include "synth/texture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace htvm {
namespace {

SynthOptions small(SynthMotion motion = SynthMotion::tour) {
    SynthOptions options;
    options.vertices = 6000;
    options.motion = motion;
    return options;
}

constexpr SynthTextureOptions fine{.size = 1024, .noise = 0, .exposure = 0};

SynthTexture made_at(const SynthOptions& options, int frame, const SynthTextureOptions& texture = fine) {
    return synth_texture(options, texture, synth_frame(options, frame), frame);
}

TEST(SynthTexture, HasTheFramesTrianglesOnVerticesThatChartsShareNot) {
    const SynthOptions options = small();
    const SynthFrame frame = synth_frame(options, 20);
    const SynthTexture texture = synth_texture(options, fine, frame, 20);
    ASSERT_EQ(texture.mesh.triangles.size(), frame.mesh.triangles.size());
    ASSERT_EQ(texture.vertices.size(), texture.mesh.positions.size());
    EXPECT_EQ(texture.mesh.texcoords.size(), texture.mesh.positions.size());
    EXPECT_TRUE(texture.mesh.colours.empty());
    for (std::size_t t = 0; t < frame.mesh.triangles.size(); ++t)
        for (std::size_t c = 0; c < 3; ++c)
            ASSERT_EQ(texture.vertices[texture.mesh.triangles[t][c]], frame.mesh.triangles[t][c]);
    for (std::size_t v = 0; v < texture.vertices.size(); ++v)
        ASSERT_EQ(texture.mesh.positions[v], frame.mesh.positions[texture.vertices[v]]);
    EXPECT_GT(texture.mesh.positions.size(), frame.mesh.positions.size());
    EXPECT_LT(texture.mesh.positions.size(), frame.mesh.positions.size() * 3 / 2);
    for (const auto& [u, v] : texture.mesh.texcoords) EXPECT_TRUE(u >= 0 && u <= 1 && v >= 0 && v <= 1);
}

// The share of vertices at which the atlas shows the surface's own colour, but for `levels`.
double share_alike(const SynthOptions& options, int frame, int levels) {
    const SynthFrame captured = synth_frame(options, frame);
    const SynthTexture texture = synth_texture(options, fine, captured, frame);
    const internal::ImagePyramid image(texture.exact);
    std::size_t alike = 0;
    for (std::size_t v = 0; v < texture.vertices.size(); ++v) {
        const auto& [u, w] = texture.mesh.texcoords[v];
        const auto there = image.at(u, w);
        const Colour& own = captured.mesh.colours[texture.vertices[v]];
        bool is_alike = true;
        for (std::size_t c = 0; c < 3; ++c)
            is_alike = is_alike && std::abs(there[c] - own[c]) <= static_cast<float>(levels);
        alike += is_alike;
    }
    return static_cast<double>(alike) / static_cast<double>(texture.vertices.size());
}

TEST(SynthTexture, ShowsTheColoursOfTheSurface) {
    // Where patterns have edges the texel beside may be of the other colour.
    EXPECT_GT(share_alike(small(), 30, 40), 0.95);
    EXPECT_GT(share_alike(small(SynthMotion::everyday), 200, 40), 0.95) << "with things, and hands that touch";
}

TEST(SynthTexture, KeepsItsLayoutForASecondAndThenHasAnother) {
    const SynthOptions options = small();
    // How far apart the same place of the body lies in the images of two frames, by the colours there.
    const auto same_texels = [](const SynthTexture& a, const SynthTexture& b) {
        std::size_t same = 0, drawn = 0;
        for (std::size_t i = 0; i < a.exact.rgb.size(); i += 3) {
            if (a.exact.rgb[i] + a.exact.rgb[i + 1] + a.exact.rgb[i + 2] == 0) continue;
            ++drawn;
            bool is_same = true;
            for (std::size_t c = i; c < i + 3; ++c)
                is_same = is_same && std::abs(a.exact.rgb[c] - b.exact.rgb[c]) <= 20;
            same += is_same;
        }
        return static_cast<double>(same) / static_cast<double>(drawn);
    };
    const SynthTexture first = made_at(options, 32), later = made_at(options, 58), other = made_at(options, 61);
    EXPECT_EQ(first.layout, 1);
    EXPECT_EQ(later.layout, 1);
    EXPECT_EQ(other.layout, 2);
    EXPECT_GT(same_texels(first, later), 0.85);
    EXPECT_LT(same_texels(first, other), 0.5);
}

TEST(SynthTexture, TheCamerasNoiseAndExposureAreOnTopOfTheTruth) {
    const SynthOptions options = small();
    const SynthTextureOptions seen{.size = 512, .noise = 3, .exposure = 10};
    const SynthTexture a = made_at(options, 40, seen);
    double squared = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.exact.rgb.size(); ++i) {
        const double expected = a.gain[i % 3] * a.exact.rgb[i];
        if (a.exact.rgb[i] < 20 || expected > 235) continue;  // where nothing is cut off
        squared += (a.image.rgb[i] - expected) * (a.image.rgb[i] - expected);
        ++count;
    }
    EXPECT_NEAR(std::sqrt(squared / static_cast<double>(count)), 3, 0.1);
    double lowest = 2, highest = 0;
    for (int frame = 0; frame < 120; frame += 10) {
        const double gain = made_at(options, frame, {.size = 64, .noise = 0, .exposure = 10}).gain[1];
        lowest = std::min(lowest, gain);
        highest = std::max(highest, gain);
    }
    EXPECT_GT(highest - lowest, 0.1);
    EXPECT_LT(highest - lowest, 0.35);
}

TEST(SynthTexture, IsTheSameForAnyNumberOfThreads) {
    const SynthOptions options = small();
    const SynthFrame frame = synth_frame(options, 10);
    const SynthTextureOptions seen{.size = 256, .noise = 2, .exposure = 5};
    const SynthTexture one = synth_texture(options, seen, frame, 10);
    const internal::ThreadPool pool(3);
    const SynthTexture three = synth_texture(options, seen, frame, 10, pool.threads());
    EXPECT_EQ(one.image.rgb, three.image.rgb);
    EXPECT_EQ(one.mesh.texcoords, three.mesh.texcoords);
}

TEST(SynthTexture, OptionsOutOfRangeAreRefused) {
    EXPECT_TRUE(check_texture_options({}).has_value());
    EXPECT_FALSE(check_texture_options({.size = 63}).has_value());
    EXPECT_FALSE(check_texture_options({.size = 4097}).has_value());
    EXPECT_FALSE(check_texture_options({.noise = -1}).has_value());
    EXPECT_FALSE(check_texture_options({.exposure = 51}).has_value());
}

}  // namespace
}  // namespace htvm
