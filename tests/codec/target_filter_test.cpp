// What T-frames are to say, filtered over time: noise goes, motion stays.
#include "codec/encoder/tracked/target_filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "codec/enhanced_options.h"
#include "codec/height_field.h"
#include "codec/test_sequences.h"
#include "surface/surface_distance.h"

namespace htvm::internal {
namespace {

using namespace test;

constexpr std::int32_t side = 40;
const LatticeMesh square = height_field(side, 200, flat);
constexpr double noise = 24;  // lattice units, and levels: 1.5 mm

bool in_the_middle(std::size_t vertex) {
    const auto x = vertex % (side + 1), y = vertex / (side + 1);
    return x >= 15 && x < 25 && y >= 15 && y < 25;
}

// Targets of a square in frame after frame, with noise that is new in each.
class Capture {
public:
    explicit Capture(double noise_now) : noise_(noise_now) {}

    // truth: of the displacement, by vertex; the colours have the same.
    template <class Truth>
    TrackedTargets next(const Truth& truth) {
        std::normal_distribution<double> error(0, noise_);
        TrackedTargets out;
        const auto seen = [&](std::size_t v) {
            return static_cast<std::int32_t>(std::lround(truth(v) + error(random_)));
        };
        for (std::size_t v = 0; v < square.positions.size(); ++v) {
            out.displacement.push_back(seen(v));
            for (int c = 0; c < 3; ++c) out.colours.push_back(seen(v));
        }
        return out;
    }

private:
    double noise_;
    std::mt19937 random_{1};
};

struct Errors {
    double displacement = 0, colours = 0;  // RMS
};

template <class Truth>
Errors errors_of(const TrackedTargets& targets, const Truth& truth) {
    Errors out;
    const std::size_t vertices = square.positions.size();
    for (std::size_t v = 0; v < vertices; ++v) {
        out.displacement += std::pow(targets.displacement[v] - truth(v), 2);
        for (std::size_t c = 0; c < 3; ++c) out.colours += std::pow(targets.colours[3 * v + c] - truth(v), 2) / 3;
    }
    return {std::sqrt(out.displacement / static_cast<double>(vertices)),
            std::sqrt(out.colours / static_cast<double>(vertices))};
}

constexpr TargetFilterOptions options{
    .geometry_step = LatticeUnits(16), .colour_step = 8, .captured_edge = LatticeUnits(100)};

// The history behind `frames` frames of a surface that is still.
TargetHistory after_stillness(Capture& capture, int frames) {
    TargetHistory out;
    for (int t = 0; t < frames; ++t) {
        auto targets = capture.next([](std::size_t) { return 0; });
        out = filter_targets(targets, square.triangles, out, options);
    }
    return out;
}

TEST(FilteredTargets, HaveLessThanHalfOfTheNoiseAndColoursTwoThirds) {
    Capture capture(noise);
    const auto still = [](std::size_t) { return 0.0; };
    auto history = after_stillness(capture, 12);
    for (int t = 0; t < 5; ++t) {
        auto targets = capture.next(still);
        history = filter_targets(targets, square.triangles, history, options);
        const auto errors = errors_of(targets, still);
        EXPECT_LT(errors.displacement, 0.45 * noise);
        EXPECT_LT(errors.colours, 0.67 * noise);
    }
    // As measured: most of the variance is detail.
    EXPECT_NEAR(std::sqrt(history.usual_noise[0]), 0.9 * noise, 0.1 * noise);
}

TEST(FilteredTargets, FollowAStepOfFiveMillimetresWithinTwoFrames) {
    Capture capture(noise);
    auto history = after_stillness(capture, 12);
    const auto moved = [](std::size_t v) { return in_the_middle(v) ? 80.0 : 0.0; };
    for (int t = 0; t < 3; ++t) {
        auto targets = capture.next(moved);
        history = filter_targets(targets, square.triangles, history, options);
        double mean = 0;
        for (std::size_t v = 0; v < square.positions.size(); ++v)
            if (in_the_middle(v)) mean += targets.displacement[v] / 100.0;
        EXPECT_GT(mean, t == 0 ? 0.75 * 80 : 0.9 * 80) << t;
        EXPECT_LT(mean, 1.1 * 80) << t;
    }
}

TEST(FilteredTargets, LagBehindSteadyMotionByLessThanTheNoise) {
    Capture capture(noise);
    auto history = after_stillness(capture, 12);
    for (int t = 1; t <= 30; ++t) {
        const auto ripple = [&](std::size_t v) { return v % 2 == 0 ? 8.0 * t : 0.0; };  // 0.5 mm a frame
        auto targets = capture.next(ripple);
        history = filter_targets(targets, square.triangles, history, options);
        EXPECT_LT(errors_of(targets, ripple).displacement, noise) << t;
    }
}

TEST(FilteredTargets, AreTheSameWhereThereIsNoNoise) {
    Capture capture(0);
    TargetHistory history;
    for (int t = 0; t < 12; ++t) {
        auto targets = capture.next([&](std::size_t v) { return 100 * std::sin(0.2 * t) * (v % 7 == 0 ? 1 : -1); });
        const auto seen = targets;
        history = filter_targets(targets, square.triangles, history, options);
        EXPECT_EQ(targets.displacement, seen.displacement) << t;
        EXPECT_EQ(targets.colours, seen.colours) << t;
    }
}

TEST(FilteredTargets, OfANewReferenceBeginAnewButKnowTheNoise) {
    Capture capture(noise);
    const auto before = after_stillness(capture, 12);
    const auto anew = on_new_reference(before, {}, 0, options);
    EXPECT_TRUE(anew.seen.empty());
    EXPECT_EQ(anew.usual_noise, before.usual_noise);
    const auto still = [](std::size_t) { return 0.0; };
    auto targets = capture.next(still);
    const double seen = errors_of(targets, still).displacement;
    filter_targets(targets, square.triangles, anew, options);
    EXPECT_LT(errors_of(targets, still).displacement, 0.75 * seen);
}

TEST(FilteredTargets, KnowTheVerticesThatAPatchKeeps) {
    Capture capture(noise);
    auto before = after_stillness(capture, 12);
    before.noise[7] = {1234, 5};
    before.unsure[7] = {100, 10};
    const std::vector<std::uint32_t> kept = {3, 7};
    const auto patched = on_new_reference(before, kept, 3, options);
    ASSERT_EQ(patched.noise.size(), 3u);
    EXPECT_EQ(patched.noise[1], before.noise[7]);
    EXPECT_EQ(patched.noise[2], before.usual_noise);
    EXPECT_FLOAT_EQ(patched.unsure[1][0], 100 + 16 * 16 / 12.0F);
    EXPECT_GT(patched.unsure[2][0], patched.unsure[1][0]);
}

// A synthetic person who hardly moves, and the same surface without its noise of 3 mm.
struct NoisyCapture {
    TestSequence seen{"noisy", {}, {}};
    std::vector<Mesh> truth;
};

NoisyCapture noisy_capture(int frames) {
    SynthOptions of_synth;
    of_synth.vertices = 8000;
    of_synth.surface_noise_power = 9;
    NoisyCapture out;
    for (int t = 0; t < frames; ++t) {
        auto frame = synth_frame(of_synth, t);
        out.truth.push_back(frame.mesh);
        out.truth.back().positions = frame.true_positions;
        out.seen.frames.push_back({std::move(frame.mesh), {}});
    }
    return out;
}

EncoderOptions with(Denoising denoise) {
    auto out = options_at_2_mm(Profile::tracked);
    out.tracked.denoise = denoise;
    return out;
}

double surface_error(const Mesh& a, const Mesh& b) {
    return surface_errors({a.positions, a.triangles, {}}, {b.positions, b.triangles, {}}).geometry_rms;
}

TEST(Denoising, TakesFewerBitsAndComesNearerToTheTrueSurfaceThanTheCaptureIs) {
    const auto capture = noisy_capture(8);
    const auto noisy = encode(capture.seen, with(Denoising::off)),
               calm = encode(capture.seen, with(Denoising::automatic));
    for (std::size_t t = 5; t < 8; ++t) {
        ASSERT_EQ(calm.infos[t].type, FrameType::tracked);
        EXPECT_LT(calm.infos[t].bytes.total(), 0.75 * static_cast<double>(noisy.infos[t].bytes.total()));
        const double left = surface_error(calm.reconstructions[t], capture.truth[t]);
        EXPECT_LT(left, 0.95 * surface_error(noisy.reconstructions[t], capture.truth[t]));
        EXPECT_LT(left, 0.87 * surface_error(capture.seen.frames[t].mesh, capture.truth[t]));
    }
}

TEST(Denoising, IsOffWhereAnErrorAgainstTheCaptureIsAskedFor) {
    const auto capture = noisy_capture(5);
    auto off = with(Denoising::off), automatic = with(Denoising::automatic);
    EXPECT_NE(encode(capture.seen, off).bytes, encode(capture.seen, automatic).bytes);
    off.rate.target_error = automatic.rate.target_error = 1;
    EXPECT_EQ(encode(capture.seen, off).bytes, encode(capture.seen, automatic).bytes);
}

}  // namespace
}  // namespace htvm::internal
