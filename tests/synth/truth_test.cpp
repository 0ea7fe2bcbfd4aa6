// The truth beside a synthetic capture.
#include "synth/truth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "synth/body.h"
#include "synth/choreography.h"

namespace htvm {
namespace {

SynthOptions with_motion(SynthMotion motion) {
    SynthOptions options;
    options.motion = motion;
    options.vertices = 2000;
    return options;
}

double length_of(const Vector3f& v) { return std::hypot(v[0], v[1], v[2]); }

TEST(SynthTruth, MarksThatAreSeenLieOnTheTrueSurface) {
    for (const SynthMotion motion : {SynthMotion::tour, SynthMotion::everyday, SynthMotion::fast}) {
        const SynthOptions options = with_motion(motion);
        const auto marks = surface_marks(options, 300);
        ASSERT_EQ(marks.size(), 300u);
        for (const int frame : {0, 50, 100}) {
            const TrueFrame truth = true_frame(options, marks, frame);
            const auto scene = synth::pose_scene(motion, 1, options.seed, frame / options.fps);
            std::size_t seen = 0, present = 0;
            for (std::size_t i = 0; i < marks.size(); ++i) {
                present += (scene.present & synth::part_bit(marks[i].part)) != 0;
                if (length_of(truth.normals[i]) < 0.5) continue;
                ++seen;
                EXPECT_NEAR(length_of(truth.normals[i]), 1, 1e-3);
                const auto& p = truth.positions[i];
                EXPECT_LT(std::abs(synth::evaluate_surface(scene, scene.present, {p[0], p[1], p[2]}).distance), 0.5);
            }
            EXPECT_GT(seen, present * 85 / 100) << "frame " << frame;
        }
    }
}

TEST(SynthTruth, AMarkKeepsItsColour) {
    // What is seen at a mark is where the body's own coordinates are the mark's.
    const SynthOptions options = with_motion(SynthMotion::fast);
    const auto marks = surface_marks(options, 200);
    const TrueFrame truth = true_frame(options, marks, 40);
    const auto scene = synth::pose_scene(options.motion, 1, options.seed, 40 / options.fps);
    for (std::size_t i = 0; i < marks.size(); ++i) {
        if (length_of(truth.normals[i]) < 0.5) continue;
        const auto& p = truth.positions[i];
        const Eigen::Vector3d rest = synth::evaluate_surface(scene, scene.present, {p[0], p[1], p[2]}).rest;
        EXPECT_LT((rest - Eigen::Vector3d(marks[i].rest[0], marks[i].rest[1], marks[i].rest[2])).norm(), 6.1);
    }
}

TEST(SynthTruth, TheSameMarksForTheSameSeed) {
    SynthOptions options = with_motion(SynthMotion::everyday);
    const auto one = surface_marks(options, 50), same = surface_marks(options, 50);
    options.seed = 2;
    const auto other = surface_marks(options, 50);
    const auto places = [](const std::vector<SurfaceMark>& marks) {
        std::vector<Vector3d> out;
        for (const auto& mark : marks) out.push_back(mark.rest);
        return out;
    };
    EXPECT_EQ(places(one), places(same));
    EXPECT_NE(places(one), places(other));
}

TEST(SynthTruth, TrueSurfaceAndMeshDifferByTheNoiseAlone) {
    SynthOptions options = with_motion(SynthMotion::calm);
    const SynthFrame noisy = synth_frame(options, 3);
    options.surface_noise_power = 0;
    const SynthFrame exact = synth_frame(options, 3);
    EXPECT_EQ(noisy.true_positions, exact.mesh.positions);
    EXPECT_NE(noisy.true_positions, noisy.mesh.positions);
}

std::vector<LimbState> limb_at(double x, double gap, double seen = 1) {
    LimbState limb;
    limb.part = 8;
    limb.centre = {x, 0, 0};
    limb.gap = gap;
    limb.nearest = 11;
    limb.seen = seen;
    return {limb};
}

TEST(SynthTruth, EventsSayFromWhichFrameToWhich) {
    const std::vector<std::vector<LimbState>> frames = {limb_at(0, 90),   limb_at(250, 90),      limb_at(550, 90),
                                                        limb_at(560, 2),  limb_at(560, -1, 0.4), limb_at(560, 3),
                                                        limb_at(570, 90), limb_at(575, 90)};
    const auto events = limb_events(frames, 100, 30);
    ASSERT_EQ(events.size(), 4u);
    EXPECT_EQ(events[0].kind, LimbEventKind::fast);
    EXPECT_EQ(events[0].first, 101);
    EXPECT_EQ(events[0].last, 102);
    EXPECT_DOUBLE_EQ(events[0].largest_step, 300);
    EXPECT_EQ(events[1].kind, LimbEventKind::touch);
    EXPECT_EQ(events[1].first, 103);
    EXPECT_EQ(events[1].last, 105);
    EXPECT_EQ(events[1].other, 11u);
    EXPECT_EQ(events[2].kind, LimbEventKind::occluded);
    EXPECT_EQ(events[2].first, 104);
    EXPECT_EQ(events[2].last, 104);
    EXPECT_EQ(events[3].kind, LimbEventKind::release);
    EXPECT_EQ(events[3].first, 105);
    EXPECT_EQ(events[3].last, 106);
}

TEST(SynthTruth, LimbsOfFastMotionAreFastTouchAndComeOff) {
    const SynthOptions options = with_motion(SynthMotion::fast);
    std::vector<std::vector<LimbState>> frames;
    for (int frame = 0; frame < 240; ++frame) frames.push_back(true_frame(options, {}, frame).limbs);
    const auto events = limb_events(frames, 0, options.fps);
    const auto count = [&](LimbEventKind kind) { return std::ranges::count(events, kind, &LimbEvent::kind); };
    EXPECT_GT(count(LimbEventKind::fast), 10);
    EXPECT_GT(count(LimbEventKind::touch), 3);
    EXPECT_GT(count(LimbEventKind::release), 3);
    EXPECT_GT(std::ranges::max(events, {}, &LimbEvent::largest_step).largest_step, 300);
}

}  // namespace
}  // namespace htvm
